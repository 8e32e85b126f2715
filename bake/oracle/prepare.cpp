#include "bake/oracle/prepare.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "formats/base/status.hpp"
#include "formats/mesh/alike.hpp"
#include "formats/mesh/transform.hpp"

namespace nif::bake {

float bias_of(const mesh::Mesh& mesh, const mesh::Box& box) {
  return kBiasFraction * (mesh.part_side > 0 ? mesh.part_side : box.longest_side());
}

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
  prepared.bias = bias_of(mesh, prepared.box);
  return prepared;
}

namespace {

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
  const std::vector<uint32_t> firsts = mesh::first_alike(scene.meshes, true);
  for (uint32_t m = 0; m < scene.meshes.size(); ++m) {
    const mesh::Mesh& mesh = scene.meshes[m];
    if (firsts[m] != m) {
      prepared.object_of.push_back(prepared.object_of[firsts[m]]);
      continue;
    }
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
    if (mesh::flattens(instance.transform)) {
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
