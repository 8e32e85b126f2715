// Reads a BVH from a file: of any encoding that has one.
#pragma once

#include "formats/nif/bvh/check.hpp"
#include "formats/nif/records.hpp"

namespace nif::format {

/// The next tree, as a record has it; checked.
template <class Record>
kernels::BvhField take_bvh(const Record& record, Payloads& trees, const Place& place, uint64_t& bytes) {
  kernels::BvhField field;
  field.node_count = record.nodes;
  field.vertex_count = record.vertices;
  field.triangle_count = record.triangles;
  const uint64_t node_bytes = uint64_t(record.nodes) * sizeof(kernels::BvhNode),
                 vertex_bytes = uint64_t(record.vertices) * sizeof(*field.vertices);
  bytes = node_bytes + vertex_bytes + uint64_t(record.triangles) * sizeof(*field.triangles);
  const std::byte* at = trees.next(record.tree, bytes, "bvh", place).data();
  field.nodes = reinterpret_cast<const kernels::BvhNode*>(at);
  field.vertices = reinterpret_cast<const float(*)[3]>(at + node_bytes);
  field.triangles = reinterpret_cast<const uint8_t(*)[3]>(at + node_bytes + vertex_bytes);
  if (const auto wrong = fault_of(field)) place.damaged(*wrong);
  field.extent = kernels::bvh_extent(field.nodes[0]);
  return field;
}

}  // namespace nif::format
