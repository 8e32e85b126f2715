#include "bake/oracle/prepare.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "formats/base/status.hpp"

namespace nif::bake {

Prepared prepare(const mesh::Mesh& mesh) {
  Prepared prepared{&mesh, mesh::clean(mesh), {}, {}, 0};
  prepared.closed = find_closed_components(prepared.surface);
  prepared.box = mesh::bounds(prepared.surface.positions, prepared.surface.triangles);
  const float longest = prepared.box.longest_side();
  if (!(longest >= 1e-15f && longest <= 1e15f)) {
    throw Error(
        Status::too_large,
        fmt::format("mesh '{}' is {} units long; sizes from 1e-15 to 1e15 can be baked", mesh.name, longest));
  }
  prepared.bias = kBiasFraction * longest;
  return prepared;
}

namespace {

/// True where the transform has no inverse in single precision: the runtime would refuse to place it.
bool flattens(const mesh::Transform& t) {
  const Double3 rows[3] = {{t[0], t[1], t[2]}, {t[4], t[5], t[6]}, {t[8], t[9], t[10]}};
  const double determinant = dot(rows[0], cross(rows[1], rows[2]));
  for (int a = 0; a < 3; ++a) {
    for (double cofactor : cross(rows[(a + 1) % 3], rows[(a + 2) % 3])) {
      if (!std::isfinite(static_cast<float>(cofactor / determinant))) return true;
    }
  }
  return false;
}

/// What was changed in a mesh, after its name; empty where nothing was. Positions that were welded are where
/// they were, so that is no change.
std::string changes_of(const Prepared& prepared) {
  std::vector<std::string> changes;
  const mesh::CleanReport& cleaned = prepared.surface.report;
  const auto change = [&](uint64_t count, const char* verb, const char* which) {
    if (count)
      changes.push_back(fmt::format("{} {} triangle{} {}", verb, count, count == 1 ? "" : "s", which));
  };
  change(cleaned.degenerate, "dropped", "without area");
  change(cleaned.duplicate, "dropped", "that another one covers");
  change(prepared.closed.turned, "turned", "to face as those around");
  return fmt::format("{}", fmt::join(changes, ", "));
}

}  // namespace

PreparedScene prepare(const mesh::Scene& scene, bool strict) {
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
      if (const std::string changes = changes_of(prepared.objects.back()); !changes.empty())
        prepared.notes.push_back(fmt::format("'{}': {}", mesh.name, changes));
    } catch (const Error& error) {
      // One mesh of many that is nothing but lines should not cost the others.
      if (error.status() != Status::all_degenerate) throw;
      const bool last = m + 1 == scene.meshes.size();
      if (last && prepared.objects.empty()) throw;
      prepared.object_of.push_back(PreparedScene::kNone);
      prepared.notes.push_back(fmt::format("left out: {}", error.what()));
    }
  }
  for (uint32_t i = 0; i < scene.instances.size(); ++i) {
    const mesh::Instance& instance = scene.instances[i];
    if (prepared.object_of[instance.mesh] == PreparedScene::kNone) continue;
    if (flattens(instance.transform)) {
      prepared.notes.push_back(
          fmt::format("left out: the transform of instance '{}' flattens it", instance.name));
    } else {
      prepared.instances.push_back(i);
    }
  }
  if (strict && !prepared.notes.empty()) {
    const size_t more = prepared.notes.size() - 1;
    throw Error(Status::needs_repair,
                fmt::format("{}{}", prepared.notes.front(), more ? fmt::format(", and {} more", more) : ""));
  }
  return prepared;
}

}  // namespace nif::bake
