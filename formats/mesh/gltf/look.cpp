// Works in two steps: read_look() takes the materials out of the JSON, and add_materials() later decodes the
// pictures that are used, each once. A fault in either costs the colour, never the mesh.
#include "formats/mesh/gltf/look.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "formats/mesh/gltf/pictures.hpp"

namespace nif::mesh::detail {
namespace {

using nlohmann::json;

/// Returns -1 if there is no such index.
int index_in(const json& object, const char* name) {
  const json* value = member(object, name);
  if (value == nullptr || !value->is_number_unsigned()) return -1;
  const uint64_t index = value->get<uint64_t>();
  return index < 0x7fffffffu ? static_cast<int>(index) : -1;
}

/// The numbers of an array with at least kCount elements; nothing for anything else.
template <size_t kCount>
std::optional<std::array<double, kCount>> numbers(const json* value) {
  if (value == nullptr || !value->is_array() || value->size() < kCount) return std::nullopt;
  std::array<double, kCount> out;
  for (size_t i = 0; i < kCount; ++i) {
    if (!(*value)[i].is_number()) return std::nullopt;
    out[i] = (*value)[i].get<double>();
    if (!std::isfinite(out[i])) return std::nullopt;
  }
  return out;
}

Wrap wrap_of(const json& sampler, const char* name) {
  const json* value = member(sampler, name);
  if (value == nullptr) return Wrap::repeat;
  constexpr int kClampToEdge = 33071, kMirroredRepeat = 33648;
  return *value == kClampToEdge ? Wrap::clamp : *value == kMirroredRepeat ? Wrap::mirror : Wrap::repeat;
}

/// An element of an array of the document, or null.
const json* element(const json& root, const char* array, int index) {
  const json* elements = member(root, array);
  if (elements == nullptr || !elements->is_array() || index < 0 || size_t(index) >= elements->size())
    return nullptr;
  return &(*elements)[size_t(index)];
}

/// KHR_texture_transform: scale, then rotate (in the direction that engines use), then translate.
void read_transform(const json& info, GltfMaterial& out) {
  const json* extensions = member(info, "extensions");
  const json* transform = extensions ? member(*extensions, "KHR_texture_transform") : nullptr;
  if (transform == nullptr) return;
  if (const int coordinates = index_in(*transform, "texCoord"); coordinates >= 0)
    out.coordinates = coordinates;
  const auto offset = numbers<2>(member(*transform, "offset")).value_or(std::array{0.0, 0.0}),
             scale = numbers<2>(member(*transform, "scale")).value_or(std::array{1.0, 1.0});
  const json* rotation = member(*transform, "rotation");
  const double angle = rotation != nullptr && rotation->is_number() ? rotation->get<double>() : 0;
  const double c = std::isfinite(angle) ? std::cos(angle) : 1, s = std::isfinite(angle) ? std::sin(angle) : 0;
  const std::array<double, 6> rows{c * scale[0],  s * scale[1], offset[0],
                                   -s * scale[0], c * scale[1], offset[1]};
  for (size_t i = 0; i < rows.size(); ++i) out.material.transform[i] = static_cast<float>(rows[i]);
}

/// The image of a texture; EXT_texture_webp may name a better one than the texture itself. Null: no such texture.
int image_of(const json* found) {
  if (found == nullptr) return kNoSuchImage;
  const json& texture = *found;
  const json* extensions = member(texture, "extensions");
  const json* webp = extensions ? member(*extensions, "EXT_texture_webp") : nullptr;
  const int better = webp != nullptr ? index_in(*webp, "source") : -1;
  if (better != -1) return better;
  if (member(texture, "source") == nullptr) return kInExtension;
  const int image = index_in(texture, "source");
  return image == -1 ? kNoSuchImage : image;
}

GltfMaterial read_material(const json& root, const json& source) {
  GltfMaterial out;
  const auto& [color, info] = base_color_of(source);
  if (const auto factor = numbers<3>(color))
    for (size_t c = 0; c < 3; ++c)
      out.material.factor[c] = static_cast<float>(std::clamp((*factor)[c], 0.0, 1.0));
  if (info == nullptr) return out;
  out.coordinates = std::max(0, index_in(*info, "texCoord"));
  const json* texture = element(root, "textures", index_in(*info, "index"));
  out.image = image_of(texture);
  if (const json* sampler = texture ? element(root, "samplers", index_in(*texture, "sampler")) : nullptr)
    out.material.wrap = {wrap_of(*sampler, "wrapS"), wrap_of(*sampler, "wrapT")};
  read_transform(*info, out);
  return out;
}

/// Reads pictures, each once.
class Pictures {
 public:
  Pictures(const Input& input, const GltfLook& look, const GltfData& data, Scene& scene)
      : input_(input), pictures_(input, look, data, scene), scene_(scene) {}

  /// Returns its index into Scene::textures, or kNoTexture.
  uint32_t read(int image) {
    const auto [known, fresh] = known_.emplace(image, kNoTexture);
    if (!fresh) return known->second;
    std::string why;
    std::optional<Texture> texture = pictures_.read<Texture>(image, decode_image, why);
    if (!texture) {
      if (++notes_ <= kMostNotes)
        scene_.notes.push_back(
            {NoteKind::pictures,
             fmt::format("{}: image{} {}; materials with it only have their factor", input_.file.string(),
                         image < 0 ? "" : fmt::format(" {}", image), why)});
      return kNoTexture;
    }
    scene_.textures.push_back(std::move(*texture));
    return known->second = uint32_t(scene_.textures.size() - 1);
  }

  void report() const {
    if (notes_ > kMostNotes)
      scene_.notes.push_back({NoteKind::pictures, fmt::format("{}: {} more images cannot be read",
                                                              input_.file.string(), notes_ - kMostNotes)});
  }

 private:
  const Input& input_;
  GltfPictures pictures_;
  Scene& scene_;
  std::map<int, uint32_t> known_;
  size_t notes_ = 0;
};

}  // namespace

GltfLook read_look(const json& root) {
  GltfLook look;
  if (const json* materials = member(root, "materials"); materials != nullptr && materials->is_array())
    for (const json& material : *materials) look.materials.push_back(read_material(root, material));
  if (const json* images = member(root, "images"); images != nullptr && images->is_array())
    for (const json& image : *images) {
      GltfImage& out = look.images.emplace_back();
      out.view = index_in(image, "bufferView");
      if (const json* uri = member(image, "uri"); uri != nullptr && uri->is_string())
        out.uri = uri->get<std::string>();
    }
  return look;
}

void add_materials(const Input& input, const GltfLook& look, const std::vector<bool>& used,
                   const GltfData& data, Scene& scene) {
  Pictures pictures(input, look, data, scene);
  scene.materials.assign(1, Material());
  for (size_t m = 0; m < look.materials.size(); ++m) {
    const GltfMaterial& source = look.materials[m];
    Material material = source.material;
    if (used[m] && source.image != -1) material.texture = pictures.read(source.image);
    scene.materials.push_back(material);
    scene.materials.push_back(source.material);
  }
  pictures.report();
}

}  // namespace nif::mesh::detail
