#include "bake/prepare.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "formats/status.hpp"

namespace nif::bake {

Prepared prepare(const mesh::Mesh& mesh) {
  Prepared prepared{&mesh, mesh::clean(mesh), {}, {}, 0};
  prepared.closed = find_closed_components(prepared.surface);
  prepared.box = bounds(prepared.surface.positions, prepared.surface.triangles);
  const float longest = prepared.box.longest_side();
  if (!(longest >= 1e-15f && longest <= 1e15f)) {
    throw Error(
        Status::too_large,
        fmt::format("mesh '{}' is {} units long; sizes from 1e-15 to 1e15 can be baked", mesh.name, longest));
  }
  prepared.bias = kBiasFraction * longest;
  return prepared;
}

DistinctMeshes find_distinct(const mesh::Scene& scene) {
  DistinctMeshes distinct;
  std::map<std::pair<size_t, size_t>, std::vector<uint32_t>> objects_by_size;
  for (uint32_t m = 0; m < scene.meshes.size(); ++m) {
    const mesh::Mesh& mesh = scene.meshes[m];
    auto& candidates = objects_by_size[{mesh.positions.size(), mesh.triangles.size()}];
    const auto found = std::find_if(candidates.begin(), candidates.end(), [&](uint32_t object) {
      const mesh::Mesh& other = scene.meshes[distinct.meshes[object]];
      return mesh.positions == other.positions && mesh.triangles == other.triangles;
    });
    if (found != candidates.end()) {
      distinct.object_of.push_back(*found);
      continue;
    }
    distinct.object_of.push_back(uint32_t(distinct.meshes.size()));
    candidates.push_back(distinct.object_of.back());
    distinct.meshes.push_back(m);
  }
  return distinct;
}

}  // namespace nif::bake
