// Places glTF lights and cameras by their own transform, then by the object's; those that have no direction
// left are noted and left out. Each file is read once, with the choice of names that its asset was baked
// with.
#include "tools/render/scene_meshes.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>
#include <set>

#include "formats/base/status.hpp"
#include "formats/mesh/read.hpp"
#include "tools/common/baked_scene.hpp"

namespace nif::render {
namespace {

using std::numbers::pi;

/// Transforms a direction, without the translation.
Double3 turned(const mesh::Transform& t, const Double3& v) {
  Double3 out;
  for (size_t row = 0; row < 3; ++row)
    out[row] = t[4 * row] * v[0] + t[4 * row + 1] * v[1] + t[4 * row + 2] * v[2];
  return out;
}

/// The placement of a file's camera or light in the scene: by its own transform, then by the object's.
class Placement {
 public:
  Placement(const mesh::Transform& object, const mesh::Transform& own) : object_(object), own_(own) {}

  /// Returns nothing if it is farther away than a scene file allows.
  std::optional<Double3> position() const {
    constexpr double kFarthest = 1e15;
    Double3 p = turned(object_, {own_[3], own_[7], own_[11]});
    for (size_t a = 0; a < 3; ++a) {
      p[a] += object_[4 * a + 3];
      if (!(std::abs(p[a]) <= kFarthest)) return std::nullopt;
    }
    return p;
  }
  /// Of unit length; nothing if the transforms leave no direction.
  std::optional<Double3> direction(const Double3& own) const {
    const Double3 d = turned(object_, turned(own_, own));
    const double size = length(d);
    if (!(size > 1e-30 && size < 1e100)) return std::nullopt;
    return d * (1 / size);
  }

 private:
  const mesh::Transform& object_;
  const mesh::Transform& own_;
};

/// Returns nothing if the object's transform leaves no viewing direction.
std::optional<View> to_view(const Placement& placement) {
  const auto position = placement.position(), forward = placement.direction({0, 0, -1}),
             up = placement.direction({0, 1, 0});
  if (!position || !forward || !up || !(length(cross(*forward, *up)) > 1e-6)) return std::nullopt;
  return View{*position, *forward, *up};
}

std::optional<Light> to_light(const mesh::Light& light, const Placement& placement) {
  const Colour colour = to_double(light.colour) * light.intensity;
  const auto position = placement.position(), direction = placement.direction({0, 0, -1});
  switch (light.kind) {
    case mesh::Light::Kind::directional:
      if (!direction) return std::nullopt;
      return Sun{*direction * -1, colour, 0};
    case mesh::Light::Kind::point:
      if (!position) return std::nullopt;
      return PointLight{*position, colour};
    default:
      if (!position || !direction) return std::nullopt;
      return SpotLight{*position, *direction, colour, light.inner_cone * 180 / pi,
                       light.outer_cone * 180 / pi};
  }
}

/// Gives cameras of files unique names that are usable as file names.
class Names {
 public:
  explicit Names(const SceneDescription& scene) {
    for (const CameraDescription& camera : scene.cameras) taken_.insert(camera.name);
  }
  std::string make(const std::string& wanted) {
    const std::string name = usable(wanted);
    if (taken_.insert(name).second) return name;
    uint64_t& number = numbers_.try_emplace(name, 1).first->second;
    for (;;) {
      std::string numbered = fmt::format("{}{}", name, ++number);
      if (taken_.insert(numbered).second) return numbered;
    }
  }

 private:
  /// `wanted` is UTF-8 without control characters. Characters that are special in some file system become
  /// '_'.
  static std::string usable(std::string name) {
    constexpr size_t kLongest = 120;  // with the suffix, well below the 255 bytes of file systems
    for (char& c : name)
      if (std::string_view("/\\:*?\"<>|").find(c) != std::string_view::npos) c = '_';
    if (name.size() > kLongest) {
      size_t size = kLongest;
      while (size > 0 && (static_cast<unsigned char>(name[size]) & 0xC0) == 0x80) --size;
      name.resize(size);
    }
    if (name.empty()) return "camera";
    if (name[0] == '.') name[0] = '_';
    return name;
  }

