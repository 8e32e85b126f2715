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

PreparedScene prepare(const mesh::Scene& scene) {
  PreparedScene prepared;
  std::map<std::pair<size_t, size_t>, std::vector<uint32_t>> meshes_by_size;  // one of each content
  for (uint32_t m = 0; m < scene.meshes.size(); ++m) {
    const mesh::Mesh& mesh = scene.meshes[m];
    auto& candidates = meshes_by_size[{mesh.positions.size(), mesh.triangles.size()}];
    const auto found = std::find_if(candidates.begin(), candidates.end(), [&](uint32_t other) {
      return mesh.positions == scene.meshes[other].positions &&
             mesh.triangles == scene.meshes[other].triangles;
    });
    if (found != candidates.end()) {
      prepared.object_of.push_back(prepared.object_of[*found]);
      continue;
    }
    candidates.push_back(m);
    try {
      prepared.objects.push_back(prepare(mesh));
      prepared.object_of.push_back(uint32_t(prepared.objects.size() - 1));
    } catch (const Error& error) {
      // One mesh of many that is nothing but lines should not cost the others.
      if (error.status() != Status::all_degenerate) throw;
      const bool last = m + 1 == scene.meshes.size();
      if (last && prepared.objects.empty()) throw;
      prepared.object_of.push_back(PreparedScene::kNone);
      prepared.notes.push_back(fmt::format("left out: {}", error.what()));
    }
  }
  return prepared;
}

}  // namespace nif::bake
