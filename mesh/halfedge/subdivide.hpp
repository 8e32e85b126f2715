// Subdivides and smooths a surface.
#pragma once

#include <cstdint>

#include "formats/mesh/scene.hpp"

namespace nif::halfedge {

enum class Scheme : uint8_t { loop, catmull_clark, sqrt3 };

/// Triangles that subdivision makes of so many; the largest number where 64 bits do not hold it.
uint64_t subdivided_triangles(Scheme scheme, uint64_t triangles, uint32_t times);

/// By OpenMesh. Loop and sqrt(3) make triangles of triangles; the quads that Catmull-Clark makes are cut in
/// two at the end. Where the surface is not manifold it comes apart first. Throws Error(all_degenerate) where
/// the mesh has no area.
mesh::Mesh subdivide(const mesh::Mesh& mesh, Scheme scheme, uint32_t times);

}  // namespace nif::halfedge
