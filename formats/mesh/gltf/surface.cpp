// Reads the names of materials, and whether they let light through. Reads the JSON, because tinygltf does not
// get materials: errors in them would cost the meshes.
#include <cmath>
#include <nlohmann/json.hpp>

#include "formats/mesh/gltf/json.hpp"

namespace nif::mesh::detail {
namespace {

using nlohmann::json;

double number_in(const json& object, const char* name, double otherwise) {
  const json* value = member(object, name);
  const double number = value && value->is_number() ? value->get<double>() : otherwise;
  return std::isfinite(number) ? number : otherwise;
}

GltfSurface read_surface(const json& material) {
  GltfSurface surface;
  if (const json* name = member(material, "name"); name && name->is_string())
    surface.name = name->get<std::string>();
  if (const json* mode = member(material, "alphaMode")) {
    surface.alpha = *mode == "MASK"    ? GltfSurface::Alpha::mask
                    : *mode == "BLEND" ? GltfSurface::Alpha::blend
                                       : GltfSurface::Alpha::opaque;
  }
  surface.cutoff = number_in(material, "alphaCutoff", 0.5);
  const GltfBaseColor color = base_color_of(material);
  surface.textured = color.texture != nullptr;
  if (color.factor && color.factor->is_array() && color.factor->size() == 4 && (*color.factor)[3].is_number())
    surface.factor = (*color.factor)[3].get<double>();
  const json* extensions = member(material, "extensions");
  const json* transmission = extensions ? member(*extensions, "KHR_materials_transmission") : nullptr;
  surface.transmits = transmission && number_in(*transmission, "transmissionFactor", 0) > 0;
  return surface;
}

}  // namespace

bool GltfSurface::lets_light_through(bool colors_have_alpha) const {
  if (transmits) return true;
  const bool varies = textured || colors_have_alpha;
  switch (alpha) {
    case Alpha::mask:
      return cutoff > 0 && (varies || factor < cutoff);
    case Alpha::blend:
      return varies || factor < 1;
    case Alpha::opaque:
      break;
  }
  return false;
}

std::vector<GltfSurface> read_surfaces(const json& root) {
  std::vector<GltfSurface> surfaces;
  const json* materials = member(root, "materials");
  if (materials && materials->is_array())
    for (const json& material : *materials) surfaces.push_back(read_surface(material));
  return surfaces;
}

}  // namespace nif::mesh::detail
