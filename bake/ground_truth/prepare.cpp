// Prepares meshes. Steps for a mesh: clean it, drop slivers that lie on no triangle, find closed parts,
// bounds and bias. In a scene, equal meshes are prepared once, and each change is noted for the user.
#include "bake/ground_truth/prepare.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <span>
#include <utility>

#include "formats/base/status.hpp"
#include "formats/mesh/alike.hpp"
#include "formats/mesh/transform.hpp"

namespace nif::bake {

float bias_of(const mesh::Mesh& mesh, const mesh::Box& box) {
  return kBiasFraction * (mesh.part_side > 0 ? mesh.part_side : box.longest_side());
}

namespace {

/// The two corners of a sliver that the third lies between.
std::pair<uint32_t, uint32_t> ends_of(const mesh::CleanMesh& surface, mesh::Triangle sliver) {
  const auto extent = [&](size_t a) {
    const auto [least, most] = std::minmax(
        {surface.positions[sliver[0]][a], surface.positions[sliver[1]][a], surface.positions[sliver[2]][a]});
    return double(most) - double(least);
  };
  size_t axis = extent(1) > extent(0) ? 1 : 0;
  if (extent(2) > extent(axis)) axis = 2;
  std::ranges::sort(sliver, {}, [&](uint32_t v) { return surface.positions[v][axis]; });
  return std::minmax(sliver[0], sliver[2]);
}

/// Drops slivers that do not lie on triangles: on an edge of one, or on another sliver that does. So the
/// remaining slivers are only seams of the surface (docs/encodings/bvh.md, "Slivers").
void keep_seams(mesh::CleanMesh& surface) {
  if (surface.slivers.empty()) return;
  using Edge = std::pair<uint32_t, uint32_t>;
  std::vector<std::pair<Edge, uint32_t>> by_ends;
  for (uint32_t s = 0; s < surface.slivers.size(); ++s)
    by_ends.emplace_back(ends_of(surface, surface.slivers[s]), s);
  std::ranges::sort(by_ends);
  std::vector<bool> kept(surface.slivers.size());
  std::vector<uint32_t> found;
  const auto look_at_edges = [&](const mesh::Triangle& triangle) {
    for (size_t k = 0; k < 3; ++k) {
      const Edge edge = std::minmax(triangle[k], triangle[(k + 1) % 3]);
      auto at = std::ranges::lower_bound(by_ends, edge, {}, [](const auto& known) { return known.first; });
      // Those of an edge are consecutive.
      for (; at != by_ends.end() && at->first == edge && !kept[at->second]; ++at) {
        kept[at->second] = true;
        found.push_back(at->second);
      }
    }
  };
  for (const mesh::Triangle& triangle : surface.triangles) look_at_edges(triangle);
  while (!found.empty()) {
    const mesh::Triangle sliver = surface.slivers[found.back()];
    found.pop_back();
    look_at_edges(sliver);
  }
  size_t count = 0;
  for (uint32_t s = 0; s < surface.slivers.size(); ++s) {
    if (!kept[s]) continue;
    surface.slivers[count] = surface.slivers[s];
    surface.sliver_numbers[count++] = surface.sliver_numbers[s];
  }
  surface.slivers.resize(count);
  surface.sliver_numbers.resize(count);
}

}  // namespace

Prepared prepare(const mesh::Mesh& mesh) {
  Prepared prepared{&mesh, mesh::clean(mesh), {}, {}, 0};
  keep_seams(prepared.surface);
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

[[noreturn]] void refuse(const std::string& first, size_t more) {
  throw Error(Status::needs_repair, more ? fmt::format("{}, and {} more", first, more) : first);
}

void refuse_losses(std::span<const mesh::Note> notes) {
  std::vector<std::string> losses;
  for (const mesh::Note& note : notes)
    if (mesh::is_loss(note.kind)) losses.push_back(note.text);
  if (!losses.empty()) refuse(losses.front(), losses.size() - 1);
}

bool blocks_nothing(const mesh::Mesh& mesh) {
  return std::ranges::count(mesh.alpha, mesh::TriangleAlpha::clear) == ptrdiff_t(mesh.triangles.size());
}

[[noreturn]] void refuse_clear(const mesh::Scene& scene) {
  constexpr size_t kNamed = 5;
  uint64_t triangles = 0;
  std::vector<std::string> names;
  for (const mesh::MaterialAlpha& material : scene.see_through) {
    if (material.clear == 0) continue;
    triangles += material.clear;
    if (names.size() <= kNamed)
      names.push_back(names.size() < kNamed ? fmt::format("'{}'", material.name) : "...");
  }
  throw Error(
      Status::all_degenerate,
      fmt::format(
          "it has {} triangles of material{} {}, but all of them let light through, and block nothing "
          "(--ignore-alpha makes them solid)",
          triangles, names.size() == 1 ? "" : "s", fmt::join(names, ", ")));
}

/// What was changed in a mesh, after its name; empty if nothing was. Welding moves no position, so it does
/// not count as a change.
std::string changes_of(const Prepared& prepared) {
  if (prepared.bends) return {};
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

PreparedScene prepare(const mesh::Scene& scene, bool strict, bool deforms) {
  PreparedScene prepared;
  const bool any_skin =
      std::ranges::any_of(scene.meshes, [](const mesh::Mesh& mesh) { return mesh.skin != nullptr; });
  if (strict) refuse_losses(scene.notes);
  const std::vector<uint32_t> firsts = mesh::first_alike(scene.meshes, true);
  for (uint32_t m = 0; m < scene.meshes.size(); ++m) {
    const mesh::Mesh& mesh = scene.meshes[m];
    if (firsts[m] != m) {
      prepared.object_of.push_back(prepared.object_of[firsts[m]]);
      continue;
    }
    // The reader's note says so.
    if (blocks_nothing(mesh)) {
      prepared.object_of.push_back(PreparedScene::kNone);
      continue;
    }
    try {
      Prepared& object = prepared.objects.emplace_back(prepare(mesh));
      prepared.object_of.push_back(uint32_t(prepared.objects.size() - 1));
      if (deforms && (mesh.skin || !any_skin)) {
        object.bends = !object.has_holes();
        if (!object.bends)
          prepared.notes.push_back(
              fmt::format("'{}' has holes, so it does not bend; --ignore-alpha makes it solid", mesh.name));
      }
      if (const std::string changes = changes_of(object); !changes.empty())
        prepared.notes.push_back(fmt::format("'{}': {}", mesh.name, changes));
    } catch (const Error& error) {
      // One mesh of many that consists only of lines should not make the others fail.
      if (error.status() != Status::all_degenerate) throw;
      prepared.object_of.push_back(PreparedScene::kNone);
      prepared.notes.push_back(fmt::format("left out: {}", error.what()));
    }
  }
  if (prepared.objects.empty() && !scene.meshes.empty()) {
    if (std::ranges::all_of(scene.meshes, blocks_nothing) && !scene.see_through.empty()) refuse_clear(scene);
    prepare(scene.meshes.front());  // throws why
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
  if (strict && !prepared.notes.empty()) refuse(prepared.notes.front(), prepared.notes.size() - 1);
  return prepared;
}

}  // namespace nif::bake
