// The checks that every reader shares, which make a Scene safe to use.
#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>

#include "formats/base/utf8.hpp"
#include "formats/mesh/readers.hpp"

namespace nif::mesh::detail {
namespace {

bool finite(const Float3& p) { return std::isfinite(p[0]) && std::isfinite(p[1]) && std::isfinite(p[2]); }

/// Nothing is wrong with any index or any position, used or not: passes over memory in its order, which is
/// what most meshes take.
bool all_fine(const Mesh& mesh) {
  uint32_t largest = 0;
  for (const Triangle& t : mesh.triangles) largest = std::max({largest, t[0], t[1], t[2]});
  if (!mesh.triangles.empty() && largest >= mesh.positions.size()) return false;
  constexpr uint32_t kExponent = 0x7f800000;  // all ones where a float is infinite or NaN
  uint32_t infinite = 0;
  for (const Float3& p : mesh.positions)
    for (const float x : p) infinite |= (std::bit_cast<uint32_t>(x) & kExponent) == kExponent;
  return infinite == 0;
}

void check_mesh(const Input& input, const Mesh& mesh) {
  if (all_fine(mesh)) return;
  const uint64_t vertices = mesh.positions.size();
  for (size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (const uint32_t v : mesh.triangles[t]) {
      if (v >= vertices) {
        input.fail(Status::index_out_of_range,
                   fmt::format("triangle {} of mesh '{}' uses vertex {}, but there are only {}", t, mesh.name,
                               v, vertices));
      }
      if (!finite(mesh.positions[v])) {
        const Float3& p = mesh.positions[v];
        input.fail(Status::non_finite_vertex,
                   fmt::format("vertex {} of mesh '{}' is not finite: ({}, {}, {})", v, mesh.name, p[0], p[1],
                               p[2]));
      }
    }
  }
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
  if (triangles == 0) input.fail(Status::no_triangles, "has no triangles");
  check_triangle_limit(input, triangles);
  for (const Mesh& mesh : scene.meshes) check_mesh(input, mesh);
}

}  // namespace nif::mesh::detail
