#include "tools/spherical_options.hpp"

#include <fmt/format.h>

#include <array>

#include "formats/status.hpp"

namespace nif::tools {
namespace {

using bake::SphericalOptions;

/// One option that is a number: where it is kept as given, and where it goes.
struct NumberOption {
  const char* name;
  const char* text;
  std::optional<uint32_t> SphericalArguments::*given;
  uint32_t& (*member)(SphericalOptions&);
};

constexpr std::array kNumbers{
    NumberOption{"--outer-resolution", "Latent vectors along an axis of a grid for rays from outside the box",
                 &SphericalArguments::outer_resolution,
                 [](SphericalOptions& o) -> uint32_t& { return o.outer.resolution; }},
    NumberOption{"--outer-features", "Floats of each of them", &SphericalArguments::outer_features,
                 [](SphericalOptions& o) -> uint32_t& { return o.outer.features; }},
    NumberOption{"--outer-width", "Neurons of a hidden layer of their network",
                 &SphericalArguments::outer_width,
                 [](SphericalOptions& o) -> uint32_t& { return o.outer.width; }},
    NumberOption{"--outer-layers", "Hidden layers of it", &SphericalArguments::outer_layers,
                 [](SphericalOptions& o) -> uint32_t& { return o.outer.hidden_layers; }},
    NumberOption{"--outer-batch", "Rays of a training step of it", &SphericalArguments::outer_batch,
                 [](SphericalOptions& o) -> uint32_t& { return o.outer.batch; }},
    NumberOption{"--inner-resolution", "The same of the grids over angles for rays from within the box",
                 &SphericalArguments::inner_resolution,
                 [](SphericalOptions& o) -> uint32_t& { return o.inner.resolution; }},
    NumberOption{"--inner-features", "Floats of each of their latent vectors",
                 &SphericalArguments::inner_features,
                 [](SphericalOptions& o) -> uint32_t& { return o.inner.features; }},
    NumberOption{"--distance-resolution", "Latent vectors of the grid over the distance from the centre",
                 &SphericalArguments::distance_resolution,
                 [](SphericalOptions& o) -> uint32_t& { return o.inner.distance_resolution; }},
    NumberOption{"--distance-features", "Floats of each of them", &SphericalArguments::distance_features,
                 [](SphericalOptions& o) -> uint32_t& { return o.inner.distance_features; }},
    NumberOption{"--inner-width", "Neurons of a hidden layer of their network",
                 &SphericalArguments::inner_width,
                 [](SphericalOptions& o) -> uint32_t& { return o.inner.width; }},
    NumberOption{"--inner-layers", "Hidden layers of it", &SphericalArguments::inner_layers,
                 [](SphericalOptions& o) -> uint32_t& { return o.inner.hidden_layers; }},
    NumberOption{"--inner-batch", "Rays of a training step of it", &SphericalArguments::inner_batch,
                 [](SphericalOptions& o) -> uint32_t& { return o.inner.batch; }}};

}  // namespace

const char* SphericalArguments::first_given() const {
  for (const NumberOption& option : kNumbers)
    if (this->*option.given) return option.name;
  if (precision) return "--precision";
  if (learning_rate) return "--learning-rate";
  if (view) return "--view";
  if (view_samples) return "--view-samples";
  return shared_network ? "--shared-network" : nullptr;
}

void add_spherical_options(CLI::App& command, SphericalArguments& arguments) {
  constexpr const char* kGroup = "Options of --encoding spherical";
  SphericalOptions defaults;
  for (const NumberOption& option : kNumbers)
    command.add_option(option.name, arguments.*option.given, option.text)
        ->default_str(std::to_string(option.member(defaults)))
        ->group(kGroup);
  command
      .add_option(
          "--precision", arguments.precision,
          "half or single: how grids and networks are stored. By default grids in half and networks in "
          "single, as in the paper's bytes")
      ->group(kGroup);
  command.add_option("--learning-rate", arguments.learning_rate, "Of Adam, constant")
      ->default_str(fmt::format("{}", defaults.learning_rate))
      ->group(kGroup);
  command
      .add_option(
          "--view", arguments.view,
          "A scene for nif render that has the mesh among its objects: learn from the shadow rays of its "
          "cameras, as the paper does, in place of --mix")
      ->group(kGroup);
  command
      .add_option("--view-samples", arguments.view_samples,
                  "Rays through each pixel for that, in place of the scene's")
      ->check(CLI::Range(1u, 65536u))
      ->group(kGroup);
  command
      .add_flag("--shared-network", arguments.shared_network,
                "One pair of networks for all objects, with grids for each")
      ->group(kGroup);
}

bake::SphericalBakeOptions resolve_spherical(const SphericalArguments& arguments) {
  bake::SphericalBakeOptions options;
  for (const NumberOption& option : kNumbers)
    if (const auto& given = arguments.*option.given) option.member(options.fields) = *given;
  if (arguments.precision) {
    if (arguments.precision != "half" && arguments.precision != "single")
      throw Error(Status::usage,
                  fmt::format("--precision '{}' is neither half nor single", *arguments.precision));
    options.fields.half_grids = options.fields.half_networks = arguments.precision == "half";
  }
  if (arguments.learning_rate) options.fields.learning_rate = *arguments.learning_rate;
  options.shared_network = arguments.shared_network;
  if (arguments.view_samples && !arguments.view)
    throw Error(Status::usage,
                "--view-samples says how often the pixels of --view are sampled, and there is none");
  bake::check(options.fields);
  return options;
}

}  // namespace nif::tools
