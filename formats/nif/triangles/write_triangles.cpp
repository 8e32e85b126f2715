// Writes triangles, and converts between those that own their memory and the plain pointers that kernels
// read.
#include "formats/nif/triangles/triangles_part.hpp"

namespace nif::format {

kernels::TrianglesField field_of(const TrianglesData& data) {
  kernels::TrianglesField field;
  field.nodes = data.nodes.data();
  field.vertices = reinterpret_cast<const float(*)[3]>(data.vertices.data());
  field.triangles = reinterpret_cast<const uint8_t(*)[3]>(data.triangles.data());
  field.node_count = uint32_t(data.nodes.size());
  field.vertex_count = uint32_t(data.vertices.size());
  field.triangle_count = uint32_t(data.triangles.size());
  if (!data.nodes.empty()) field.extent = kernels::bvh_extent(data.nodes.front());
  return field;
}

TrianglesData to_data(const TrianglesView& view) {
  const kernels::TrianglesField& field = view.field;
  TrianglesData data;
  data.nodes.assign(field.nodes, field.nodes + field.node_count);
  for (uint32_t v = 0; v < field.vertex_count; ++v) data.vertices.push_back(std::to_array(field.vertices[v]));
  for (uint32_t t = 0; t < field.triangle_count; ++t)
    data.triangles.push_back(std::to_array(field.triangles[t]));
  return data;
}

TrianglesRecord write_record(const TrianglesData& data, const Object&, Section& payloads) {
  TrianglesRecord record{};
  record.nodes = uint32_t(data.nodes.size());
  record.vertices = uint32_t(data.vertices.size());
  record.triangles = uint32_t(data.triangles.size());
  record.tree = payloads.add_payload(data.nodes, data.vertices, data.triangles);
  return record;
}

}  // namespace nif::format
