// The checks that every reader shares. After them, a Scene is safe to use.
#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>

#include "formats/base/quantities.hpp"
#include "formats/base/utf8.hpp"
#include "formats/mesh/readers.hpp"
#include "formats/mesh/unseen_meshes.hpp"

namespace nif::mesh::detail {
namespace {

bool finite(const Float3& p) { return std::isfinite(p[0]) && std::isfinite(p[1]) && std::isfinite(p[2]); }

/// Whether all indices and positions, used or not, are valid. One pass over memory in order, which is all
/// that most meshes need.
bool all_fine(const Mesh& mesh) {
  uint32_t largest = 0;
  for (const Triangle& t : mesh.triangles) largest = std::max({largest, t[0], t[1], t[2]});
  if (!mesh.triangles.empty() && largest >= mesh.positions.size()) return false;
  constexpr uint32_t kExponent = 0x7f800000;  // all ones if a float is infinite or NaN
  uint32_t infinite = 0;
  for (const Float3& p : mesh.positions)
    for (const float x : p) infinite |= (std::bit_cast<uint32_t>(x) & kExponent) == kExponent;
  return infinite == 0;
}

/// Returns the number of dropped triangles, which use a vertex that is not finite. Indices must be in range.
uint64_t drop_non_finite(Mesh& mesh) {
  return keep_triangles(mesh, [&](size_t t) {
    return std::ranges::all_of(mesh.triangles[t], [&](uint32_t v) { return finite(mesh.positions[v]); });
  });
}

/// Returns the number of dropped triangles.
uint64_t check_mesh(const Input& input, Mesh& mesh) {
  if (all_fine(mesh)) return 0;
  const uint64_t vertices = mesh.positions.size();
  for (size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (const uint32_t v : mesh.triangles[t]) {
      if (v >= vertices) {
        input.fail(Status::index_out_of_range,
                   fmt::format("triangle {} of mesh '{}' uses vertex {}, but there are only {}", t, mesh.name,
                               v, vertices));
      }
      if (!finite(mesh.positions[v]) && !input.limits.drop_non_finite) {
        const Float3& p = mesh.positions[v];
        input.fail(Status::non_finite_vertex,
                   fmt::format("vertex {} of mesh '{}' is not finite: ({}, {}, {})", v, mesh.name, p[0], p[1],
                               p[2]));
      }
    }
  }
  return input.limits.drop_non_finite ? drop_non_finite(mesh) : 0;
}

}  // namespace

std::string clean_name(std::string_view name) {
  std::string out;
  while (!name.empty()) {
    const size_t length = utf8_sequence(name);
    if (length == 0) {
      out += "\xEF\xBF\xBD";  // U+FFFD
    } else if (length == 1 ? name[0] >= ' ' && name[0] != 0x7F
                           : name[0] != '\xC2' || static_cast<unsigned char>(name[1]) >= 0xA0) {
      out += name.substr(0, length);
    }
    name.remove_prefix(std::max<size_t>(length, 1));
  }
  return out;
}

void fail_triangle_limit(const Input& input) {
  input.fail(Status::too_large,
             fmt::format("has more than the limit of {} triangles", input.limits.max_triangles));
}

Scene scene_of(std::vector<Mesh> meshes, Scene scene) {
  for (Mesh& mesh : meshes) {
    if (mesh.triangles.empty()) continue;
    scene.instances.push_back({mesh.name, static_cast<uint32_t>(scene.meshes.size()), kIdentity});
    scene.meshes.push_back(std::move(mesh));
  }
  return scene;
}

void check(const Input& input, Scene& scene) {
  for (Mesh& mesh : scene.meshes) mesh.name = clean_name(mesh.name);
  for (Instance& instance : scene.instances) instance.name = clean_name(instance.name);
  for (Node& node : scene.nodes) node.name = clean_name(node.name);
  for (Camera& camera : scene.cameras) camera.name = clean_name(camera.name);
  for (Light& light : scene.lights) light.name = clean_name(light.name);
  uint64_t triangles = 0;
  for (const Mesh& mesh : scene.meshes) triangles += mesh.triangles.size();
  if (triangles == 0)
    input.fail(Status::no_triangles,
               input.limits.choice.empty() ? "has no triangles" : "has no chosen triangles");
  check_triangle_limit(input, triangles);
  uint64_t dropped = 0;
  for (Mesh& mesh : scene.meshes) dropped += check_mesh(input, mesh);
  if (dropped == triangles)
    input.fail(Status::non_finite_vertex,
               fmt::format("each of its {} triangles uses a vertex that is not finite", triangles));
  if (dropped != 0) {
    drop_empty_meshes(scene);
    scene.notes.push_back(
        {NoteKind::non_finite_faces,
         fmt::format("{}: left out {} that {} a vertex that is not finite.", input.file.string(),
                     count_of(dropped, "triangle"), dropped == 1 ? "uses" : "use")});
  }
  note_helpers(input, scene);
}

}  // namespace nif::mesh::detail

namespace nif::mesh {

std::vector<std::string> drop_empty_meshes(Scene& scene) {
  std::vector<std::string> dropped;
  std::vector<uint32_t> index(scene.meshes.size());
  uint32_t kept = 0;
  for (size_t m = 0; m < scene.meshes.size(); ++m) {
    index[m] = UINT32_MAX;
    if (scene.meshes[m].triangles.empty()) {
      dropped.push_back(scene.meshes[m].name);
      continue;
    }
    if (kept != m) scene.meshes[kept] = std::move(scene.meshes[m]);
    index[m] = kept++;
  }
  scene.meshes.resize(kept);
  std::erase_if(scene.instances, [&](const Instance& i) { return index[i.mesh] == UINT32_MAX; });
  for (Instance& instance : scene.instances) instance.mesh = index[instance.mesh];
  return dropped;
}

}  // namespace nif::mesh
