// The `proof` encoding in a .nif file: a grid with planes for each object.
#pragma once

#include "formats/nif/encoding_of.hpp"
#include "formats/nif/proof/data.hpp"
#include "formats/nif/proof/layout.hpp"
#include "formats/nif/records.hpp"
#include "formats/nif/sections.hpp"

namespace nif::format {

/// `proof` objects share nothing.
struct ProofShared {};
/// The memory of what is decoded when a file is read.
struct ProofSharedView {
  explicit ProofSharedView(std::pmr::memory_resource* memory) : decoded_proofs(memory) {}

  uint32_t network_count() const { return 0; }
  uint64_t network_bytes() const { return 0; }
  uint64_t view_bytes() const { return decoded_proofs.view_bytes(); }
  void drop_bytes() { decoded_proofs.drop(); }

  DecodedPayloads decoded_proofs;
};

struct ProofView {
  static constexpr uint32_t network = 0;  ///< none
  kernels::ProofField field;              ///< ready to be queried
  PayloadBytes occupancy, cells;
  uint32_t coded = 0;  ///< as in ProofData

  std::array<PartBytes, 2> parts() const {
    return {{{"occupancy", occupancy.file, occupancy.decoded}, {"planes", cells.file, cells.decoded}}};
  }
  void drop_bytes() { *this = {}; }
};

/// As SegmentReader.
class ProofReader {
 public:
  ProofReader(const SectionTable& sections, std::string_view file, ProofSharedView& shared);
  uint32_t count() const { return records_.count(); }
  ProofView read(uint32_t index, const Bounds& bounds);
  void finish() const;

 private:
  std::string_view file_;
  ProofSharedView& shared_;
  Records<ProofRecord> records_;
  Payloads occupancy_, cells_;
};

class ProofWriter {
 public:
  ProofWriter(Sections& sections, const ProofShared& shared);
  void add(const ProofData& data);

 private:
  Section *records_, *occupancy_, *cells_;
};

template <>
struct EncodingOf<kernels::ProofField> {
  static constexpr uint32_t kNumber = 5;
  static constexpr const char* kName = "proof";
  static constexpr uint32_t kSections[] = {kProofRecords, kProofOccupancy, kProofCells};
  using Data = ProofData;
  using Shared = ProofShared;
  using View = ProofView;
  using SharedView = ProofSharedView;
  using Reader = ProofReader;
  using Writer = ProofWriter;

  static kernels::ProofField field(const ProofData& data, const ProofShared&, const Bounds&) {
    return proof_of(data);
  }
  static ProofData to_data(const ProofView& view);
  static ProofShared to_shared(const ProofSharedView&) { return {}; }
};

}  // namespace nif::format
