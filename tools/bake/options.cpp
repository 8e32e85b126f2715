#include "tools/bake/options.hpp"

#include <fmt/format.h>

#include <sstream>

#include "tools/common/command.hpp"

namespace nif::tools {
namespace {

/// "outer-lines=0.5,segments=0.5", or names alone for equal shares.
bake::Mix parse_mix(const std::string& text) {
  bake::Mix mix{};
  std::istringstream parts(text);
  for (std::string part; std::getline(parts, part, ',');) {
    const size_t equals = part.find('=');
    const std::string name = part.substr(0, equals);
    const std::optional<bake::RaySet> set = bake::ray_set_named(name);
    if (!set || *set == bake::RaySet::sun) {
      throw Error(Status::usage,
                  fmt::format("--mix names '{}'; rays can be drawn from outer-lines, inner-surface, "
                              "inner-volume and segments",
                              name));
    }
    mix[size_t(*set)] =
        equals == std::string::npos ? 1.0 : parse_rate(part.substr(equals + 1), "--mix " + name);
  }
  double total = 0;
  for (double share : mix) total += share;
  if (!(total > 0)) throw Error(Status::usage, "--mix leaves no rays to train on");
  return mix;
}

}  // namespace

bake::BakeOptions resolve_options(const BakeArguments& arguments) {
  bake::BakeOptions options;
  const bool paper = arguments.preset == "paper";
  const std::string encoding_name = arguments.encoding.value_or(paper ? "spherical" : "auto");
  const std::string preset = arguments.preset.value_or(encoding_name == "spherical" ? "paper" : "balanced");
  const std::optional<bake::Preset> known_preset = bake::preset_named(preset);
  if (!known_preset)
    throw Error(Status::usage, fmt::format("--preset '{}' is none of fast, balanced, high, paper", preset));
  const std::optional<bake::EncodingOption> encoding = bake::encoding_named(encoding_name);
  if (!encoding) {
    throw Error(Status::usage,
                fmt::format("--encoding '{}' is none of auto, segment, bvh, spherical", encoding_name));
  }
  if (*encoding == bake::EncodingOption::bvh) {
    const char* idle = arguments.preset         ? "--preset"
                       : arguments.resolution   ? "--resolution"
                       : !arguments.mix.empty() ? "--mix"
                                                : nullptr;
    if (idle)
      throw Error(Status::usage,
                  fmt::format("--encoding bvh and {} contradict each other: no field is trained", idle));
  }
  const bool spherical = *encoding == bake::EncodingOption::spherical;
  if (spherical != (preset == "paper"))
    throw Error(Status::usage,
                fmt::format("--encoding {} and --preset {} contradict each other: paper is the "
                            "preset of spherical, and its only one",
                            encoding_name, preset));
  if (spherical && arguments.resolution)
    throw Error(Status::usage,
                "--encoding spherical and --resolution contradict each other: its grids are set by "
                "--outer-resolution, --inner-resolution and --distance-resolution");
  if (arguments.spherical.view && !arguments.mix.empty())
    throw Error(Status::usage, "--view and --mix contradict each other: rays come from the one or the other");
  if (spherical) {
    options.spherical = resolve_spherical(arguments.spherical);
  } else if (const char* idle = arguments.spherical.first_given()) {
    throw Error(Status::usage, fmt::format("{} is an option of --encoding spherical, and the encoding is {}",
                                           idle, encoding_name));
  }
  options.encoding = *encoding;
  options.preset = *known_preset;
  options.seed = arguments.seed;
  options.strict = arguments.strict;
  options.evaluation_rays = arguments.rays;
  options.resolution = arguments.resolution;
  if (!arguments.max_bytes.empty()) {
    if (arguments.resolution) {
      throw Error(Status::usage, "--resolution and --max-bytes contradict each other: each sets the grid");
    }
    options.max_bytes = parse_bytes(arguments.max_bytes, "--max-bytes");
  }
  if (!arguments.max_error.empty()) {
    if (arguments.rays == 0) {
      throw Error(Status::usage, "--max-error and --rays 0 contradict each other: nothing would be measured");
    }
    options.max_error = parse_rate(arguments.max_error, "--max-error");
  }
  if (!arguments.mix.empty()) options.mix = parse_mix(arguments.mix);
  return options;
}

void add_bake_options(Command command, BakeArguments& arguments) {
  command
      .add_option("--preset", arguments.preset,
                  "fast, balanced or high: how fine and how long. paper: spherical, as published")
      .default_str("balanced");
  command
      .add_option(
          "--encoding", arguments.encoding,
          "segment: small fields, some answers wrong. bvh: exact, 16 bytes or so a triangle; nothing is "
          "trained. auto: for each object the better one of these, by bytes, work and measured error, and "
          "why. "
          "spherical: the fields of the paper that this idea is from, for comparison")
      .default_str("auto");
  command
      .add_option("--resolution", arguments.resolution,
                  "Voxels along the longest side of objects of 150,000 triangles or "
                  "more; fewer for smaller ones")
      .range(2u, kernels::kMaxVoxels);
  command.add_option("--max-bytes", arguments.max_bytes,
                     "Largest size of the file, e.g. 200kB: the finest grids up to the preset's that fit, "
                     "BVHs where there is room");
  command.add_option("--max-error", arguments.max_error,
                     "Write nothing where more of a ray set is wrong, e.g. 0.002 or 0.2%; with auto, fields "
                     "that are become BVHs");
  command.add_option("--mix", arguments.mix, "Ray sets to train on, e.g. outer-lines=0.5,segments=0.5");
  command
      .add_option("--seed", arguments.seed,
                  "Start of all random numbers: same input, options and seed, same bytes")
      .capture_default_str();
  command.add_option("--rays", arguments.rays, "Rays of each set to measure the accuracy with; 0: do not")
      .capture_default_str();
  command.add_flag(
      "--strict", arguments.strict,
      "Refuse a mesh that has to be repaired first: with triangles that are without area, covered "
      "by another one or turned against those around, or that has parts nothing can be made of. "
      "Else that is done, and said");
  add_spherical_options(command, arguments.spherical);
}

}  // namespace nif::tools
