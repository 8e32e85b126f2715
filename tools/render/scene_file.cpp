// One function for each kind of table. Every value has a range, and TomlTable refuses unknown keys. A glTF
// becomes a scene of one object, with a default light and camera.
#include "tools/render/scene_file.hpp"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "formats/base/file_name.hpp"
#include "formats/base/status.hpp"
#include "tools/common/toml_table.hpp"

namespace nif::render {
namespace {

namespace fs = std::filesystem;
using Reader = tools::TomlTable;

constexpr double kBright = 1e12;  ///< upper limit of any light

std::string beside(const fs::path& folder, const std::string& name) { return (folder / name).string(); }

/// scale, then rotate (degrees about x, y and z, in that order), then translate; or a whole matrix.
mesh::Transform read_transform(Reader& reader) {
  if (reader.has("transform")) {
    mesh::Transform t;
    const std::vector<double> values = reader.numbers("transform", 12);
    for (size_t i = 0; i < 12; ++i) t[i] = float(values[i]);
    for (const char* other : {"scale", "rotate", "translate"})
      if (reader.has(other)) reader.fail(other, "cannot be used together with 'transform'");
    return t;
  }
  const Double3 turn = reader.vector("rotate", {0, 0, 0}) * (std::numbers::pi / 180);
  const Double3 move = reader.vector("translate", {0, 0, 0});
  const double scale = reader.number("scale", 1e-12, 1e12, 1);
  Double3 columns[3] = {{scale, 0, 0}, {0, scale, 0}, {0, 0, scale}};
  for (size_t axis = 0; axis < 3; ++axis) {
    const double c = std::cos(turn[axis]), s = std::sin(turn[axis]);
    const size_t a = (axis + 1) % 3, b = (axis + 2) % 3;
    for (Double3& column : columns) {
      const double x = column[a], y = column[b];
      column[a] = c * x - s * y;
      column[b] = s * x + c * y;
    }
  }
  mesh::Transform t;
  for (size_t row = 0; row < 3; ++row) {
    for (size_t k = 0; k < 3; ++k) t[4 * row + k] = float(columns[k][row]);
    t[4 * row + 3] = float(move[row]);
  }
  return t;
}

Light read_light(Reader& reader, const fs::path& folder) {
  const std::string type = reader.text("type");
  if (type == "sun")
    return Sun{reader.unit("direction"), reader.colour("irradiance", kBright, {1, 1, 1}),
               reader.number("angle", 0, 90, 0)};
  if (type == "sky") {
    Sky sky;
    sky.radiance = reader.colour("radiance", kBright, {1, 1, 1});
    if (reader.has("map")) sky.map = beside(folder, reader.text("map"));
    sky.rotation = reader.number("rotation", -360, 360, 0);
    reader.table("glow", [&](Reader& r) {
      sky.glow = Glow{r.unit("direction"), r.colour("radiance", kBright), r.number("angle", 0.5, 180, 10)};
    });
    if (sky.glow && sky.map) reader.fail("glow", "cannot be used together with 'map'");
    const std::string sampling = reader.text("sampling", "importance");
    if (sampling != "importance" && sampling != "uniform")
      reader.fail("sampling", "must be 'importance' or 'uniform'");
    sky.sampling = sampling == "uniform" ? Sampling::uniform : Sampling::importance;
    return sky;
  }
  if (type == "area") {
    AreaLight light{reader.vector("corner"), reader.vector("edge_u"), reader.vector("edge_v"),
                    reader.colour("radiance", kBright)};
    if (!(length(cross(light.edge_u, light.edge_v)) > 0))
      reader.fail("edge_v", "spans no area with 'edge_u'");
    return light;
  }
  if (type == "point") return PointLight{reader.vector("position"), reader.colour("intensity", kBright)};
  if (type == "spot") {
    const SpotLight spot{reader.vector("position"), reader.unit("direction"),
                         reader.colour("intensity", kBright), reader.number("inner_angle", 0, 90, 0),
                         reader.number("outer_angle", 0.01, 90, 45)};
    if (spot.inner_angle > spot.outer_angle) reader.fail("inner_angle", "is larger than 'outer_angle'");
    return spot;
  }
  reader.fail("type", fmt::format("is '{}'; it must be sun, sky, area, point or spot", type));
}

CameraDescription read_camera(Reader& reader, size_t number) {
  CameraDescription camera;
  camera.name = reader.text("name", fmt::format("camera{}", number));
  if (camera.name.find_first_of("/\\") != std::string::npos || camera.name.starts_with('.'))
    reader.fail("name", "must be usable as a file name");
  camera.fov = reader.number("fov", 0.1, 170, 40);
  if (reader.has("position") || reader.has("target")) {
    const Place place{reader.vector("position"), reader.vector("target")};
    if (!(length(place.target - place.position) > 0)) reader.fail("target", "is the camera's own position");
    camera.where = place;
  } else {
    camera.where = Orbit{reader.number("azimuth", -360, 360, 30), reader.number("elevation", -89, 89, 20),
                         reader.number("fill", 0.01, 10, 0.8)};
  }
  return camera;
}

SceneDescription scene_of_mesh(const fs::path& file) {
  SceneDescription scene;
  scene.file = file.string();
  scene.objects.emplace_back().mesh = scene.file;
  scene.light_by_default = scene.camera_by_default = true;
  return scene;
}

}  // namespace

bool is_gltf(const fs::path& file) {
  const std::string ending = ending_of(unpacked_name(file));
  return ending == ".gltf" || ending == ".glb";
}

SceneDescription read_scene(const fs::path& file) {
  if (is_gltf(file)) return scene_of_mesh(file);
  SceneDescription scene;
  scene.file = file.string();
  const toml::table root = tools::read_toml(scene.file, Status::malformed_scene);
  const fs::path folder = file.parent_path();
  Reader reader(scene.file, "", root, Status::malformed_scene);

  const std::string up = reader.text("up", "y");
  if (up.size() != 1 || up < "x" || up > "z") reader.fail("up", "must be 'x', 'y' or 'z'");
  scene.up = up[0] - 'x';
  reader.table("picture", [&](Reader& r) {
    PictureDescription& picture = scene.picture;
    picture.width = uint32_t(r.whole("width", 1, kMaxPictureSide, picture.width));
    picture.height = uint32_t(r.whole("height", 1, kMaxPictureSide, picture.height));
    picture.samples = uint32_t(r.whole("samples", 1, kMaxPictureSamples, picture.samples));
    picture.bounces = uint32_t(r.whole("bounces", 0, kMaxBounces, picture.bounces));
    picture.seed = r.whole("seed", 0, uint64_t(1) << 62, picture.seed);
    if (r.has("exposure")) picture.exposure = r.number("exposure", 1e-12, 1e12);
    picture.ground_level = r.number("ground_level", 0.01, 1, picture.ground_level);
    picture.background = r.colour("background", 1, picture.background);
  });
  reader.tables("object", [&](Reader& r) {
    ObjectDescription object;
    object.mesh = beside(folder, r.text("mesh"));
    if (r.has("nif")) object.nif = beside(folder, r.text("nif"));
    object.primary = r.flag("primary", object.primary);
    if (object.primary && !object.nif)
      r.fail("primary", "needs 'nif', an asset with fields for primary rays");
    if (r.has("clip")) object.moment = {r.text("clip"), r.number("time", -1e9, 1e9, 0)};
    if (r.has("time") && !object.moment) r.fail("time", "is a moment of 'clip', which is missing");
    object.transform = read_transform(r);
    object.albedo = r.colour("albedo", 1, object.albedo);
    object.mirror = r.flag("mirror", object.mirror);
    object.lights = r.flag("lights", object.lights);
    object.cameras = r.flag("cameras", object.cameras);
    scene.objects.push_back(std::move(object));
  });
  reader.table("ground", [&](Reader& r) {
    GroundDescription ground;
    ground.albedo = r.colour("albedo", 1, ground.albedo);
    if (r.has("height")) ground.height = r.number("height", -1e15, 1e15);
    ground.size = r.number("size", 0.001, 1e6, ground.size);
    scene.ground = ground;
  });
  reader.tables("light", [&](Reader& r) { scene.lights.push_back(read_light(r, folder)); });
  std::set<std::string> names;
  reader.tables("camera", [&](Reader& r) {
    scene.cameras.push_back(read_camera(r, scene.cameras.size() + 1));
    if (!names.insert(scene.cameras.back().name).second) r.fail("name", "is used by another camera, too");
  });
  reader.finish();
  if (scene.objects.empty())
    throw Error(Status::malformed_scene, scene.file + ": has no object; add an [[object]] with a mesh");
  return scene;
}

}  // namespace nif::render