  std::set<std::string> taken_;
  std::map<std::string, uint64_t> numbers_;  // the last number appended to a name
};

void add_lights(SceneDescription& scene, const ObjectDescription& object, const mesh::Scene& file,
                std::vector<std::string>& notes) {
  size_t unusable = 0;
  for (const mesh::Light& light : file.lights) {
    const std::optional<Light> placed = to_light(light, {object.transform, light.transform});
    if (placed)
      scene.lights.push_back(*placed);
    else
      ++unusable;
  }
  if (unusable != 0)
    notes.push_back(fmt::format("{}: left out {} of its lights: they have no direction or are too far away",
                                object.mesh, unusable));
}

void add_cameras(SceneDescription& scene, Names& names, const ObjectDescription& object,
                 const mesh::Scene& file, std::vector<std::string>& notes) {
  size_t unusable = 0;
  for (const mesh::Camera& camera : file.cameras) {
    const std::optional<View> view = to_view({object.transform, camera.transform});
    if (view)
      scene.cameras.push_back({names.make(camera.name), *view, camera.vertical_fov * 180 / pi});
    else
      ++unusable;
  }
  if (unusable != 0)
    notes.push_back(fmt::format("{}: left out {} of its cameras: they have no direction or are too far away",
                                object.mesh, unusable));
}

void complete(SceneDescription& scene, std::vector<std::string>& notes) {
  if (scene.lights.empty()) {
    if (!scene.light_by_default)
      throw Error(Status::malformed_scene,
                  scene.file + ": has no light, and neither do its meshes; add a [[light]]");
    scene.lights.push_back(Sky{});
    notes.push_back(scene.file + ": has no light, so a white sky is used");
  }
  if (scene.cameras.empty()) {
    if (!scene.camera_by_default)
      throw Error(Status::malformed_scene,
                  scene.file + ": has no camera, and neither do its meshes; add a [[camera]]");
    scene.cameras.push_back({.name = "camera1", .where = Orbit{}});
    notes.push_back(scene.file + ": has no camera, so one that looks at the centre is used");
  }
}

}  // namespace

ObjectMeshes read_meshes(SceneDescription& scene, const mesh::AlphaOptions& alpha,
                         std::vector<std::string>& notes, tools::Progress& progress) {
  progress.begin();
  ObjectMeshes meshes;
  struct ReadFile {
    std::string path;
    std::shared_ptr<const mesh::Scene> scene;
    bool skins, moves;
  };
  std::vector<ReadFile> known;
  Names names(scene);
  for (size_t i = 0; i < scene.objects.size(); ++i) {
    const ObjectDescription& object = scene.objects[i];
    mesh::ReadLimits limits;
    limits.alpha = alpha;
    if (object.nif) {
      const mesh::ReadLimits baked = tools::limits_of_asset(*object.nif);
      limits.choice = baked.choice;
      limits.alpha = baked.alpha;
      limits.skins = baked.skins;
      if (object.moment && !baked.skins)
        throw Error(Status::usage,
                    fmt::format("{}: its objects cannot bend; a clip needs an asset baked with --deforms",
                                *object.nif));
    } else {
      limits.moment = object.moment;
    }
    const auto same = std::ranges::find_if(known, [&](const ReadFile& file) {
      return file.path == object.mesh && !limits.moment && !file.moves && file.skins == limits.skins &&
             file.scene->choice == limits.choice && file.scene->alpha == limits.alpha;
    });
    std::shared_ptr<const mesh::Scene> file = same == known.end() ? nullptr : same->scene;
    if (!file) {
      progress.update(double(i) / double(scene.objects.size()), "reading " + object.mesh);
      file = std::make_shared<const mesh::Scene>(mesh::read(object.mesh, limits));
      known.push_back({object.mesh, file, limits.skins, limits.moment.has_value()});
      std::ranges::transform(file->notes, std::back_inserter(notes), &mesh::Note::text);
    }
    if (object.lights) add_lights(scene, object, *file, notes);
    if (object.cameras) add_cameras(scene, names, object, *file, notes);
    meshes.push_back(file);
  }
  complete(scene, notes);
  return meshes;
}

}  // namespace nif::render
