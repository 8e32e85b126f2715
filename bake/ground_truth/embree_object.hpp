// What Embree's scenes are made from: triangles, and where they have holes.
#pragma once

#include <memory>
#include <span>

#include "formats/mesh/clean.hpp"

namespace nif::bake {

/// A surface that rays are traced against. Not owned.
struct EmbreeObject {
  std::span<const mesh::Float3> positions;
  std::span<const mesh::Triangle> triangles;
  std::span<const mesh::TriangleHoles> holes;                         ///< [triangles]; empty: none has holes
  std::span<const std::shared_ptr<const mesh::AlphaMap>> alpha_maps;  ///< of `holes`

  /// All triangles are solid.
  EmbreeObject(std::span<const mesh::Float3> all_positions, std::span<const mesh::Triangle> all_triangles)
      : positions(all_positions), triangles(all_triangles) {}
  // Implicit: with its holes, a surface is what rays meet.
  EmbreeObject(const mesh::CleanMesh& mesh)
      : positions(mesh.positions),
        triangles(mesh.triangles),
        holes(mesh.holes),
        alpha_maps(mesh.alpha_maps) {}
  EmbreeObject(const mesh::Mesh& mesh)
      : positions(mesh.positions),
        triangles(mesh.triangles),
        holes(mesh.holes),
        alpha_maps(mesh.alpha_maps) {}
};

}  // namespace nif::bake
