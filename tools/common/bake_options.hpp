// The options of `nif bake` that determine the bytes of an asset.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "bake/bake.hpp"
#include "formats/mesh/alpha.hpp"
#include "formats/mesh/merging.hpp"
#include "formats/mesh/mesh_choice.hpp"
#include "tools/common/options.hpp"
#include "tools/common/spherical_options.hpp"

namespace nif::tools {

/// The options as given on the command line.
struct BakeArguments {
  std::optional<std::string> preset;
  std::optional<std::string> encoding;
  std::string prefer;
  std::optional<uint32_t> resolution;
  std::string max_bytes, max_error, max_leak, max_spurious, mix;
  uint64_t seed = 1;
  uint64_t rays = 1'000'000;
  bool strict = false, uncoded = false, source_triangles = false, deforms = false, carry_props = false,
       colors = false, open_rays = false, merge = false, no_merge = false;
  mesh::Choice choice;
  std::string alpha_cutoff, blend, glass;
  std::optional<uint32_t> alpha_resolution;
  bool ignore_alpha = false;
  std::vector<std::string> merge_nodes, merge_except;
  std::string merge_below, merge_triangles;
  SphericalArguments spherical;
};

/// `arguments` must outlive the command.
void add_bake_options(Command command, BakeArguments& arguments);

/// Throws Error(usage) naming the option with an invalid value, or the two that contradict each other.
bake::BakeOptions resolve_options(const BakeArguments& arguments);

/// Options for merging the scene before the bake; none if it is not merged. Without --merge these are
/// mesh::few_copies(), unless the quality of answers may depend on voxels, which are finer for small
/// objects. Like resolve_options(), throws for invalid values and contradictions.
std::optional<mesh::MergeOptions> resolve_merging(const BakeArguments& arguments);

/// How alpha is read. Throws likewise. With --view, everything is solid, as it is for the rays of a view.
mesh::AlphaOptions resolve_alpha(const BakeArguments& arguments);

}  // namespace nif::tools
