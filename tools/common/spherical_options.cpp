// Two tables of the paper's hyperparameters, one of counts and one of reals: each row ties an option to the
// field that it sets. After them come the rules about which options need which.
#include "tools/common/spherical_options.hpp"

#include <fmt/format.h>

#include <array>

#include "formats/base/status.hpp"

namespace nif::tools {
namespace {

using bake::SphericalBakeOptions;

/// A numeric option: where its given value is kept, and where it goes.
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
    CountOption{"--outer-resolution",
                "Latent vectors along each axis of the grids for rays from outside the box",
                &SphericalArguments::outer_resolution,
                [](SphericalBakeOptions& o) -> uint32_t& { return o.fields.outer.resolution; }},
    CountOption{"--outer-features", "Floats per latent vector", &SphericalArguments::outer_features,
                [](SphericalBakeOptions& o) -> uint32_t& { return o.fields.outer.features; }},
    CountOption{"--outer-width", "Neurons per hidden layer of the network for these rays",
                &SphericalArguments::outer_width,
                [](SphericalBakeOptions& o) -> uint32_t& { return o.fields.outer.width; }},
    CountOption{"--outer-layers", "Hidden layers of that network", &SphericalArguments::outer_layers,
                [](SphericalBakeOptions& o) -> uint32_t& { return o.fields.outer.hidden_layers; }},
    CountOption{"--outer-batch", "Rays per training step of that network", &SphericalArguments::outer_batch,
                [](SphericalBakeOptions& o) -> uint32_t& { return o.fields.outer.batch; }},
    CountOption{"--inner-resolution",
                "Latent vectors along each axis of the grids over angles, for rays from inside the box",
                &SphericalArguments::inner_resolution,
                [](SphericalBakeOptions& o) -> uint32_t& { return o.fields.inner.resolution; }},
    CountOption{"--inner-features", "Floats per latent vector", &SphericalArguments::inner_features,
                [](SphericalBakeOptions& o) -> uint32_t& { return o.fields.inner.features; }},
    CountOption{"--distance-resolution",
                "Latent vectors of the grid over the distance from the centre, for the same rays",
                &SphericalArguments::distance_resolution,
                [](SphericalBakeOptions& o) -> uint32_t& { return o.fields.inner.distance_resolution; }},
    CountOption{"--distance-features", "Floats per latent vector", &SphericalArguments::distance_features,
                [](SphericalBakeOptions& o) -> uint32_t& { return o.fields.inner.distance_features; }},
    CountOption{"--inner-width", "Neurons per hidden layer of the network for these rays",
                &SphericalArguments::inner_width,
                [](SphericalBakeOptions& o) -> uint32_t& { return o.fields.inner.width; }},
    CountOption{"--inner-layers", "Hidden layers of that network", &SphericalArguments::inner_layers,
                [](SphericalBakeOptions& o) -> uint32_t& { return o.fields.inner.hidden_layers; }},
    CountOption{"--inner-batch", "Rays per training step of that network", &SphericalArguments::inner_batch,
                [](SphericalBakeOptions& o) -> uint32_t& { return o.fields.inner.batch; }},
    CountOption{"--primary-resolution", "Latent vectors along each axis of the grids for primary rays",
                &SphericalArguments::primary_resolution,
                [](SphericalBakeOptions& o) -> uint32_t& { return o.fields.primary.resolution; }},
    CountOption{"--primary-features", "Floats per latent vector", &SphericalArguments::primary_features,
                [](SphericalBakeOptions& o) -> uint32_t& { return o.fields.primary.features; }},
    CountOption{"--primary-width", "Neurons per hidden layer of the network for these rays",
                &SphericalArguments::primary_width,
                [](SphericalBakeOptions& o) -> uint32_t& { return o.fields.primary.width; }},
    CountOption{"--primary-layers", "Hidden layers of that network", &SphericalArguments::primary_layers,
                [](SphericalBakeOptions& o) -> uint32_t& { return o.fields.primary.hidden_layers; }},
    CountOption{"--training-passes", "How often training uses each ray of --mix", &SphericalArguments::passes,
                [](SphericalBakeOptions& o) -> uint32_t& { return o.passes; }}};

constexpr std::array kReals{
    RealOption{"--leaky-slope", "Slope of the leaky ReLU below 0", &SphericalArguments::slope,
               [](SphericalBakeOptions& o) -> float& { return o.fields.slope; }},
    RealOption{"--latent-reach",
               "Latent vectors start with uniform random values between minus and plus this",
               &SphericalArguments::latent_reach,
               [](SphericalBakeOptions& o) -> float& { return o.fields.latent_reach; }},
    RealOption{"--learning-rate", "Learning rate of Adam (constant)", &SphericalArguments::learning_rate,
               [](SphericalBakeOptions& o) -> float& { return o.fields.learning_rate; }},
    RealOption{"--adam-beta1", "Decay of Adam's first moment", &SphericalArguments::beta1,
               [](SphericalBakeOptions& o) -> float& { return o.fields.beta1; }},
    RealOption{"--adam-beta2", "Decay of Adam's second moment", &SphericalArguments::beta2,
               [](SphericalBakeOptions& o) -> float& { return o.fields.beta2; }},
    RealOption{"--adam-epsilon", "Epsilon of Adam, added to the divisor", &SphericalArguments::epsilon,
               [](SphericalBakeOptions& o) -> float& { return o.fields.epsilon; }}};

/// Calls `visit` with each numeric option.
template <class Visit>
void for_each_number(Visit&& visit) {
  for (const CountOption& option : kCounts) visit(option);
  for (const RealOption& option : kReals) visit(option);
}

/// Whether the option's value is the second of two words. Returns false if it was not given, and throws
/// Error(usage) if the value is neither.
bool is_second(const std::optional<std::string>& text, const char* option, const char* first,
               const char* second) {
  if (!text || *text == first) return false;
  if (*text != second)
    throw Error(Status::usage, fmt::format("{} '{}' is neither {} nor {}", option, *text, first, second));
  return true;
}

/// The option that sets what the baker calls `member`.
std::string option_of(const std::string& member) {
  constexpr std::pair<std::string_view, std::string_view> kOthers[] = {
      {"inner.distance_resolution", "--distance-resolution"},
      {"inner.distance_features", "--distance-features"},
      {"slope", "--leaky-slope"},
      {"beta1", "--adam-beta1"},
      {"beta2", "--adam-beta2"},
      {"epsilon", "--adam-epsilon"}};
  for (const auto& [other, option] : kOthers)
    if (other == member) return std::string(option);
  std::string option = "--" + member;
  for (char& c : option)
    if (c == '.' || c == '_') c = '-';
  return option;
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
  constexpr const char* kGroup = "Options for --encoding spherical";
  SphericalBakeOptions defaults;
  for_each_number([&](const auto& option) {
    command.add_option(option.name, arguments.*option.given, option.text)
        .default_str(fmt::format("{}", option.member(defaults)))
        .group(kGroup);
  });
  command
      .add_option(
          "--training-rays", arguments.rays,
          "Training rays of --mix for objects of 150,000 triangles or more; smaller objects get fewer")
      .default_str(std::to_string(defaults.rays))
      .group(kGroup);
  command.add_option("--weights", arguments.weights, "How network weights start: xavier or he")
      .default_str("xavier")
      .group(kGroup);
  command
      .add_option("--loss", arguments.loss, "Loss on the probability of being visible: l2 or cross-entropy")
      .default_str("l2")
      .group(kGroup);
  command
      .add_option("--precision", arguments.precision,
                  "Stored precision: half or single. By default grids are half and networks single, as the "
                  "paper counts its bytes")
      .group(kGroup);
  command
      .add_option("--view", arguments.view,
                  "A scene for nif render that contains the mesh. Train on the shadow rays of its cameras, "
                  "as the paper does, instead of --mix")
      .group(kGroup);
  command
      .add_option("--view-samples", arguments.view_samples,
                  "Rays per pixel of --view, instead of the scene's")
      .range(1u, 65536u)
      .group(kGroup);
  command
      .add_flag(
          "--primary", arguments.primary,
          "Also train a field for the camera rays of --view: hit or miss, depth and normal, for nif render")
      .group(kGroup);
  command
      .add_flag("--shared-network", arguments.shared_network,
                "All objects share one pair of networks; grids and networks for primary rays stay separate")
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
    throw Error(Status::usage, "--view-samples needs --view, whose rays per pixel it sets");
  if (arguments.primary && !arguments.view)
    throw Error(Status::usage, "--primary needs --view, whose cameras it learns from");
  if (!arguments.primary)
    for (const CountOption& option : kCounts)
      if (arguments.*option.given && std::string_view(option.name).starts_with("--primary-"))
        throw Error(Status::usage, fmt::format("{} needs --primary, whose field it configures", option.name));
  for (const auto& [given, name] : {std::pair{arguments.rays.has_value(), "--training-rays"},
                                    {arguments.passes.has_value(), "--training-passes"}})
    if (given && arguments.view)
      throw Error(
          Status::usage,
          fmt::format("{} is for rays of --mix; with --view use --view-samples: each ray is used once",
                      name));
  if (options.rays == 0 || options.passes == 0)
    throw Error(Status::usage, "--training-rays and --training-passes cannot be 0: nothing would be learned");
  try {
    bake::check(options.fields);
  } catch (const bake::InvalidOption& error) {
    throw Error(Status::usage, fmt::format("{} {}", option_of(error.option()), error.problem()));
  }
  return options;
}

}  // namespace nif::tools
