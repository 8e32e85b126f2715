// Opens .gltf and .glb. tinygltf trusts much of what it reads: it indexes buffer views unchecked for images
// and Draco data, recurses into "extras" without limit, and refuses buffer files that are longer than
// necessary. So, after these checks, it gets only the relevant parts of the JSON, and no file system.
#include "formats/mesh/gltf/json.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <map>
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
      extension == "EXT_meshopt_compression" || extension == "EXT_mesh_gpu_instancing" ||
      extension == "KHR_node_visibility")
    return true;
  // These only affect appearance, or offer coarser versions: decoded or not, the surface is the same.
  static constexpr std::array kAppearance{"KHR_materials_",   "KHR_texture_", "EXT_texture_",
                                          "MSFT_texture_dds", "KHR_lights_",  "EXT_lights_",
                                          "KHR_animation_",   "KHR_xmp",      "MSFT_lod"};
  return std::ranges::any_of(kAppearance,
                             [&](std::string_view prefix) { return extension.starts_with(prefix); });
}

void check_extensions(const Input& input, const json& root) {
  if (const json* required = member(root, "extensionsRequired")) {
    for (const json& name : *required) {
      if (name.is_string() && !is_decoded(name.get<std::string>())) {
        input.fail(Status::unsupported_extension,
                   fmt::format("requires the glTF extension {}, which is not supported",
                               name.get<std::string>().substr(0, 100)));
      }
    }
  }
}

/// Opens the buffers of a file, one after the other.
class BufferOpener {
 public:
  BufferOpener(const Input& input, const GltfContainer& container, std::vector<ExternalFile>& external,
               GltfSource& source)
      : input_(input), container_(container), external_(external), source_(source) {}

  void open(const json& buffer) {
    const size_t index = source_.buffers.size();
    const json* length = member(buffer, "byteLength");
    if (length == nullptr || !length->is_number_unsigned()) {
      input_.fail(Status::malformed_mesh, fmt::format("buffer {} has no byteLength", index));
    }
    const uint64_t size = length->get<uint64_t>();
    const std::string uri = string_member(buffer, "uri");
    std::string_view bytes;
    if (uri.empty()) {
      if (index != 0 || !container_.binary) {
        source_.buffers.push_back(std::nullopt);
        return;
      }
      bytes = *container_.binary;
    } else if (uri.starts_with("data:")) {
      std::optional<std::string> decoded = decode_data_uri(uri);
      if (!decoded)
        input_.fail(Status::malformed_mesh, fmt::format("the data URI of buffer {} is not base64", index));
      bytes = source_.owned.emplace_back(std::move(*decoded));
    } else {
      bytes = file_of(index, uri);
    }
    if (bytes.size() < size) {
      input_.fail(
          Status::file_truncated,
          fmt::format("buffer {}{} has {} bytes instead of {}", index,
                      uri.empty() || uri.starts_with("data:") ? "" : " ('" + uri + "')", bytes.size(), size));
    }
    source_.buffers.emplace_back(bytes.substr(0, size));
  }

 private:
  /// Each file is read once, and their total is bounded, because a few bytes of JSON can refer to a file of
  /// any length.
  std::string_view file_of(size_t index, const std::string& uri) {
    const std::optional<std::filesystem::path> path = local_file(input_, uri);
    if (!path) {
      input_.fail(Status::missing_buffer,
                  fmt::format("buffer {} is at '{}', which is not a local file", index, uri));
    }
    const auto [known, added] = files_.try_emplace(path->lexically_normal());
    if (!added) return known->second;
    try {
      const ByteBuffer bytes = load_named_file(*path, bytes_left_);
      bytes_left_ -= bytes.size();
      external_.push_back({*path, std::string(bytes.view())});
    } catch (const Error& error) {
      const bool missing = error.status() == Status::file_not_found;
      input_.fail(missing ? Status::missing_buffer : error.status(),
                  fmt::format("the file '{}' of buffer {} {}", uri, index,
                              missing ? "is missing" : "cannot be read"));
    }
    return known->second = source_.owned.emplace_back(external_.back().bytes);
  }

  const Input& input_;
  const GltfContainer& container_;
  std::vector<ExternalFile>& external_;
  GltfSource& source_;
  std::map<std::filesystem::path, std::string_view> files_;  // views into source_.owned
  uint64_t bytes_left_ = input_.limits.max_decompressed_bytes;
};

