// Checks every option before training starts: what kernels can compute with, and what fills SIMD lanes. The
// error names the wrong option.
#include "bake/spherical/spherical_field_options.hpp"

#include <fmt/format.h>

#include "kernels/reference/spherical/spherical_field.hpp"

namespace nif::bake {

void check(const SphericalOptions& options) {
  const auto within = [](uint32_t value, uint32_t low, uint32_t high, const char* option) {
    if (value < low || value > high)
      throw InvalidOption(option, fmt::format("{} is not in the range {} to {}", value, low, high));
  };
  const auto fits_lanes = [](uint32_t value, uint32_t unit, const char* option) {
    if (value % unit != 0)
      throw InvalidOption(option, fmt::format("{} is not a multiple of {}", value, unit));
  };
  using namespace kernels;
  const SphericalOptions::Outer &outer = options.outer, &primary = options.primary;
  const SphericalOptions::Inner& inner = options.inner;
  within(outer.resolution, 2, kMaxSphericalResolution, "outer.resolution");
  within(outer.features, 1, kMaxSphericalFeatures, "outer.features");
  within(outer.width, 4, kMaxSphericalWidth, "outer.width");
  fits_lanes(outer.width, 4, "outer.width");
  within(outer.hidden_layers, 1, kMaxSphericalLayers, "outer.layers");
  within(inner.resolution, 2, kMaxSphericalResolution, "inner.resolution");
  within(inner.features, 1, kMaxSphericalFeatures, "inner.features");
  within(inner.distance_resolution, 2, kMaxSphericalResolution, "inner.distance_resolution");
  within(inner.distance_features, 1, kMaxSphericalFeatures, "inner.distance_features");
  within(inner.width, 4, kMaxSphericalWidth, "inner.width");
  fits_lanes(inner.width, 4, "inner.width");
  within(inner.hidden_layers, 1, kMaxSphericalLayers, "inner.layers");
  within(primary.resolution, 2, kMaxSphericalResolution, "primary.resolution");
  within(primary.features, 1, kMaxSphericalFeatures, "primary.features");
  within(primary.width, 4, kMaxSphericalWidth, "primary.width");
  fits_lanes(primary.width, 4, "primary.width");
  within(primary.hidden_layers, 1, kMaxSphericalLayers, "primary.layers");
  for (const auto& [batch, name] : {std::pair{outer.batch, "outer.batch"}, {inner.batch, "inner.batch"}}) {
    within(batch, kSphericalBatchUnit, 1 << 20, name);
    fits_lanes(batch, kSphericalBatchUnit, name);
  }
  const auto above_0 = [](float value, float most, const char* option) {
    if (!(value > 0 && value <= most))
      throw InvalidOption(option, fmt::format("{} is not above 0 and at most {}", value, most));
  };
  const auto below_1 = [](float value, const char* option) {
    if (!(value >= 0 && value < 1))
      throw InvalidOption(option, fmt::format("{} is not from 0 to below 1", value));
  };
  below_1(options.slope, "slope");
  above_0(options.latent_reach, 1, "latent_reach");
  above_0(options.learning_rate, 1, "learning_rate");
  below_1(options.beta1, "beta1");
  below_1(options.beta2, "beta2");
  above_0(options.epsilon, 1, "epsilon");
}

}  // namespace nif::bake
