// Describes what to render: objects, lights, cameras and the picture, as a scene file states them. The mesh
// files that it names complete it (scene_meshes.hpp).
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "formats/base/vector.hpp"
#include "formats/mesh/mesh_scene.hpp"

namespace nif::render {

using Colour = Double3;  ///< linear RGB with the primaries of sRGB

/// A mesh file with its placement; if it has an asset, the asset's answers are compared with Embree's.
struct ObjectDescription {
  std::string mesh;                ///< path
  std::optional<std::string> nif;  ///< path of the asset baked from it; none: always answered exactly
  mesh::Transform transform = mesh::kIdentity;
  std::optional<mesh::Moment> moment{};  ///< of an animation of the mesh file
  Colour albedo{0.6, 0.6, 0.6};
  bool mirror = false;  ///< reflects like a mirror, times its albedo, instead of scattering light
  bool lights = true, cameras = true;  ///< whether the lights and cameras of the mesh file are used
  /// Whether one more picture is made with its camera rays answered by the asset's fields for primary rays,
  /// each trained for one view.
  bool primary = false;
};

/// A square perpendicular to the up axis, below the middle of all objects.
struct GroundDescription {
  Colour albedo{0.8, 0.8, 0.8};
  std::optional<double> height;  ///< along the up axis; none: at the lowest point of the objects
  double size = 20;              ///< side length, in diagonals of the objects' box
};

struct Sun {
  Double3 direction;  ///< towards the sun, unit length
  Colour irradiance;  ///< on a surface that faces the sun
  double angle = 0;   ///< angular diameter in degrees; 0: hard shadows
};

enum class Sampling { importance, uniform };

/// A brighter spot in a sky.
struct Glow {
  Double3 direction;  ///< towards its centre, unit length
  Colour radiance;    ///< at the centre; it falls to 1/e at `angle`, as exp(-(distance / angle)^2)
  double angle = 10;  ///< degrees
};

/// Light from all directions: one colour, with or without a glow, or an environment map in latitude and
/// longitude.
struct Sky {
  Colour radiance{1, 1, 1};        ///< multiplied by the map's, if there is one
  std::optional<std::string> map;  ///< path of an .exr or .hdr
  std::optional<Glow> glow;        ///< added to the radiance; not together with a map
  double rotation = 0;             ///< of the map about the up axis, degrees
  Sampling sampling = Sampling::importance;
};

/// A parallelogram that shines in the direction of edge_u x edge_v. Cameras do not see it.
struct AreaLight {
  Double3 corner, edge_u, edge_v;
  Colour radiance;
};

struct PointLight {
  Double3 position;
  Colour intensity;  ///< radiant, per steradian
};

/// A point light that shines into a cone, with a smooth falloff between two angles from the axis.
struct SpotLight {
  Double3 position;
  Double3 direction;        ///< in which it shines, unit length
  Colour intensity;         ///< radiant, per steradian, within the inner angle
  double inner_angle = 0;   ///< degrees from the axis; 0 <= inner <= outer <= 90
  double outer_angle = 45;  ///< no light beyond
};

using Light = std::variant<Sun, Sky, AreaLight, PointLight, SpotLight>;

/// A camera that looks at the centre of the objects.
struct Orbit {
  double azimuth = 30, elevation = 20;  ///< degrees
  double fill = 0.8;                    ///< share of the picture's height that the objects' box takes
};

struct Place {
  Double3 position, target;
};

/// A camera that may roll about its viewing direction.
struct View {
  Double3 position;
  Double3 forward, up;  ///< unit length, not parallel; `up` need not be perpendicular
};

struct CameraDescription {
  std::string name;
  std::variant<Orbit, Place, View> where;
  double fov = 40;  ///< vertical field of view, degrees
};

struct PictureDescription {
  uint32_t width = 960, height = 540;
  uint32_t samples = 16;  ///< rays per pixel, each with one shadow ray for each light
  uint32_t bounces = 0;   ///< diffuse bounces, each with its own shadow rays
  uint64_t seed = 1;
  std::optional<double> exposure;     ///< factor on radiance; none: determined by ground_level
  double ground_level = 0.8;          ///< sRGB value of unshadowed ground in the middle of the scene
  Colour background{0.1, 0.13, 0.2};  ///< linear, as shown, where there is neither an object nor a sky
};

struct SceneDescription {
  std::string file;  ///< for messages
  int up = 1;        ///< axis: 0 x, 1 y, 2 z
  PictureDescription picture;
  std::vector<ObjectDescription> objects;
  std::optional<GroundDescription> ground;
  std::vector<Light> lights;
  std::vector<CameraDescription> cameras;
  /// If neither this nor a mesh file has a light or a camera, use a white sky or an orbit; if false, that is
  /// an error.
  bool light_by_default = false, camera_by_default = false;
};

}  // namespace nif::render
