// A placed AABB is the box around its eight transformed corners, so it may be too large. A scene's AABB is
// exact: it transforms each vertex of each instance, which takes longer.
#include "formats/mesh/box.hpp"

#include <algorithm>
#include <limits>

#include "formats/base/vector.hpp"
#include "formats/mesh/transform.hpp"

namespace nif::mesh {

void Box::add(std::span<const Float3> positions, const Triangle& triangle) {
  for (uint32_t i : triangle) {
    for (int a = 0; a < 3; ++a) {
      min[a] = std::min(min[a], positions[i][a]);
      max[a] = std::max(max[a], positions[i][a]);
    }
  }
}

void Box::add(const Box& other) {
  for (size_t a = 0; a < 3; ++a) {
    min[a] = std::min(min[a], other.min[a]);
    max[a] = std::max(max[a], other.max[a]);
  }
}

float Box::longest_side() const { return std::max({max[0] - min[0], max[1] - min[1], max[2] - min[2]}); }
double Box::diagonal() const { return length(to_double(max) - to_double(min)); }

namespace {

Box around_nothing() {
  constexpr float kFar = std::numeric_limits<float>::max();
  return {{kFar, kFar, kFar}, {-kFar, -kFar, -kFar}};
}

}  // namespace

Box bounds(std::span<const Float3> positions, std::span<const Triangle> triangles) {
  Box box = around_nothing();
  for (const Triangle& triangle : triangles) box.add(positions, triangle);
  return box;
}

Box bounds(const Box& box, const Transform& transform) {
  Box out = around_nothing();
  for (uint32_t corner = 0; corner < 8; ++corner) {
    Float3 p;
    for (size_t a = 0; a < 3; ++a) p[a] = (corner >> a & 1 ? box.max : box.min)[a];
    p = transformed(transform, p);
    out.add({p, p});
  }
  return out;
}

Box bounds(const Scene& scene) {
  Box box = around_nothing();
  for (const Instance& instance : scene.instances) {
    const Mesh& mesh = scene.meshes[instance.mesh];
    for (const Triangle& triangle : mesh.triangles)
      for (const uint32_t corner : triangle) {
        const Float3 p = transformed(instance.transform, mesh.positions[corner]);
        box.add({p, p});
      }
  }
  return box;
}

}  // namespace nif::mesh
