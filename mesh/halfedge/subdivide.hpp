// Subdivides and smooths a surface.
#pragma once

#include <cstdint>

#include "formats/mesh/mesh_scene.hpp"

namespace nif::halfedge {

enum class Scheme : uint8_t { loop, catmull_clark, sqrt3 };

/// Number of triangles after subdivision; the largest 64-bit number if it does not fit.
uint64_t subdivided_triangles(Scheme scheme, uint64_t triangles, uint32_t times);

/// Subdivides with OpenMesh. Loop and sqrt(3) turn triangles into triangles; Catmull-Clark's quads are split
/// in two at the end. A surface that is not manifold is taken apart first. Throws Error(all_degenerate) if
/// the mesh has no area.
mesh::Mesh subdivide(const mesh::Mesh& mesh, Scheme scheme, uint32_t times);

}  // namespace nif::halfedge
