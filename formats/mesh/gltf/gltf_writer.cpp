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

std::pair<Float3, Float3> bounds_of(std::span<const Float3> positions) {
  Float3 low = positions[0], high = low;
  for (const Float3& p : positions)
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
  const auto [low, high] = bounds_of(mesh.positions);
  const uint64_t positions = mesh.positions.size() * sizeof(Float3),
                 indices = mesh.triangles.size() * sizeof(Triangle);
  const size_t first = document["accessors"].size(), view = document["bufferViews"].size();
  document["bufferViews"].push_back(
      {{"buffer", 0}, {"byteOffset", begin}, {"byteLength", positions}, {"target", kVertices}});
  document["bufferViews"].push_back(
      {{"buffer", 0}, {"byteOffset", begin + positions}, {"byteLength", indices}, {"target", kIndices}});
  document["accessors"].push_back({{"bufferView", view},
                                   {"componentType", kFloat},
                                   {"count", mesh.positions.size()},
                                   {"type", "VEC3"},
                                   {"min", low},
                                   {"max", high}});
  document["accessors"].push_back({{"bufferView", view + 1},
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
  const auto [low, high] = bounds_of(mesh.positions);
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

/// Triangles of a mesh that follow each other and have the same material, and the vertices that they span.
struct Run {
  uint32_t material;
  size_t triangle, triangles, vertex, vertices;
};

std::vector<Run> runs_of(const Mesh& mesh) {
  std::vector<Run> runs;
  const std::vector<uint32_t>& materials = mesh.look.materials;
  for (size_t begin = 0, end; begin < materials.size(); begin = end) {
    end = begin;
    uint32_t low = mesh.triangles[begin][0], high = low;
    for (; end < materials.size() && materials[end] == materials[begin]; ++end)
      for (const uint32_t vertex : mesh.triangles[end])
        low = std::min(low, vertex), high = std::max(high, vertex);
    runs.push_back({materials[begin], begin, end - begin, low, size_t{high} - low + 1});
  }
  return runs;
}

bool is_painted(const Mesh& mesh, const Paint* paint) {
  return paint != nullptr && !mesh.look.materials.empty();
}

/// The same for a mesh with materials.
uint64_t describe_painted(const Mesh& mesh, const Paint& paint, uint64_t begin, Json& document) {
  const auto view = [&](uint64_t bytes, int target, uint64_t stride) {
    Json& added = document["bufferViews"].emplace_back(
        Json{{"buffer", 0}, {"byteOffset", begin}, {"byteLength", bytes}, {"target", target}});
    if (stride != 0) added["byteStride"] = stride;
    begin += bytes;
    return document["bufferViews"].size() - 1;
  };
  const auto accessor = [&](size_t of_view, uint64_t offset, int component, uint64_t count,
                            const char* type) {
    document["accessors"].push_back({{"bufferView", of_view},
                                     {"byteOffset", offset},
                                     {"componentType", component},
                                     {"count", count},
                                     {"type", type}});
    return document["accessors"].size() - 1;
  };
  const auto& coordinates = mesh.look.coordinates;
  constexpr uint64_t kPosition = sizeof(Float3), kCoordinate = sizeof(coordinates[0]);
  const size_t positions = view(mesh.positions.size() * kPosition, kVertices, kPosition);
  const size_t places =
      coordinates.empty() ? 0 : view(coordinates.size() * kCoordinate, kVertices, kCoordinate);
  const size_t indices = view(mesh.triangles.size() * sizeof(Triangle), kIndices, 0);
  Json primitives = Json::array();
  for (const Run& run : runs_of(mesh)) {
    Json attributes;
    attributes["POSITION"] = accessor(positions, run.vertex * kPosition, kFloat, run.vertices, "VEC3");
    const auto [low, high] = bounds_of(std::span(mesh.positions).subspan(run.vertex, run.vertices));
    document["accessors"].back()["min"] = low;
    document["accessors"].back()["max"] = high;
    const bool pictured = paint.materials[run.material].picture != kNoTexture;
    if (pictured && !coordinates.empty())
      attributes["TEXCOORD_0"] = accessor(places, run.vertex * kCoordinate, kFloat, run.vertices, "VEC2");
    primitives.push_back({{"attributes", std::move(attributes)},
                          {"indices", accessor(indices, run.triangle * sizeof(Triangle), kUnsignedInt,
                                               run.triangles * 3, "SCALAR")},
                          {"material", run.material}});
  }
  document["meshes"].push_back({{"name", mesh.name}, {"primitives", std::move(primitives)}});
  return begin;
}

/// Indices count from the first vertex of their run.
void write_painted(const Mesh& mesh, const std::function<void(std::span<const std::byte>)>& sink) {
  sink(std::as_bytes(std::span(mesh.positions)));
  sink(std::as_bytes(std::span(mesh.look.coordinates)));
  for (const Run& run : runs_of(mesh)) {
    std::vector<Triangle> triangles(mesh.triangles.begin() + ptrdiff_t(run.triangle),
                                    mesh.triangles.begin() + ptrdiff_t(run.triangle + run.triangles));
    for (Triangle& triangle : triangles)
      for (uint32_t& vertex : triangle) vertex -= uint32_t(run.vertex);
    sink(std::as_bytes(std::span(triangles)));
  }
}

/// Appends materials and pictures, whose bytes follow those of the meshes, and returns the end of theirs.
uint64_t describe(const Paint& paint, uint64_t begin, Json& document) {
  constexpr int kLinear = 9729, kMipmaps = 9987, kClamp = 33071;
  for (const PaintedMaterial& material : paint.materials) {
    const auto& f = material.factor;
    Json surface{{"baseColorFactor", {f[0], f[1], f[2], 1}}, {"metallicFactor", 0}, {"roughnessFactor", 0.9}};
    if (material.picture != kNoTexture) surface["baseColorTexture"] = {{"index", material.picture}};
    Json& added = document["materials"].emplace_back(
        Json{{"name", material.name}, {"pbrMetallicRoughness", std::move(surface)}});
    if (material.cut) added["alphaMode"] = "MASK", added["doubleSided"] = true;
  }
  for (const std::vector<std::byte>& picture : paint.pictures) {
    document["textures"].push_back({{"sampler", 0}, {"source", document["images"].size()}});
    document["images"].push_back({{"bufferView", document["bufferViews"].size()}, {"mimeType", "image/png"}});
    document["bufferViews"].push_back({{"buffer", 0}, {"byteOffset", begin}, {"byteLength", picture.size()}});
    begin += padded(picture.size());
  }
  if (!paint.pictures.empty())
    document["samplers"].push_back(
        {{"magFilter", kLinear}, {"minFilter", kMipmaps}, {"wrapS", kClamp}, {"wrapT", kClamp}});
  return begin;
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

std::string encode_json(const Scene& scene, const Compressed& compressed, const Paint* paint,
                        uint64_t& binary_bytes) {
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
    binary_bytes = is_painted(scene.meshes[m], paint)
                       ? describe_painted(scene.meshes[m], *paint, binary_bytes, document)
                   : compressed.empty() ? describe(scene.meshes[m], binary_bytes, document)
                                        : describe(scene.meshes[m], compressed[m], binary_bytes, document);
  if (paint != nullptr) binary_bytes = describe(*paint, binary_bytes, document);
  document["buffers"] = {{{"byteLength", binary_bytes}}};
  std::string text = document.dump(-1, ' ', false, Json::error_handler_t::replace);
  text.resize(padded(text.size()), ' ');
  return text;
}

}  // namespace

void write_glb(const Scene& scene, std::optional<uint32_t> draco_bits,
               const std::function<void(std::span<const std::byte>)>& sink, const Paint* paint) {
  Compressed compressed;
  for (const Mesh& mesh : scene.meshes) {
    check_writable(mesh);
    if (draco_bits) compressed.push_back(encode_draco(mesh, *draco_bits, ""));
  }
  uint64_t binary = 0;
  const std::string json = encode_json(scene, compressed, paint, binary);
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
  const auto sink_padded = [&](std::span<const std::byte> bytes) {
    sink(bytes);
    constexpr std::array<std::byte, 4> kPadding{};
    sink(std::span(kPadding).first(padded(bytes.size()) - bytes.size()));
  };
  for (const DracoMesh& mesh : compressed) sink_padded(mesh.bytes);
  if (draco_bits) return;
  for (const Mesh& mesh : scene.meshes) {
    if (is_painted(mesh, paint)) {
      write_painted(mesh, sink);
    } else {
      sink(std::as_bytes(std::span(mesh.positions)));
      sink(std::as_bytes(std::span(mesh.triangles)));
    }
  }
  if (paint == nullptr) return;
  for (const std::vector<std::byte>& picture : paint->pictures) sink_padded(picture);
}

std::vector<std::byte> encode_glb(const Scene& scene, const Paint* paint) {
  std::vector<std::byte> bytes;
  write_glb(
      scene, std::nullopt,
      [&](std::span<const std::byte> piece) { bytes.insert(bytes.end(), piece.begin(), piece.end()); },
      paint);
  return bytes;
}

}  // namespace nif::mesh
