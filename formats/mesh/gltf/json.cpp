// Opening of .gltf and .glb. tinygltf trusts much of what it reads: it indexes buffer views unchecked for
// images and Draco data, recurses into "extras" as deep as they go, and refuses buffer files that are longer
// than they need to be. So it is given only the parts of the JSON that matter, after these checks, and no
// file system.
#include "formats/mesh/gltf/json.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <nlohmann/json.hpp>

#include "formats/base/json_text.hpp"
#include "formats/mesh/file_bytes.hpp"
#include "formats/mesh/gltf/uri.hpp"

namespace nif::mesh::detail {
namespace {

using nlohmann::json;

uint32_t word_at(std::string_view bytes, size_t at) {
  uint32_t word = 0;
  std::memcpy(&word, bytes.data() + at, sizeof word);
  return word;
}

json parse(const Input& input, std::string_view text) {
  while (text.ends_with('\0')) text.remove_suffix(1);  // some writers pad the GLB chunk with zeros
  if (const size_t at = too_deep_at(text); at != text.npos)
    input.fail(Status::malformed_mesh,
               fmt::format("nests its JSON deeper than {} levels at byte {}", kMostJsonDepth, at));
  try {
    return json::parse(text);
  } catch (const json::parse_error& error) {
    if (error.byte > text.size()) {
      input.fail(Status::file_truncated,
                 fmt::format("has JSON that ends too early, at byte {}", text.size()));
    }
    input.fail(Status::malformed_mesh, fmt::format("has a JSON error at byte {}", error.byte));
  } catch (const json::exception& error) {  // a number beyond double
    input.fail(Status::malformed_mesh, fmt::format("has JSON that cannot be read ({})", error.what()));
  }
}

std::string string_member(const json& object, const char* name) {
  const json* value = member(object, name);
  return value != nullptr && value->is_string() ? value->get<std::string>() : std::string();
}

void check_version(const Input& input, const json& root) {
  const json* asset = member(root, "asset");
  const std::string version = asset == nullptr ? std::string() : string_member(*asset, "version");
  if (version.empty()) input.fail(Status::not_a_mesh, "is JSON but not glTF: it has no asset version");
  if (!version.starts_with("2.")) {
    input.fail(Status::not_a_mesh, fmt::format("is glTF {}; only glTF 2 is read", version.substr(0, 20)));
  }
}

bool is_decoded(std::string_view extension) {
  if (extension == "KHR_draco_mesh_compression" || extension == "KHR_mesh_quantization" ||
      extension == "EXT_meshopt_compression")
    return true;
  // Of appearance only: whether they are decoded or not, the surface is the same.
  static constexpr std::array kAppearance{"KHR_materials_",   "KHR_texture_", "EXT_texture_",
                                          "MSFT_texture_dds", "KHR_lights_",  "EXT_lights_",
                                          "KHR_animation_",   "KHR_xmp"};
  return std::ranges::any_of(kAppearance,
                             [&](std::string_view prefix) { return extension.starts_with(prefix); });
}

void check_extensions(const Input& input, const json& root, GltfSource& source) {
  if (const json* required = member(root, "extensionsRequired")) {
    for (const json& name : *required) {
      if (name.is_string() && !is_decoded(name.get<std::string>())) {
        input.fail(
            Status::unsupported_extension,
            fmt::format("requires the glTF extension {}, which is not supported", name.get<std::string>()));
      }
    }
  }
  if (const json* used = member(root, "extensionsUsed")) {
    if (std::ranges::find(*used, json("EXT_mesh_gpu_instancing")) != used->end()) {
      source.warnings.push_back(input.file.string() +
                                ": EXT_mesh_gpu_instancing is not supported; each of its nodes appears once");
    }
  }
}

ExternalFile load_external(const Input& input, size_t index, const std::string& uri) {
  const std::optional<std::filesystem::path> path = local_file(input, uri);
  if (!path) {
    input.fail(Status::missing_buffer,
               fmt::format("buffer {} is at '{}', which is not a local file", index, uri));
  }
  try {
    return {*path, std::string(load_file(*path, input.limits.max_decompressed_bytes).view())};
  } catch (const Error& error) {
    const bool missing = error.status() == Status::file_not_found;
    input.fail(
        missing ? Status::missing_buffer : error.status(),
        fmt::format("the file '{}' of buffer {} {}", uri, index, missing ? "is missing" : "cannot be read"));
  }
}

void open_buffer(const Input& input, const json& buffer, const GltfContainer& container,
                 std::vector<ExternalFile>& external, GltfSource& source) {
  const size_t index = source.buffers.size();
  const json* length = member(buffer, "byteLength");
  if (length == nullptr || !length->is_number_unsigned()) {
    input.fail(Status::malformed_mesh, fmt::format("buffer {} has no byteLength", index));
  }
  const uint64_t size = length->get<uint64_t>();
  const std::string uri = string_member(buffer, "uri");
  std::string_view bytes;
  if (uri.empty()) {
    if (index != 0 || !container.binary) {
      source.buffers.push_back(std::nullopt);
      return;
    }
    bytes = *container.binary;
  } else if (uri.starts_with("data:")) {
    std::optional<std::string> decoded = decode_data_uri(uri);
    if (!decoded)
      input.fail(Status::malformed_mesh, fmt::format("the data URI of buffer {} is not base64", index));
    bytes = source.owned.emplace_back(std::move(*decoded));
  } else {
    external.push_back(load_external(input, index, uri));
    bytes = source.owned.emplace_back(external.back().bytes);
  }
  if (bytes.size() < size) {
    input.fail(
        Status::file_truncated,
        fmt::format("buffer {}{} has {} bytes instead of {}", index,
                    uri.empty() || uri.starts_with("data:") ? "" : " ('" + uri + "')", bytes.size(), size));
  }
  source.buffers.emplace_back(bytes.substr(0, size));
}

/// Keeps the geometry and the hierarchy. Draco primitives lose their index accessor, which has no data.
json reduced(const json& root) {
  json kept = json::object();
  for (const char* name : {"asset", "scene", "scenes", "nodes", "meshes", "accessors", "bufferViews"}) {
    if (const json* value = member(root, name)) kept[name] = *value;
  }
  if (kept.contains("meshes")) {
    for (json& mesh : kept["meshes"]) {
      if (!mesh.is_object() || !mesh.contains("primitives")) continue;
      for (json& primitive : mesh["primitives"]) {
        const json* extensions = member(primitive, "extensions");
        if (extensions != nullptr && extensions->contains("KHR_draco_mesh_compression"))
          primitive.erase("indices");
      }
    }
  }
  return kept;
}

}  // namespace

const json* member(const json& object, const char* name) {
  const auto found = object.is_object() ? object.find(name) : object.end();
  return found == object.end() ? nullptr : &*found;
}

GltfContainer open_container(const Input& input) {
  std::string_view bytes = input.bytes;
  if (!bytes.starts_with("glTF")) return {bytes, std::nullopt, 0};
  if (bytes.size() < 12) input.fail(Status::file_truncated, "ends within the GLB header");
  if (const uint32_t version = word_at(bytes, 4); version != 2) {
    input.fail(Status::not_a_mesh,
               fmt::format("is a GLB container of version {}; only version 2 is read", version));
  }
  const uint32_t length = word_at(bytes, 8);
  if (length > bytes.size()) {
    input.fail(
        Status::file_truncated,
        fmt::format("announces {} bytes in its GLB header, but ends at byte {}", length, bytes.size()));
  }
  bytes = bytes.substr(0, length);
  GltfContainer container;
  container.length = length;
  constexpr uint32_t kJson = 0x4E4F534A, kBinary = 0x004E4942;
  for (size_t at = 12; at + 8 <= bytes.size();) {
    const uint32_t size = word_at(bytes, at), kind = word_at(bytes, at + 4);
    if (size > bytes.size() - at - 8) {
      input.fail(
          Status::file_truncated,
          fmt::format("has a GLB chunk of {} bytes at byte {}, but ends at byte {}", size, at, bytes.size()));
    }
    const std::string_view chunk = bytes.substr(at + 8, size);
    if (kind == kJson && container.text.empty()) container.text = chunk;
    if (kind == kBinary && !container.binary) container.binary = chunk;
    at += 8 + size_t{size};
  }
  if (container.text.empty()) input.fail(Status::malformed_mesh, "has no JSON in its GLB container");
  return container;
}

GltfSource open_gltf(const Input& input, std::vector<ExternalFile>& external) {
  const GltfContainer container = open_container(input);
  const json root = parse(input, container.text);
  check_version(input, root);
  GltfSource source;
  check_extensions(input, root, source);
  if (const json* buffers = member(root, "buffers")) {
    for (const json& buffer : *buffers) open_buffer(input, buffer, container, external, source);
  }
  source.fixtures = read_fixtures(root);
  source.skins = read_skins(root);
  source.animated = read_animated_nodes(root);
  if (input.limits.colors) source.look = read_look(root);
  source.json = reduced(root).dump(-1, ' ', false, json::error_handler_t::replace);
  return source;
}

}  // namespace nif::mesh::detail
