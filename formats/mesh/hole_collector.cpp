// A map is found by its address: there are few, and most triangles use the one of their neighbour.
#include "formats/mesh/hole_collector.hpp"

#include <algorithm>
#include <utility>

namespace nif::mesh::detail {

void HoleCollector::add(size_t triangle, const std::shared_ptr<const AlphaMap>& map, TriangleHoles holes) {
  if (holes_.size() <= triangle) holes_.resize(triangle + 1);
  const auto [known, fresh] = numbers_.try_emplace(map.get(), uint32_t(maps_.size()));
  if (fresh) maps_.push_back(map);
  holes.map = known->second;
  holes_[triangle] = holes;
}

void HoleCollector::add_all(size_t first, const AlphaMaps& maps, std::span<const TriangleHoles> holes,
                            bool flipped) {
  for (size_t t = 0; t < holes.size(); ++t) {
    if (!holes[t].any()) continue;
    TriangleHoles own = holes[t];
    if (flipped) std::swap(own.places[1], own.places[2]);
    add(first + t, maps[holes[t].map], own);
  }
}

void HoleCollector::finish(Mesh& mesh) {
  if (!holes_.empty()) holes_.resize(mesh.triangles.size());
  mesh.alpha_maps = std::move(maps_);
  mesh.holes = std::move(holes_);
  *this = {};
}

void drop_unused_maps(Mesh& mesh) {
  if (mesh.holes.empty()) return;
  HoleCollector kept;
  kept.add_all(0, mesh.alpha_maps, mesh.holes);
  kept.finish(mesh);
}

}  // namespace nif::mesh::detail
