// The JSON is made first, because a .glb starts with its length. Then positions and indices go to the file
// straight from the meshes, without a copy. Draco runs before that, because the JSON needs its sizes.
#include "formats/mesh/gltf/gltf_writer.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <limits>
#include <nlohmann/json.hpp>

#include "formats/base/status.hpp"
#include "formats/mesh/draco_writer.hpp"

namespace nif::mesh {
namespace {

using Json = nlohmann::ordered_json;

static_assert(std::endian::native == std::endian::little);
constexpr uint64_t kLargest = std::numeric_limits<uint32_t>::max();
// From the specification: component types, buffer targets, numbers of the container.
constexpr int kUnsignedInt = 5125, kFloat = 5126, kVertices = 34962, kIndices = 34963;
constexpr uint32_t kMagic = 0x46546C67, kVersion = 2, kJsonChunk = 0x4E4F534A, kBinaryChunk = 0x004E4942;

constexpr const char* kDraco = "KHR_draco_mesh_compression";

/// The compressed meshes of a scene; empty without compression.
using Compressed = std::vector<DracoMesh>;

std::pair<Float3, Float3> bounds_of(const Mesh& mesh) {
  Float3 low = mesh.positions[0], high = low;
  for (const Float3& p : mesh.positions)
    for (size_t a = 0; a < 3; ++a) {
      low[a] = std::min(low[a], p[a]);
      high[a] = std::max(high[a], p[a]);
    }
  return {low, high};
}

/// Each view starts at a multiple of this, as accessors of floats require.
uint64_t padded(uint64_t bytes) { return (bytes + 3) / 4 * 4; }

/// Appends views and accessors of a mesh to the document, and returns the end of its bytes.
uint64_t describe(const Mesh& mesh, uint64_t begin, Json& document) {
  const auto [low, high] = bounds_of(mesh);
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

/// The same for a compressed mesh.
uint64_t describe(const Mesh& mesh, const DracoMesh& compressed, uint64_t begin, Json& document) {
  const auto [low, high] = bounds_of(mesh);
  const size_t first = document["accessors"].size(), view = document["bufferViews"].size();
  document["bufferViews"].push_back(
      {{"buffer", 0}, {"byteOffset", begin}, {"byteLength", compressed.bytes.size()}});
  document["accessors"].push_back({{"componentType", kFloat},
                                   {"count", compressed.points},
                                   {"type", "VEC3"},
                                   {"min", low},
                                   {"max", high}});
  document["accessors"].push_back(
      {{"componentType", kUnsignedInt}, {"count", compressed.faces * 3}, {"type", "SCALAR"}});
  // Draco numbers attributes in the order of adding: positions are the only one.
  const Json extension{{kDraco, {{"bufferView", view}, {"attributes", {{"POSITION", 0}}}}}};
  document["meshes"].push_back(
      {{"name", mesh.name},
       {"primitives",
        {{{"attributes", {{"POSITION", first}}}, {"indices", first + 1}, {"extensions", extension}}}}});
  return begin + padded(compressed.bytes.size());
}

Json node_of(const std::string& name, const Transform& m, const Double3& remainder = {}) {
  Json node = Json::object();
  if (!name.empty()) node["name"] = name;
  const Double3 t = to_double(std::array{m[3], m[7], m[11]}) + remainder;
  if (m != kIdentity || remainder != Double3{})
    node["matrix"] = {m[0], m[4], m[8], 0, m[1], m[5], m[9], 0, m[2], m[6], m[10], 0, t[0], t[1], t[2], 1};
  return node;
}

Json to_json(const Light& light) {
  constexpr const char* kKinds[] = {"directional", "point", "spot"};
  Json json{{"type", kKinds[size_t(light.kind)]}, {"color", light.colour}, {"intensity", light.intensity}};
  if (light.kind == Light::Kind::spot)
    json["spot"] = {{"innerConeAngle", light.inner_cone}, {"outerConeAngle", light.outer_cone}};
  return json;
}

std::string encode_json(const Scene& scene, const Compressed& compressed, uint64_t& binary_bytes) {
  Json document{{"asset", {{"version", "2.0"}, {"generator", "nifkit"}}}, {"scene", 0}};
  Json nodes = Json::array();
  for (const Instance& instance : scene.instances) {
    Json& node = nodes.emplace_back(node_of(instance.name, instance.transform, instance.remainder));
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
    document["extensionsUsed"].push_back("KHR_lights_punctual");
    document["extensions"]["KHR_lights_punctual"]["lights"] = std::move(lights);
  }
  if (!compressed.empty()) {
    document["extensionsUsed"].push_back(kDraco);
    document["extensionsRequired"] = {kDraco};
  }
  Json shown = Json::array();
  for (size_t i = 0; i < nodes.size(); ++i) shown.push_back(i);
  document["scenes"] = {{{"nodes", std::move(shown)}}};
  document["nodes"] = std::move(nodes);
  binary_bytes = 0;
  for (size_t m = 0; m < scene.meshes.size(); ++m)
    binary_bytes = compressed.empty() ? describe(scene.meshes[m], binary_bytes, document)
                                      : describe(scene.meshes[m], compressed[m], binary_bytes, document);
  document["buffers"] = {{{"byteLength", binary_bytes}}};
  std::string text = document.dump(-1, ' ', false, Json::error_handler_t::replace);
  text.resize(padded(text.size()), ' ');
  return text;
}

}  // namespace

void write_glb(const Scene& scene, std::optional<uint32_t> draco_bits,
               const std::function<void(std::span<const std::byte>)>& sink) {
  Compressed compressed;
  for (const Mesh& mesh : scene.meshes) {
    check_writable(mesh);
    if (draco_bits) compressed.push_back(encode_draco(mesh, *draco_bits, ""));
  }
  uint64_t binary = 0;
  const std::string json = encode_json(scene, compressed, binary);
  const uint64_t size = 12 + 8 + json.size() + 8 + binary;
  if (size > kLargest)
    throw Error(
        Status::too_large,
        fmt::format("the scene takes {} bytes as .glb, but a .glb can have at most {}", size, kLargest));
  const std::array head{kMagic, kVersion, uint32_t(size), uint32_t(json.size()), kJsonChunk};
  sink(std::as_bytes(std::span(head)));
  sink(std::as_bytes(std::span(json)));
  const std::array chunk{uint32_t(binary), kBinaryChunk};
  sink(std::as_bytes(std::span(chunk)));
  if (draco_bits) {
    for (const DracoMesh& mesh : compressed) {
      sink(mesh.bytes);
      constexpr std::array<std::byte, 4> kPadding{};
      sink(std::span(kPadding).first(padded(mesh.bytes.size()) - mesh.bytes.size()));
    }
    return;
  }
  for (const Mesh& mesh : scene.meshes) {
    sink(std::as_bytes(std::span(mesh.positions)));
    sink(std::as_bytes(std::span(mesh.triangles)));
  }
}

std::vector<std::byte> encode_glb(const Scene& scene) {
  std::vector<std::byte> bytes;
  write_glb(scene, std::nullopt,
            [&](std::span<const std::byte> piece) { bytes.insert(bytes.end(), piece.begin(), piece.end()); });
  return bytes;
}

}  // namespace nif::mesh
