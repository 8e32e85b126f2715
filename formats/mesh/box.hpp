// Computes axis-aligned boxes around triangles.
#pragma once

#include <array>
#include <span>

#include "formats/mesh/mesh_scene.hpp"

namespace nif::mesh {

/// Axis-aligned bounding box.
struct Box {
  std::array<float, 3> min, max;
  void add(std::span<const Float3> positions, const Triangle& triangle);
  void add(const Box& other);
  float longest_side() const;
  double diagonal() const;
};

/// The box of all positions that triangles use.
Box bounds(std::span<const Float3> positions, std::span<const Triangle> triangles);

/// The box around a transformed box.
Box bounds(const Box& box, const Transform& transform);

/// The exact box of all instances of a scene.
Box bounds(const Scene& scene);

}  // namespace nif::mesh
