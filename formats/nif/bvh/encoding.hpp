// The `bvh` encoding in a .nif file: a compressed wide BVH over exact triangles for each object.
#pragma once

#include <array>
#include <cstdint>
#include <memory_resource>
#include <vector>

#include "formats/nif/bvh/layout.hpp"
#include "formats/nif/encoding_of.hpp"
#include "formats/nif/records.hpp"
#include "formats/nif/sections.hpp"
#include "kernels/reference/bvh/field.hpp"

namespace nif::format {

/// One object; members as in kernels::BvhField.
struct Bvh {
  std::vector<kernels::BvhNode> nodes;
  std::vector<std::array<float, 3>> vertices;
  std::vector<std::array<uint8_t, 3>> triangles;

  /// Of the payload that holds it in a file.
  uint64_t bytes() const {
    return nodes.size() * sizeof(nodes[0]) + vertices.size() * sizeof(vertices[0]) +
           triangles.size() * sizeof(triangles[0]);
  }
};

/// The kernels' view of an object; valid while it lives and is not changed.
kernels::BvhField field_of(const Bvh& bvh);

/// `bvh` objects share nothing.
struct BvhShared {};
struct BvhSharedView {
  explicit BvhSharedView(std::pmr::memory_resource*) {}

  uint32_t network_count() const { return 0; }
  uint64_t network_bytes() const { return 0; }
  uint64_t view_bytes() const { return 0; }
  void drop_bytes() {}
};

struct BvhView {
  static constexpr uint32_t network = 0;  ///< none
  kernels::BvhField field;                ///< ready to be queried
  uint64_t tree_bytes = 0;

  std::array<PartBytes, 1> parts() const { return {{{"bvh", tree_bytes}}}; }
  void drop_bytes() { *this = {}; }
};

/// As SegmentReader.
class BvhReader {
 public:
  BvhReader(const SectionTable& sections, std::string_view file, BvhSharedView& shared);
  uint32_t count() const { return records_.count(); }
  BvhView read(uint32_t index, const Bounds& bounds);
  void finish() const;

 private:
  std::string_view file_;
  Records<BvhRecord> records_;
  Payloads trees_;
};

class BvhWriter {
 public:
  BvhWriter(Sections& sections, const BvhShared& shared);
  void add(const Bvh& bvh);

 private:
  Section *records_, *trees_;
};

template <>
struct EncodingOf<kernels::BvhField> {
  static constexpr uint32_t kNumber = 3;
  static constexpr const char* kName = "bvh";
  static constexpr uint32_t kSections[] = {kBvhRecords, kBvhs};
  using Data = Bvh;
  using Shared = BvhShared;
  using View = BvhView;
  using SharedView = BvhSharedView;
  using Reader = BvhReader;
  using Writer = BvhWriter;

  static kernels::BvhField field(const Bvh& bvh, const BvhShared&, const Bounds&) { return field_of(bvh); }
  static Bvh to_data(const BvhView& view);
  static BvhShared to_shared(const BvhSharedView&) { return {}; }
};

}  // namespace nif::format
