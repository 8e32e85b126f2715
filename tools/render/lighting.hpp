// Samples points and directions on lights, for shadow rays.
#pragma once

#include <array>
#include <span>
#include <string>
#include <vector>

#include "tools/render/image.hpp"
#include "tools/render/scene.hpp"

namespace nif::render {

/// Two numbers in [0, 1).
using Pair = std::array<double, 2>;

/// Where light comes from, as seen from one point: one sample.
struct LightSample {
  Double3 direction;  ///< towards the light, unit length
  double distance;    ///< to the light; infinite for sun and sky
  /// What it adds to the irradiance of a surface that faces it, over the density that it was drawn with.
  Colour irradiance;
};

/// Samples texels of an environment map in proportion to the light that they send, by a tabulated cumulative
/// distribution: radiant flux, so that texels near the poles, which are small, count less.
class EnvironmentMap {
 public:
  /// Throws as read_environment(), and Error(not_an_image) where it is black.
  EnvironmentMap(const std::string& path, int up, double rotation_degrees);
  /// Tabulates a sky with a glow, whose radiance must not be black as a whole.
  EnvironmentMap(const Sky& sky, int up);

  Colour radiance(const Double3& direction) const;
  struct Sample {
    Double3 direction;
    Colour radiance;
    double density;  ///< per steradian
  };
  Sample draw(const Pair& u) const;

 private:
  /// False where it is black.
  bool tabulate();
  /// Where the middle of a texel is.
  Double3 direction_of(double x, double y) const;

  Image image_;
  int up_;
  double rotation_;
  std::vector<double> rows_;    // [height + 1] cumulative flux of all rows above, 0..1
  std::vector<double> texels_;  // [height][width + 1] the same within each row
};

/// The lights of a scene. Immutable; any number of threads may ask it.
class Lighting {
 public:
  /// Reads environment maps.
  explicit Lighting(const SceneDescription& scene);

  size_t count() const { return lights_.size(); }
  /// One sample of a light, for a surface point with its normal (unit length) on the side that is lit. May
  /// come from below the surface, or carry nothing.
  LightSample draw(size_t light, const Double3& point, const Double3& normal, const Pair& u) const;

  /// Of all skies together; black where there is none.
  Colour background(const Double3& direction) const;
  bool has_sky() const;

 private:
  std::vector<Light> lights_;
  std::vector<std::optional<EnvironmentMap>> maps_;  // [light]; of skies that are not the same all over
};

/// The share of its intensity, 0..1, that a spot sends at an angle from its axis, given by its cosine: as
/// KHR_lights_punctual recommends, but without the least difference of cosines there, which dims narrow
/// cones.
double spot_share(const SpotLight& spot, double cosine);

/// Two unit vectors that make a right-handed frame with a unit vector.
std::array<Double3, 2> tangents(const Double3& normal);
/// A direction about the normal with a density of cos / pi.
Double3 cosine_direction(const Double3& normal, const Pair& u);

}  // namespace nif::render
