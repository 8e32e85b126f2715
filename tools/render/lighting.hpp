// Samples points and directions on lights, to generate shadow rays.
#pragma once

#include <array>
#include <span>
#include <string>
#include <vector>

#include "tools/render/image_file.hpp"
#include "tools/render/picture_scene.hpp"

namespace nif::render {

/// Two random numbers in [0, 1).
using Pair = std::array<double, 2>;

/// One sample of a light, as seen from a point.
struct LightSample {
  Double3 direction;  ///< towards the light, unit length
  double distance;    ///< to the light; infinite for sun and sky
  /// Irradiance that it adds to a surface facing it, divided by the density of the sample.
  Colour irradiance;
};

/// Samples texels of an environment map in proportion to the light that they send, by a tabulated cumulative
/// distribution of radiant flux, so that the small texels near the poles count less.
class EnvironmentMap {
 public:
  /// Throws as read_environment() does, and Error(not_an_image) if the map is black.
  EnvironmentMap(const std::string& path, int up, double rotation_degrees);
  /// Tabulates a sky with a glow. Its radiance must not be black everywhere.
  EnvironmentMap(const Sky& sky, int up);

  Colour radiance(const Double3& direction) const;
  struct Sample {
    Double3 direction;
    Colour radiance;
    double density;  ///< per steradian
  };
  Sample draw(const Pair& u) const;

 private:
  /// Returns false if it is black.
  bool tabulate();
  /// Direction to the centre of a texel.
  Double3 direction_of(double x, double y) const;

  Image image_;
  int up_;
  double rotation_;
  std::vector<double> rows_;    // [height + 1] cumulative flux of all rows above, 0..1
  std::vector<double> texels_;  // [height][width + 1] the same within each row
};

/// The lights of a scene. Immutable; any number of threads may use it.
class Lighting {
 public:
  /// Also reads environment maps.
  explicit Lighting(const SceneDescription& scene);

  size_t count() const { return lights_.size(); }
  /// One sample of a light, for a surface point with a normal (unit length) on the side that is lit. May come
  /// from below the surface, or carry no light.
  LightSample draw(size_t light, const Double3& point, const Double3& normal, const Pair& u) const;

  /// Sum of all skies; black if there is none.
  Colour background(const Double3& direction) const;
  bool has_sky() const;

 private:
  std::vector<Light> lights_;
  std::vector<std::optional<EnvironmentMap>> maps_;  // [light]; for skies that are not uniform
};

/// The share of its intensity, 0..1, that a spot sends at an angle from its axis, given by the angle's
/// cosine. As KHR_lights_punctual recommends, but without its lower bound on the difference of cosines, which
/// dims narrow cones.
double spot_share(const SpotLight& spot, double cosine);

/// Two unit vectors that form a right-handed frame with a unit vector.
std::array<Double3, 2> tangents(const Double3& normal);
/// A direction about the normal with density cos / pi.
Double3 cosine_direction(const Double3& normal, const Pair& u);

}  // namespace nif::render
