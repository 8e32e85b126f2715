// Gathers the holes of a mesh's triangles from those of its parts. Internal to formats/mesh.
#pragma once

#include <map>
#include <memory>
#include <span>
#include <vector>

#include "formats/mesh/mesh_scene.hpp"

namespace nif::mesh::detail {

/// Maps are compared by address, not by what they contain: those of one file are shared.
class HoleCollector {
 public:
  /// `holes.map` is replaced by the number of the map.
  void add(size_t triangle, const std::shared_ptr<const AlphaMap>& map, TriangleHoles holes);
  /// For the triangles of a list, from `first` on. `flipped`: their corners 1 and 2 change places.
  void add_all(size_t first, const AlphaMaps& maps, std::span<const TriangleHoles> holes,
               bool flipped = false);

  /// Replaces the holes of the mesh by what was gathered, maps in the order in which they were used first.
  void finish(Mesh& mesh);

 private:
  AlphaMaps maps_;
  std::map<const AlphaMap*, uint32_t> numbers_;  ///< of maps_
  std::vector<TriangleHoles> holes_;
};

/// Lists only the maps that are still in use, after triangles were dropped.
void drop_unused_maps(Mesh& mesh);

}  // namespace nif::mesh::detail
