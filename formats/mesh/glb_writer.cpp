#include "formats/mesh/glb_writer.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <nlohmann/json.hpp>

#include "formats/status.hpp"

namespace nif::mesh {
namespace {

using Json = nlohmann::ordered_json;

static_assert(std::endian::native == std::endian::little);
constexpr uint64_t kLargest = std::numeric_limits<uint32_t>::max();
// Of the specification: component types, buffer targets, the numbers of the container.
constexpr int kUnsignedInt = 5125, kFloat = 5126, kVertices = 34962, kIndices = 34963;
constexpr uint32_t kMagic = 0x46546C67, kVersion = 2, kJsonChunk = 0x4E4F534A, kBinaryChunk = 0x004E4942;

void check(const Mesh& mesh) {
  if (mesh.triangles.empty())
    throw Error(Status::no_triangles, fmt::format("mesh '{}' has no triangles", mesh.name));
  for (const Float3& p : mesh.positions)
    if (!std::isfinite(p[0]) || !std::isfinite(p[1]) || !std::isfinite(p[2]))
      throw Error(Status::non_finite_vertex,
                  fmt::format("mesh '{}' has a vertex that is not finite", mesh.name));
  for (const Triangle& t : mesh.triangles)
    if (std::max({t[0], t[1], t[2]}) >= mesh.positions.size())
      throw Error(Status::index_out_of_range,
                  fmt::format("mesh '{}' has a triangle with a vertex that is not there", mesh.name));
}

/// Appends views and accessors of a mesh to the document, and says where its bytes end.
uint64_t describe(const Mesh& mesh, uint64_t begin, Json& document) {
  Float3 low = mesh.positions[0], high = low;
  for (const Float3& p : mesh.positions)
    for (size_t a = 0; a < 3; ++a) {
      low[a] = std::min(low[a], p[a]);
      high[a] = std::max(high[a], p[a]);
    }
  const uint64_t positions = mesh.positions.size() * sizeof(Float3),
                 indices = mesh.triangles.size() * sizeof(Triangle);
  const size_t first = document["accessors"].size();
  document["bufferViews"].push_back(
      {{"buffer", 0}, {"byteOffset", begin}, {"byteLength", positions}, {"target", kVertices}});
  document["bufferViews"].push_back(
      {{"buffer", 0}, {"byteOffset", begin + positions}, {"byteLength", indices}, {"target", kIndices}});
  document["accessors"].push_back({{"bufferView", first},
                                   {"componentType", kFloat},
                                   {"count", mesh.positions.size()},
                                   {"type", "VEC3"},
                                   {"min", low},
                                   {"max", high}});
  document["accessors"].push_back({{"bufferView", first + 1},
                                   {"componentType", kUnsignedInt},
                                   {"count", mesh.triangles.size() * 3},
                                   {"type", "SCALAR"}});
  document["meshes"].push_back(
      {{"name", mesh.name},
       {"primitives", {{{"attributes", {{"POSITION", first}}}, {"indices", first + 1}}}}});
  return begin + positions + indices;
}

Json node_of(const std::string& name, const Transform& m) {
  Json node = Json::object();
  if (!name.empty()) node["name"] = name;
  if (m != kIdentity)
    node["matrix"] = {m[0], m[4], m[8], 0, m[1], m[5], m[9], 0, m[2], m[6], m[10], 0, m[3], m[7], m[11], 1};
  return node;
}

Json to_json(const Light& light) {
  constexpr const char* kKinds[] = {"directional", "point", "spot"};
  Json json{{"type", kKinds[size_t(light.kind)]}, {"color", light.colour}, {"intensity", light.intensity}};
  if (light.kind == Light::Kind::spot)
    json["spot"] = {{"innerConeAngle", light.inner_cone}, {"outerConeAngle", light.outer_cone}};
  return json;
}

std::string encode_json(const Scene& scene, uint64_t& binary_bytes) {
  Json document{{"asset", {{"version", "2.0"}, {"generator", "nifkit"}}}, {"scene", 0}};
  Json nodes = Json::array();
  for (const Instance& instance : scene.instances) {
    Json& node = nodes.emplace_back(node_of(instance.name, instance.transform));
    node["mesh"] = instance.mesh;
  }
  for (const Camera& camera : scene.cameras) {
    Json& node = nodes.emplace_back(node_of(camera.name, camera.transform));
    node["camera"] = document["cameras"].size();
    document["cameras"].push_back(
        {{"type", "perspective"}, {"perspective", {{"yfov", camera.vertical_fov}, {"znear", 0.001}}}});
  }
  Json lights = Json::array();
  for (const Light& light : scene.lights) {
    Json& node = nodes.emplace_back(node_of(light.name, light.transform));
    node["extensions"]["KHR_lights_punctual"]["light"] = lights.size();
    lights.push_back(to_json(light));
  }
  if (!lights.empty()) {
    document["extensionsUsed"] = {"KHR_lights_punctual"};
    document["extensions"]["KHR_lights_punctual"]["lights"] = std::move(lights);
  }
  Json shown = Json::array();
  for (size_t i = 0; i < nodes.size(); ++i) shown.push_back(i);
  document["scenes"] = {{{"nodes", std::move(shown)}}};
  document["nodes"] = std::move(nodes);
  binary_bytes = 0;
  for (const Mesh& mesh : scene.meshes) binary_bytes = describe(mesh, binary_bytes, document);
  document["buffers"] = {{{"byteLength", binary_bytes}}};
  std::string text = document.dump(-1, ' ', false, Json::error_handler_t::replace);
  text.resize((text.size() + 3) / 4 * 4, ' ');
  return text;
}

class Bytes {
 public:
  explicit Bytes(uint64_t size) { bytes_.reserve(size); }
  void put(uint32_t value) { put(&value, sizeof(value)); }
  void put(const void* from, uint64_t size) {
    const auto* begin = static_cast<const std::byte*>(from);
    bytes_.insert(bytes_.end(), begin, begin + size);
  }
  std::vector<std::byte> take() { return std::move(bytes_); }

 private:
  std::vector<std::byte> bytes_;
};

}  // namespace

std::vector<std::byte> encode_glb(const Scene& scene) {
  for (const Mesh& mesh : scene.meshes) check(mesh);
  uint64_t binary = 0;
  const std::string json = encode_json(scene, binary);
  const uint64_t size = 12 + 8 + json.size() + 8 + binary;
  if (size > kLargest)
    throw Error(Status::too_large,
                fmt::format("the scene takes {} bytes as .glb, which ends at {}", size, kLargest));
  Bytes bytes(size);
  for (uint32_t value : {kMagic, kVersion, uint32_t(size), uint32_t(json.size()), kJsonChunk})
    bytes.put(value);
  bytes.put(json.data(), json.size());
  for (uint32_t value : {uint32_t(binary), kBinaryChunk}) bytes.put(value);
  for (const Mesh& mesh : scene.meshes) {
    bytes.put(mesh.positions.data(), mesh.positions.size() * sizeof(Float3));
    bytes.put(mesh.triangles.data(), mesh.triangles.size() * sizeof(Triangle));
  }
  return bytes.take();
}

}  // namespace nif::mesh
