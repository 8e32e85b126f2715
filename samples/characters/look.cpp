#include "look.hpp"

#include <png.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

using nlohmann::json;

namespace {

float linear(float srgb) {
  return srgb <= 0.04045f ? srgb / 12.92f : std::pow((srgb + 0.055f) / 1.055f, 2.4f);
}

}  // namespace

Look::Look(const Gltf& file, const std::vector<std::vector<size_t>>& nodes) {
  const json& document = file.document();
  for (const json& material : document.value("materials", json::array())) {
    Material& read = materials_.emplace_back();
    const json surface = material.value("pbrMetallicRoughness", json::object());
    if (surface.contains("baseColorFactor"))
      for (size_t c = 0; c < 3; ++c) read.factor[c] = surface["baseColorFactor"].at(c);
    if (!surface.contains("baseColorTexture")) continue;
    const std::vector<uint8_t> png = file.picture(surface["baseColorTexture"].at("index"));
    png_image image{};
    image.version = PNG_IMAGE_VERSION;
    // Other formats are left out: the material then has its factor alone.
    if (png.empty() || !png_image_begin_read_from_memory(&image, png.data(), png.size())) continue;
    image.format = PNG_FORMAT_RGBA;
    Picture& picture = pictures_.emplace_back(Picture{image.width, image.height, {}});
    picture.texels.resize(PNG_IMAGE_SIZE(image));
    if (!png_image_finish_read(&image, nullptr, picture.texels.data(), 0, nullptr))
      throw std::runtime_error(image.message);
    read.picture = int(pictures_.size()) - 1;
  }
  materials_.emplace_back();
  for (const std::vector<size_t>& of_instance : nodes) {
    std::vector<Triangle>& triangles = triangles_.emplace_back();
    for (const size_t node : of_instance) {
      const json& of_node = document.at("nodes").at(node);
      if (of_node.contains("mesh"))
        add_mesh(file, document.at("meshes").at(of_node["mesh"].get<size_t>()), triangles);
    }
  }
}

void Look::add_mesh(const Gltf& file, const json& mesh, std::vector<Triangle>& triangles) const {
  for (const json& primitive : mesh.at("primitives")) {
    if (primitive.value("mode", 4) != 4) throw std::runtime_error("the sample reads only lists of triangles");
    const json& attributes = primitive.at("attributes");
    std::vector<float> places, indices;
    if (attributes.contains("TEXCOORD_0")) places = file.values(attributes["TEXCOORD_0"]);
    if (primitive.contains("indices")) {
      indices = file.values(primitive["indices"]);
    } else {
      const size_t count =
          file.document().at("accessors").at(attributes.at("POSITION").get<size_t>()).at("count");
      for (size_t i = 0; i < count; ++i) indices.push_back(float(i));
    }
    const size_t material = primitive.value("material", materials_.size() - 1);
    for (size_t i = 0; i + 2 < indices.size(); i += 3) {
      Triangle& triangle = triangles.emplace_back(Triangle{std::min(material, materials_.size() - 1), {}});
      for (size_t k = 0; k < 3 && !places.empty(); ++k)
        for (size_t a = 0; a < 2; ++a) triangle.at[k][a] = places.at(2 * size_t(indices[i + k]) + a);
    }
  }
}

Float3 Look::colour(uint32_t instance, uint32_t number, float u, float v) const {
  if (instance >= triangles_.size() || number >= triangles_[instance].size()) return {0.5f, 0.5f, 0.5f};
  const Triangle& triangle = triangles_[instance][number];
  const Material& material = materials_[triangle.material];
  if (material.picture < 0) return material.factor;
  const Picture& picture = pictures_[size_t(material.picture)];
  const auto texel = [&](size_t axis, uint32_t size) {
    const float at = (1 - u - v) * triangle.at[0][axis] + u * triangle.at[1][axis] + v * triangle.at[2][axis];
    return std::min(uint32_t((at - std::floor(at)) * float(size)), size - 1);
  };
  const uint8_t* found =
      &picture.texels[4 * (size_t{texel(1, picture.height)} * picture.width + texel(0, picture.width))];
  return {material.factor[0] * linear(found[0] / 255.0f), material.factor[1] * linear(found[1] / 255.0f),
          material.factor[2] * linear(found[2] / 255.0f)};
}