/// For glTF's indices, tinygltf takes the lower 32 bits of any number.
void check_indices(const Input& input, const json& value, std::string_view name = {}) {
  if (value.is_structured()) {
    for (const auto& item : value.items()) {
      const std::string_view key = value.is_object() ? std::string_view(item.key()) : name;
      if (key != "extras" && key != "extensions") check_indices(input, item.value(), key);
    }
    return;
  }
  static constexpr std::array<std::string_view, 11> kOthers{
      "byteOffset",  "byteLength", "count", "min",     "max",   "matrix",
      "translation", "rotation",   "scale", "weights", "camera"};
  if (!value.is_number_integer() || std::ranges::find(kOthers, name) != kOthers.end()) return;
  const bool fits =
      value.is_number_unsigned() ? value.get<uint64_t>() <= INT32_MAX : value.get<int64_t>() >= INT32_MIN;
  if (!fits)
    input.fail(Status::malformed_mesh,
               fmt::format("has {} as its {}, beyond 32 bits", value.dump(),
                           name == kIndicesAttribute ? "indices" : name.substr(0, 40)));
}

/// Removes the index accessor of Draco primitives, which has no data.
void move_indices(json& primitive) {
  const json* extensions = member(primitive, "extensions");
  if (extensions != nullptr && extensions->contains("KHR_draco_mesh_compression")) primitive.erase("indices");
  const auto attributes = primitive.is_object() ? primitive.find("attributes") : primitive.end();
  if (attributes == primitive.end() || !attributes->is_object()) return;
  attributes->erase(kIndicesAttribute);
  const auto indices = primitive.find("indices");
  if (indices == primitive.end() || !indices->is_number_unsigned()) return;
  (*attributes)[kIndicesAttribute] = *indices;
  primitive.erase(indices);
}

/// Keeps only the geometry and the hierarchy.
json reduced(const json& root) {
  json kept = json::object();
  for (const char* name : {"asset", "scene", "scenes", "nodes", "meshes", "accessors", "bufferViews"}) {
    if (const json* value = member(root, name)) kept[name] = *value;
  }
  if (kept.contains("meshes")) {
    for (json& mesh : kept["meshes"]) {
      if (!mesh.is_object() || !mesh.contains("primitives")) continue;
      for (json& primitive : mesh["primitives"]) move_indices(primitive);
    }
  }
  return kept;
}

}  // namespace

const json* member(const json& object, const char* name) {
  const auto found = object.is_object() ? object.find(name) : object.end();
  return found == object.end() ? nullptr : &*found;
}

GltfBaseColor base_color_of(const json& material) {
  const json* extensions = member(material, "extensions");
  const json* diffuse = extensions ? member(*extensions, "KHR_materials_pbrSpecularGlossiness") : nullptr;
  if (diffuse && diffuse->is_object())
    return {member(*diffuse, "diffuseFactor"), member(*diffuse, "diffuseTexture")};
  const json* color = member(material, "pbrMetallicRoughness");
  if (!color) return {};
  return {member(*color, "baseColorFactor"), member(*color, "baseColorTexture")};
}

std::string short_name(std::string_view name) {
  constexpr size_t kLongest = 128;
  if (name.size() <= kLongest) return std::string(name);
  size_t size = kLongest;
  while (size > 0 && (static_cast<unsigned char>(name[size]) & 0xC0) == 0x80) --size;
  return std::string(name.substr(0, size));
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
  check_extensions(input, root);
  GltfSource source;
  if (const json* buffers = member(root, "buffers")) {
    BufferOpener opener(input, container, external, source);
    for (const json& buffer : *buffers) opener.open(buffer);
  }
  source.fixtures = read_fixtures(root);
  source.skins = read_skins(root);
  source.moving = read_moving_nodes(root);
  if (input.limits.clips || input.limits.moment) source.clips = read_clips(root);
  source.surfaces = read_surfaces(root);
  if (input.limits.colors || input.limits.alpha.read) source.look = read_look(root);
  const json kept = reduced(root);
  check_indices(input, kept);
  source.json = kept.dump(-1, ' ', false, json::error_handler_t::replace);
  return source;
}

}  // namespace nif::mesh::detail
