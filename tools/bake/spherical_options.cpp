#include "tools/bake/spherical_options.hpp"

#include <fmt/format.h>

#include <array>

#include "formats/base/status.hpp"

namespace nif::tools {
namespace {

using bake::SphericalBakeOptions;

/// One option that is a number: where it is kept as given, and where it goes.
template <class Value>
struct NumberOption {
  const char* name;
  const char* text;
  std::optional<Value> SphericalArguments::*given;
  Value& (*member)(SphericalBakeOptions&);
};
using CountOption = NumberOption<uint32_t>;
using RealOption = NumberOption<float>;

constexpr std::array kCounts{
    CountOption{"--outer-resolution", "Latent vectors along an axis of a grid for rays from outside the box",
                &SphericalArguments::outer_resolution,
                [](SphericalBakeOptions& o) -> uint32_t& { return o.fields.outer.resolution; }},
    CountOption{"--outer-features", "Floats of each of them", &SphericalArguments::outer_features,
                [](SphericalBakeOptions& o) -> uint32_t& { return o.fields.outer.features; }},
    CountOption{"--outer-width", "Neurons of a hidden layer of their network",
                &SphericalArguments::outer_width,
                [](SphericalBakeOptions& o) -> uint32_t& { return o.fields.outer.width; }},
    CountOption{"--outer-layers", "Hidden layers of it", &SphericalArguments::outer_layers,
                [](SphericalBakeOptions& o) -> uint32_t& { return o.fields.outer.hidden_layers; }},
    CountOption{"--outer-batch", "Rays of a training step of it", &SphericalArguments::outer_batch,
                [](SphericalBakeOptions& o) -> uint32_t& { return o.fields.outer.batch; }},
    CountOption{"--inner-resolution", "The same of the grids over angles for rays from within the box",
                &SphericalArguments::inner_resolution,
                [](SphericalBakeOptions& o) -> uint32_t& { return o.fields.inner.resolution; }},
    CountOption{"--inner-features", "Floats of each of their latent vectors",
                &SphericalArguments::inner_features,
                [](SphericalBakeOptions& o) -> uint32_t& { return o.fields.inner.features; }},
    CountOption{"--distance-resolution", "Latent vectors of the grid over the distance from the centre",
                &SphericalArguments::distance_resolution,
                [](SphericalBakeOptions& o) -> uint32_t& { return o.fields.inner.distance_resolution; }},
    CountOption{"--distance-features", "Floats of each of them", &SphericalArguments::distance_features,
                [](SphericalBakeOptions& o) -> uint32_t& { return o.fields.inner.distance_features; }},
    CountOption{"--inner-width", "Neurons of a hidden layer of their network",
                &SphericalArguments::inner_width,
                [](SphericalBakeOptions& o) -> uint32_t& { return o.fields.inner.width; }},
    CountOption{"--inner-layers", "Hidden layers of it", &SphericalArguments::inner_layers,
                [](SphericalBakeOptions& o) -> uint32_t& { return o.fields.inner.hidden_layers; }},
    CountOption{"--inner-batch", "Rays of a training step of it", &SphericalArguments::inner_batch,
                [](SphericalBakeOptions& o) -> uint32_t& { return o.fields.inner.batch; }},
    CountOption{"--primary-resolution", "Latent vectors along an axis of a grid for primary rays",
                &SphericalArguments::primary_resolution,
                [](SphericalBakeOptions& o) -> uint32_t& { return o.fields.primary.resolution; }},
    CountOption{"--primary-features", "Floats of each of them", &SphericalArguments::primary_features,
                [](SphericalBakeOptions& o) -> uint32_t& { return o.fields.primary.features; }},
    CountOption{"--primary-width", "Neurons of a hidden layer of their network",
                &SphericalArguments::primary_width,
                [](SphericalBakeOptions& o) -> uint32_t& { return o.fields.primary.width; }},
    CountOption{"--primary-layers", "Hidden layers of it", &SphericalArguments::primary_layers,
                [](SphericalBakeOptions& o) -> uint32_t& { return o.fields.primary.hidden_layers; }},
    CountOption{"--training-passes", "Times that each ray of --mix is learned from",
                &SphericalArguments::passes, [](SphericalBakeOptions& o) -> uint32_t& { return o.passes; }}};

constexpr std::array kReals{
    RealOption{"--leaky-slope", "Slope of the leaky ReLU below 0", &SphericalArguments::slope,
               [](SphericalBakeOptions& o) -> float& { return o.fields.slope; }},
    RealOption{"--latent-reach", "Latent vectors start uniform between minus and plus this",
               &SphericalArguments::latent_reach,
               [](SphericalBakeOptions& o) -> float& { return o.fields.latent_reach; }},
    RealOption{"--learning-rate", "Of Adam, constant", &SphericalArguments::learning_rate,
               [](SphericalBakeOptions& o) -> float& { return o.fields.learning_rate; }},
    RealOption{"--adam-beta1", "Decay of its first moment", &SphericalArguments::beta1,
               [](SphericalBakeOptions& o) -> float& { return o.fields.beta1; }},
    RealOption{"--adam-beta2", "Decay of its second moment", &SphericalArguments::beta2,
               [](SphericalBakeOptions& o) -> float& { return o.fields.beta2; }},
    RealOption{"--adam-epsilon", "What is added to its divisor", &SphericalArguments::epsilon,
               [](SphericalBakeOptions& o) -> float& { return o.fields.epsilon; }}};

/// Calls `visit` with each of them.
template <class Visit>
void for_each_number(Visit&& visit) {
  for (const CountOption& option : kCounts) visit(option);
  for (const RealOption& option : kReals) visit(option);
}

/// Is the option's text the second of two words? False where it was not given. Throws Error(usage) where it
/// is neither.
bool is_second(const std::optional<std::string>& text, const char* option, const char* first,
               const char* second) {
  if (!text || *text == first) return false;
  if (*text != second)
    throw Error(Status::usage, fmt::format("{} '{}' is neither {} nor {}", option, *text, first, second));
  return true;
}

}  // namespace

const char* SphericalArguments::first_given() const {
  const char* first = nullptr;
  for_each_number([&](const auto& option) {
    if (!first && this->*option.given) first = option.name;
  });
  if (first) return first;
  if (rays) return "--training-rays";
  if (precision) return "--precision";
  if (weights) return "--weights";
  if (loss) return "--loss";
  if (view) return "--view";
  if (view_samples) return "--view-samples";
  if (primary) return "--primary";
  return shared_network ? "--shared-network" : nullptr;
}

void add_spherical_options(Command command, SphericalArguments& arguments) {
  constexpr const char* kGroup = "Options of --encoding spherical";
  SphericalBakeOptions defaults;
  for_each_number([&](const auto& option) {
    command.add_option(option.name, arguments.*option.given, option.text)
        .default_str(fmt::format("{}", option.member(defaults)))
        .group(kGroup);
  });
  command
      .add_option("--training-rays", arguments.rays,
                  "Rays of --mix for an object of 150,000 triangles or more; fewer for smaller ones")
      .default_str(std::to_string(defaults.rays))
      .group(kGroup);
  command.add_option("--weights", arguments.weights, "xavier or he: how the networks' weights start")
      .default_str("xavier")
      .group(kGroup);
  command.add_option("--loss", arguments.loss, "l2 or cross-entropy: of the probability of being visible")
      .default_str("l2")
      .group(kGroup);
  command
      .add_option(
          "--precision", arguments.precision,
          "half or single: how grids and networks are stored. By default grids in half and networks in "
          "single, as in the paper's bytes")
      .group(kGroup);
  command
      .add_option(
          "--view", arguments.view,
          "A scene for nif render that has the mesh among its objects: learn from the shadow rays of its "
          "cameras, as the paper does, in place of --mix")
      .group(kGroup);
  command
      .add_option("--view-samples", arguments.view_samples,
                  "Rays through each pixel for that, in place of the scene's")
      .range(1u, 65536u)
      .group(kGroup);
  command
      .add_flag(
          "--primary", arguments.primary,
          "Learn a field for the rays of these cameras, too: hit or miss, depth and normal, for nif render")
      .group(kGroup);
  command
      .add_flag("--shared-network", arguments.shared_network,
                "One pair of networks for all objects, with grids for each; networks for primary rays stay "
                "each object's own")
      .group(kGroup);
}

bake::SphericalBakeOptions resolve_spherical(const SphericalArguments& arguments) {
  SphericalBakeOptions options;
  for_each_number([&](const auto& option) {
    if (const auto& given = arguments.*option.given) option.member(options) = *given;
  });
  if (arguments.precision)
    options.fields.half_grids = options.fields.half_networks =
        !is_second(arguments.precision, "--precision", "half", "single");
  options.fields.he_weights = is_second(arguments.weights, "--weights", "xavier", "he");
  if (is_second(arguments.loss, "--loss", "l2", "cross-entropy"))
    options.fields.loss = bake::SphericalLoss::cross_entropy;
  if (arguments.rays) options.rays = *arguments.rays;
  options.shared_network = arguments.shared_network;
  if (arguments.view_samples && !arguments.view)
    throw Error(Status::usage,
                "--view-samples says how often the pixels of --view are sampled, and there is none");
  if (arguments.primary && !arguments.view)
    throw Error(Status::usage, "--primary learns from the cameras of --view, and there is none");
  if (!arguments.primary)
    for (const CountOption& option : kCounts)
      if (arguments.*option.given && std::string_view(option.name).starts_with("--primary-"))
        throw Error(Status::usage,
                    fmt::format("{} shapes the field of --primary, and that is not asked for", option.name));
  for (const auto& [given, name] : {std::pair{arguments.rays.has_value(), "--training-rays"},
                                    {arguments.passes.has_value(), "--training-passes"}})
    if (given && arguments.view)
      throw Error(
          Status::usage,
          fmt::format("{} is for rays of --mix; --view has --view-samples, each learned from once", name));
  if (options.rays == 0 || options.passes == 0)
    throw Error(Status::usage, "--training-rays and --training-passes cannot be 0: nothing would be learned");
  bake::check(options.fields);
  return options;
}

}  // namespace nif::tools
