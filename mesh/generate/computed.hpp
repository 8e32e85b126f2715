// Adapts a formula that computes each vertex and each triangle from its number to a mesh source.
#pragma once

#include <memory>
#include <utility>

#include "formats/base/vector.hpp"
#include "formats/mesh/mesh_source.hpp"

namespace nif::generate {

/// `Formula` has the const functions vertex_count(), triangle_count(), vertex(i) (a Double3) and triangle(i).
template <class Formula>
class Computed final : public mesh::MeshSource {
 public:
  explicit Computed(Formula formula) : formula_(std::move(formula)) {}

  uint64_t vertex_count() const override { return formula_.vertex_count(); }
  uint64_t triangle_count() const override { return formula_.triangle_count(); }
  void vertices(uint64_t first, std::span<mesh::Float3> out) const override {
    for (mesh::Float3& vertex : out) vertex = to_float(formula_.vertex(first++));
  }
  void triangles(uint64_t first, std::span<mesh::Triangle> out) const override {
    for (mesh::Triangle& triangle : out) triangle = formula_.triangle(first++);
  }

 private:
  Formula formula_;
};

template <class Formula>
std::unique_ptr<mesh::MeshSource> computed(Formula formula) {
  return std::make_unique<Computed<Formula>>(std::move(formula));
}

}  // namespace nif::generate
