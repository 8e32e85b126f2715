// Reads triangles. A tree is checked by itself first, then against the planes of its object: it must lie near
// them, and neither may be too far out for the arithmetic of a traversal.
#include "formats/nif/reader.hpp"
#include "formats/nif/triangles/check_triangles.hpp"
#include "formats/nif/triangles/triangles_part.hpp"
#include "kernels/reference/encodings/reference_exact.hpp"

namespace nif::format {
namespace {

/// Are the triangles within the grid, and do planes and triangles accept the same rays?
std::optional<Rule> fault_beside(const kernels::PlanesField& grid, const kernels::TrianglesField& tree) {
  const kernels::BvhNode& root = tree.nodes[0];
  if (!(tree.extent <= 2 * kernels::kMaxExactCoordinate)) return Rule::tree_far;
  const float cell = 1 / grid.cells_per_unit;
  for (int a = 0; a < 3; ++a) {
    const float side = static_cast<float>(grid.voxels[a]) / grid.voxels_per_unit;
    const float low = grid.origin[a], high = low + side;
    if (!(low >= -2 * kernels::kMaxExactCoordinate && high <= 2 * kernels::kMaxExactCoordinate))
      return Rule::grid_far;
    for (uint32_t s = 0; s < kernels::kBvhWidth && root.slots[s] != 0; ++s)
      if (!(kernels::frame_plane(root.frame[a], root.low[a][s]) >= low - side - cell) ||
          !(kernels::frame_plane(root.frame[a], root.high[a][s]) <= high + side + cell))
        return Rule::tree_and_grid;
  }
  return std::nullopt;
}

}  // namespace

TrianglesView read_record(const TrianglesRecord& record, const ObjectView& object, const Reading& reading) {
  const Place& place = reading.place;
  place.require(record.reserved == 0, Rule::reserved_not_zero);
  TrianglesView view;
  kernels::TrianglesField& field = view.field;
  field.node_count = record.nodes;
  field.vertex_count = record.vertices;
  field.triangle_count = record.triangles;
  const uint64_t node_bytes = uint64_t(record.nodes) * sizeof(kernels::BvhNode),
                 vertex_bytes = uint64_t(record.vertices) * sizeof(*field.vertices);
  view.tree_bytes = node_bytes + vertex_bytes + uint64_t(record.triangles) * sizeof(*field.triangles);
  const std::byte* at = reading.payloads.next(record.tree, view.tree_bytes, "bvh", place).data();
  field.nodes = reinterpret_cast<const kernels::BvhNode*>(at);
  field.vertices = reinterpret_cast<const float(*)[3]>(at + node_bytes);
  field.triangles = reinterpret_cast<const uint8_t(*)[3]>(at + node_bytes + vertex_bytes);
  if (const auto fault = fault_of(field)) place.damaged(*fault);
  field.extent = kernels::bvh_extent(field.nodes[0]);
  if (object.planes != nullptr)
    if (const auto fault = fault_beside(object.planes->field, field)) place.damaged(*fault);
  return view;
}

}  // namespace nif::format
