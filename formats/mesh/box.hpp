// Axis-aligned boxes around triangles.
#pragma once

#include <array>
#include <span>

#include "formats/mesh/scene.hpp"

namespace nif::mesh {

/// Axis-aligned bounding box.
struct Box {
  std::array<float, 3> min, max;
  void add(std::span<const Float3> positions, const Triangle& triangle);
  void add(const Box& other);
  float longest_side() const;
  double diagonal() const;
};

/// Box of all positions that a triangle uses.
Box bounds(std::span<const Float3> positions, std::span<const Triangle> triangles);

/// Box around a box that is placed.
Box bounds(const Box& box, const Transform& transform);

/// Box of all instances of a scene, to the float.
Box bounds(const Scene& scene);

}  // namespace nif::mesh
