// The `exact` encoding in a .nif file: a grid with planes and a BVH for each object.
#pragma once

#include "formats/nif/bvh/encoding.hpp"
#include "formats/nif/exact/layout.hpp"
#include "formats/nif/proof/data.hpp"
#include "kernels/reference/exact/field.hpp"

namespace nif::format {

/// One object; members as in kernels::ExactField.
struct ExactData {
  ProofData proof;
  Bvh bvh;
};

/// The kernels' view of an object; valid while it lives and is not changed.
inline kernels::ExactField field_of(const ExactData& data) {
  return {proof_of(data.proof), field_of(data.bvh)};
}

/// `exact` objects share nothing.
struct ExactShared {};
/// The memory of what is decoded when a file is read.
struct ExactSharedView {
  explicit ExactSharedView(std::pmr::memory_resource* memory) : decoded_grids(memory) {}

  uint32_t network_count() const { return 0; }
  uint64_t network_bytes() const { return 0; }
  uint64_t view_bytes() const { return decoded_grids.view_bytes(); }
  void drop_bytes() { decoded_grids.drop(); }

  DecodedPayloads decoded_grids;
};

struct ExactView {
  static constexpr uint32_t network = 0;  ///< none
  kernels::ExactField field;              ///< ready to be queried
  PayloadBytes occupancy, cells;
  uint64_t tree_bytes = 0;
  uint32_t coded = 0;  ///< as in ProofData

  std::array<PartBytes, 3> parts() const {
    return {{{"occupancy", occupancy.file, occupancy.decoded},
             {"planes", cells.file, cells.decoded},
             {"bvh", tree_bytes}}};
  }
  void drop_bytes() { *this = {}; }
};

/// As SegmentReader.
class ExactReader {
 public:
  ExactReader(const SectionTable& sections, std::string_view file, ExactSharedView& shared);
  uint32_t count() const { return records_.count(); }
  ExactView read(uint32_t index, const Bounds& bounds);
  void finish() const;

 private:
  std::string_view file_;
  ExactSharedView& shared_;
  Records<ExactRecord> records_;
  Payloads occupancy_, cells_, trees_;
};

class ExactWriter {
 public:
  ExactWriter(Sections& sections, const ExactShared& shared);
  void add(const ExactData& data);

 private:
  Section *records_, *occupancy_, *cells_, *trees_;
};

template <>
struct EncodingOf<kernels::ExactField> {
  static constexpr uint32_t kNumber = 4;
  static constexpr const char* kName = "exact";
  static constexpr uint32_t kSections[] = {kExactRecords, kExactOccupancy, kExactCells, kExactTrees};
  using Data = ExactData;
  using Shared = ExactShared;
  using View = ExactView;
  using SharedView = ExactSharedView;
  using Reader = ExactReader;
  using Writer = ExactWriter;

  static kernels::ExactField field(const ExactData& data, const ExactShared&, const Bounds&) {
    return field_of(data);
  }
  static ExactData to_data(const ExactView& view);
  static ExactShared to_shared(const ExactSharedView&) { return {}; }
};

}  // namespace nif::format
