// Reads cameras and lights from the JSON and not with tinygltf, whose reader of these refuses a whole file
// for errors in them.
#include "formats/mesh/gltf/fixtures.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "formats/mesh/gltf/json.hpp"

namespace nif::mesh::detail {
namespace {

using nlohmann::json;
using std::numbers::pi;

/// The reason why a camera or light is refused.
struct Flaw {
  std::string what;
};

std::string name_of(const json& object) {
  const json* value = member(object, "name");
  return value != nullptr && value->is_string() ? short_name(value->get_ref<const std::string&>())
                                                : std::string();
}

/// Returns `otherwise` if there is no such member, and nothing if it is not a number from low to high.
std::optional<double> number(const json& object, const char* name, double low, double high,
                             double otherwise) {
  const json* value = member(object, name);
  if (value == nullptr) return otherwise;
  if (!value->is_number()) return std::nullopt;
  const double number = value->get<double>();
  return number >= low && number <= high ? std::optional(number) : std::nullopt;
}

Camera to_camera(const json& definition) {
  const json* type = member(definition, "type");
  if (type != nullptr && *type == "orthographic") throw Flaw{"is orthographic"};
  const json* perspective = member(definition, "perspective");
  if (type == nullptr || *type != "perspective" || perspective == nullptr)
    throw Flaw{"is not a perspective camera"};
  Camera camera;
  camera.name = name_of(definition);
  const std::optional<double> fov = number(*perspective, "yfov", 0, pi, 0);
  if (!fov || *fov <= 0 || *fov >= pi) throw Flaw{"has no yfov between 0 and pi"};
  camera.vertical_fov = *fov;
  return camera;
}

void read_cone(const json& definition, Light& light) {
  // Exporters round pi / 2 to float, upwards.
  constexpr double kWidest = pi / 2, kRounding = 1e-6;
  static const json kNone = json::object();
  const json* spot = member(definition, "spot");
  if (spot == nullptr) spot = &kNone;
  const std::optional<double> inner = number(*spot, "innerConeAngle", 0, kWidest + kRounding, 0),
                              outer = number(*spot, "outerConeAngle", 0, kWidest + kRounding, pi / 4);
  if (!spot->is_object() || !inner || !outer || *outer <= 0 || *inner > *outer + kRounding)
    throw Flaw{"has cone angles that are not 0 <= inner < outer <= pi / 2"};
  light.outer_cone = std::min(*outer, kWidest);
  light.inner_cone = std::min(*inner, light.outer_cone);
}

Light to_light(const json& definition) {
  constexpr double kBrightest = 1e12;
  Light light;
  light.name = name_of(definition);
  const json* type = member(definition, "type");
  if (type != nullptr && *type == "directional")
    light.kind = Light::Kind::directional;
  else if (type != nullptr && *type == "point")
    light.kind = Light::Kind::point;
  else if (type != nullptr && *type == "spot")
    light.kind = Light::Kind::spot;
  else
    throw Flaw{"is neither directional nor point nor spot"};
  if (const json* colour = member(definition, "color")) {
    if (!colour->is_array() || colour->size() != 3) throw Flaw{"has a color that is not three numbers"};
    for (size_t c = 0; c < 3; ++c) {
      const json& value = (*colour)[c];
      const double share = value.is_number() ? value.get<double>() : -1;
      if (!(share >= 0 && share <= kBrightest)) throw Flaw{"has a color that is not three numbers from 0 up"};
      light.colour[c] = static_cast<float>(share);
    }
  }
  const std::optional<double> intensity = number(definition, "intensity", 0, kBrightest, 1);
  if (!intensity) throw Flaw{fmt::format("has an intensity that is not from 0 to {}", kBrightest)};
  light.intensity = *intensity;
  if (light.kind == Light::Kind::spot) read_cone(definition, light);
  return light;
}

/// Resolves a node's reference. `what` is "camera" or "light".
template <class Read>
GltfFixture resolve(size_t node, const json& source, const char* what, const json* index,
                    const json* definitions, Read&& read) {
  const size_t count = definitions != nullptr && definitions->is_array() ? definitions->size() : 0;
  if (index == nullptr || !index->is_number_unsigned() || index->get<uint64_t>() >= count)
    return {node, fmt::format("node {} uses a {} that does not exist; there are {}", node, what, count)};
  const auto number = static_cast<size_t>(index->get<uint64_t>());
  try {
    auto fixture = read((*definitions)[number]);
    if (std::string name = name_of(source); !name.empty()) fixture.name = std::move(name);
    return {node, std::move(fixture)};
  } catch (const Flaw& flaw) {
    return {node, fmt::format("{} {} of node {} {} and was left out", what, number, node, flaw.what)};
  }
}

const json* extension(const json& object) {
  const json* extensions = member(object, "extensions");
  return extensions == nullptr ? nullptr : member(*extensions, "KHR_lights_punctual");
}

}  // namespace

std::vector<GltfFixture> read_fixtures(const json& root) {
  std::vector<GltfFixture> fixtures;
  const json* nodes = member(root, "nodes");
  if (nodes == nullptr || !nodes->is_array()) return fixtures;
  const json* cameras = member(root, "cameras");
  const json* of_lights = extension(root);
  const json* lights = of_lights == nullptr ? nullptr : member(*of_lights, "lights");
  for (size_t i = 0; i < nodes->size(); ++i) {
    const json& node = (*nodes)[i];
    if (const json* camera = member(node, "camera"))
      fixtures.push_back(resolve(i, node, "camera", camera, cameras, to_camera));
    if (const json* light = extension(node))
      fixtures.push_back(resolve(i, node, "light", member(*light, "light"), lights, to_light));
  }
  return fixtures;
}

void FixturePlacer::visit(size_t node, const std::optional<Transform>& world, bool hidden) {
  // Not equal_range(): clang 14 with libstdc++ 12 cannot iterate over its result.
  const auto first = std::ranges::lower_bound(fixtures_, node, {}, &GltfFixture::node);
  for (auto at = first; at != fixtures_.end() && at->node == node; ++at) {
    const GltfFixture& fixture = *at;
    if (const auto* flaw = std::get_if<std::string>(&fixture.what)) {
      note(*flaw);
    } else if (!world) {
      note(fmt::format("node {} is placed at infinity, so its camera and lights were left out", node));
    } else if (const auto* camera = std::get_if<Camera>(&fixture.what)) {
      scene_.cameras.push_back(*camera);
      scene_.cameras.back().transform = *world;
    } else if (!hidden) {
      scene_.lights.push_back(std::get<Light>(fixture.what));
      scene_.lights.back().transform = *world;
    }
  }
}

void FixturePlacer::note(const std::string& sentence) {
  if (++notes_ <= kMostNotes)
    scene_.notes.push_back({NoteKind::fixtures, fmt::format("{}: {}", input_.file.string(), sentence)});
}

void FixturePlacer::report() {
  if (notes_ > kMostNotes)
    scene_.notes.push_back({NoteKind::fixtures, fmt::format("{}: {} more cameras and lights were left out",
                                                            input_.file.string(), notes_ - kMostNotes)});
}

}  // namespace nif::mesh::detail
