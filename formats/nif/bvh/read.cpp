#include "formats/nif/bvh/check.hpp"
#include "formats/nif/bvh/encoding.hpp"

namespace nif::format {

BvhReader::BvhReader(const SectionTable& sections, std::string_view file, BvhSharedView&)
    : file_(file), records_(sections[kBvhRecords], "BVHR", file), trees_(sections[kBvhs]) {}

BvhView BvhReader::read(uint32_t index, const Bounds&) {
  const BvhRecord record = records_[index];
  const Place place{file_, "BVHR", index};
  place.require(record.reserved == 0, "reserved bytes are not zero");
  BvhView view;
  kernels::BvhField& field = view.field;
  field.node_count = record.nodes;
  field.vertex_count = record.vertices;
  field.triangle_count = record.triangles;
  const uint64_t node_bytes = uint64_t(record.nodes) * sizeof(kernels::BvhNode),
                 vertex_bytes = uint64_t(record.vertices) * sizeof(*field.vertices);
  view.tree_bytes = node_bytes + vertex_bytes + uint64_t(record.triangles) * sizeof(*field.triangles);
  const std::byte* at = trees_.next(record.tree, view.tree_bytes, "bvh", place).data();
  field.nodes = reinterpret_cast<const kernels::BvhNode*>(at);
  field.vertices = reinterpret_cast<const float(*)[3]>(at + node_bytes);
  field.triangles = reinterpret_cast<const uint8_t(*)[3]>(at + node_bytes + vertex_bytes);
  if (const char* wrong = fault_of(field)) place.damaged(wrong);
  field.extent = kernels::bvh_extent(field.nodes[0]);
  return view;
}

void BvhReader::finish() const { trees_.finish("BVHS", file_); }

}  // namespace nif::format
