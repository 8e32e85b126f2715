// The writer of `bvh` objects, and the two ways between a tree that owns its memory and the plain
// pointers that kernels read.
#include "formats/nif/bvh/write.hpp"

namespace nif::format {

kernels::BvhField field_of(const Bvh& bvh) {
  kernels::BvhField field;
  field.nodes = bvh.nodes.data();
  field.vertices = reinterpret_cast<const float(*)[3]>(bvh.vertices.data());
  field.triangles = reinterpret_cast<const uint8_t(*)[3]>(bvh.triangles.data());
  field.node_count = uint32_t(bvh.nodes.size());
  field.vertex_count = uint32_t(bvh.vertices.size());
  field.triangle_count = uint32_t(bvh.triangles.size());
  if (!bvh.nodes.empty()) field.extent = kernels::bvh_extent(bvh.nodes.front());
  return field;
}

BvhWriter::BvhWriter(Sections& sections, const BvhShared&)
    : records_(&sections.add(kBvhRecords)), trees_(&sections.add(kBvhs)) {}

void BvhWriter::add(const Bvh& bvh) {
  BvhRecord record{};
  add_bvh(bvh, *trees_, record);
  records_->append(&record, 1);
}

Bvh EncodingOf<kernels::BvhField>::to_data(const BvhView& view) { return bvh_data(view.field); }

Bvh bvh_data(const kernels::BvhField& field) {
  Bvh bvh;
  bvh.nodes.assign(field.nodes, field.nodes + field.node_count);
  for (uint32_t v = 0; v < field.vertex_count; ++v) bvh.vertices.push_back(std::to_array(field.vertices[v]));
  for (uint32_t t = 0; t < field.triangle_count; ++t)
    bvh.triangles.push_back(std::to_array(field.triangles[t]));
  return bvh;
}

}  // namespace nif::format
