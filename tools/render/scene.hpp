// What to render: objects, lights, cameras and the picture, as a scene file describes them. The mesh files
// that it names complete it (scene_meshes.hpp).
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "formats/base/vector.hpp"
#include "formats/mesh/scene.hpp"

namespace nif::render {

using Colour = Double3;  ///< linear RGB with the primaries of sRGB

/// A mesh file, placed; with an asset, what that says stands beside Embree's answers.
struct ObjectDescription {
  std::string mesh;                ///< path
  std::optional<std::string> nif;  ///< path of the asset baked from it; none: always answered exactly
  mesh::Transform transform = mesh::kIdentity;
  Colour albedo{0.6, 0.6, 0.6};
  bool mirror = false;  ///< reflects as a mirror, times its albedo, instead of scattering light
  bool lights = true, cameras = true;  ///< whether those that the mesh file brings are taken along
  /// Whether its camera rays are answered by the asset's fields for primary rays, each made for one view, in
  /// one more picture.
  bool primary = false;
};

/// A square that lies across the up axis, below the middle of all objects.
struct GroundDescription {
  Colour albedo{0.8, 0.8, 0.8};
  std::optional<double> height;  ///< along the up axis; none: the lowest point of the objects
  double size = 20;              ///< its side, in diagonals of the objects' box
};

struct Sun {
  Double3 direction;  ///< towards it, unit length
  Colour irradiance;  ///< on a surface that faces it
  double angle = 0;   ///< its diameter in degrees; 0: hard shadows
};

enum class Sampling { importance, uniform };

/// What makes one side of a sky brighter.
struct Glow {
  Double3 direction;  ///< of its middle, unit length
  Colour radiance;    ///< there; it falls to 1/e at `angle`, as exp(-(distance / angle)^2)
  double angle = 10;  ///< degrees
};

/// Light from all sides: one colour, with a glow or without, or an environment map in latitude and longitude.
struct Sky {
  Colour radiance{1, 1, 1};        ///< times the map's, where there is one
  std::optional<std::string> map;  ///< path of an .exr or .hdr
  std::optional<Glow> glow;        ///< added to the radiance; not with a map
  double rotation = 0;             ///< of the map about the up axis, degrees
  Sampling sampling = Sampling::importance;
};

/// A parallelogram that shines to the side that edge_u x edge_v points to. Cameras do not see it.
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
  Double3 direction;        ///< that it shines in, unit length
  Colour intensity;         ///< radiant, per steradian, within the inner angle
  double inner_angle = 0;   ///< degrees from the axis; 0 <= inner <= outer <= 90
  double outer_angle = 45;  ///< there is no light beyond
};

using Light = std::variant<Sun, Sky, AreaLight, PointLight, SpotLight>;

/// A camera that looks at the middle of the objects.
struct Orbit {
  double azimuth = 30, elevation = 20;  ///< degrees
  double fill = 0.8;                    ///< of the picture's height that the objects' box takes, as seen
};

struct Place {
  Double3 position, target;
};

/// A camera that may roll about its line of sight.
struct View {
  Double3 position;
  Double3 forward, up;  ///< unit length, not parallel; `up` need not be at a right angle
};

struct CameraDescription {
  std::string name;
  std::variant<Orbit, Place, View> where;
  double fov = 40;  ///< from the bottom of the picture to its top, degrees
};

struct PictureDescription {
  uint32_t width = 960, height = 540;
  uint32_t samples = 16;  ///< rays through each pixel, each with one shadow ray for each light
  uint32_t bounces = 0;   ///< of diffuse light, each with shadow rays of its own
  uint64_t seed = 1;
  std::optional<double> exposure;     ///< factor on radiance; none: by ground_level
  double ground_level = 0.8;          ///< sRGB value of unshadowed ground in the middle of the scene
  Colour background{0.1, 0.13, 0.2};  ///< linear, as shown, where there is neither object nor sky
};

struct SceneDescription {
  std::string file;  ///< for messages
  int up = 1;        ///< axis: 0 x, 1 y, 2 z
  PictureDescription picture;
  std::vector<ObjectDescription> objects;
  std::optional<GroundDescription> ground;
  std::vector<Light> lights;
  std::vector<CameraDescription> cameras;
  /// Where neither this nor a mesh file has a light or a camera, there is a white sky or an orbit; else that
  /// is a mistake.
  bool light_by_default = false, camera_by_default = false;
};

}  // namespace nif::render
