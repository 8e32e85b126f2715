// Meshes, rays and transforms as hard to answer as we know how to make them, each drawn anew from a seed.
// They look for wrong answers among those that are called certain: a judge in exact arithmetic checks each.
#pragma once

#include <nif/nif.h>

#include <array>
#include <span>

#include "formats/base/random.hpp"
#include "formats/mesh/box.hpp"
#include "formats/mesh/mesh_scene.hpp"

namespace nif::test {

struct HostileMesh {
  mesh::Mesh mesh;
  /// Whether its surface, as a set of points, has an inside: a line from there to infinity must meet it.
  /// Edges need not be shared, corners may lie on edges of others. A line in general position crosses a
  /// closed one an even number of times.
  bool closed = false;
};

struct MeshGenerator {
  const char* name;
  HostileMesh (*make)(nif::Random&);
};
/// Of some hundred triangles at most, finite, and with at least one triangle that has an area.
std::span<const MeshGenerator> mesh_generators();

struct RayGenerator {
  const char* name;
  NifRay (*draw)(const mesh::Mesh&, const mesh::Box& box, nif::Random&);
};
/// `box` is that of the mesh. The last but one is for meshes beyond 2^43, the last one draws invalid rays.
std::span<const RayGenerator> ray_generators();

/// Row-major 3x4, from object to world.
using Transform = std::array<float, 12>;

struct TransformGenerator {
  const char* name;
  Transform (*draw)(const mesh::Box& box, nif::Random&);
};
/// All have an inverse in single precision.
std::span<const TransformGenerator> transform_generators();

}  // namespace nif::test
