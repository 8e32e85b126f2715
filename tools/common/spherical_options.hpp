// Options of `nif bake` for `spherical` fields.
#pragma once

#include <optional>
#include <string>

#include "bake/bake.hpp"
#include "tools/common/options.hpp"

namespace nif::tools {

/// The options as given; the paper's values apply to the rest.
struct SphericalArguments {
  std::optional<uint32_t> outer_resolution, outer_features, outer_width, outer_layers, outer_batch;
  std::optional<uint32_t> inner_resolution, inner_features, inner_width, inner_layers, inner_batch;
  std::optional<uint32_t> distance_resolution, distance_features;
  std::optional<uint32_t> primary_resolution, primary_features, primary_width, primary_layers;
  std::optional<float> slope, latent_reach, learning_rate, beta1, beta2, epsilon;
  std::optional<uint64_t> rays;
  std::optional<uint32_t> passes;
  std::optional<std::string> precision, weights, loss;
  bool shared_network = false;
  std::optional<std::string> view;  ///< a scene file; training uses its shadow rays
  std::optional<uint32_t> view_samples;
  bool primary = false;  ///< also learn from its camera rays

  /// Name of an option that was given, or null if there is none.
  const char* first_given() const;
};

void add_spherical_options(Command command, SphericalArguments& arguments);

/// Throws Error(usage) naming the option with an invalid value.
bake::SphericalBakeOptions resolve_spherical(const SphericalArguments& arguments);

}  // namespace nif::tools
