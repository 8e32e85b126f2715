// Decides which options contradict each other, with a sentence that says why. Both `nif bake` and manifests
// go through resolve_options(), so both refuse the same.
#include "tools/common/bake_options.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <sstream>

#include "bake/alpha_metadata.hpp"
#include "bake/merge_metadata.hpp"
#include "formats/base/status.hpp"
#include "mesh/merge/merge.hpp"
#include "tools/common/amounts.hpp"
#include "tools/common/shared_options.hpp"

namespace nif::tools {
namespace {

/// "outer-lines=0.5,segments=0.5", or only names for equal shares.
bake::Mix parse_mix(const std::string& text) {
  bake::Mix mix{};
  std::istringstream parts(text);
  for (std::string part; std::getline(parts, part, ',');) {
    const size_t equals = part.find('=');
    const std::string name = part.substr(0, equals);
    const std::optional<bake::RaySet> set = bake::ray_set_named(name);
    if (!set || bake::is_coherent(*set)) {
      throw Error(
          Status::usage,
          fmt::format("--mix: unknown ray set '{}'; use outer-lines, inner-surface, inner-volume or segments",
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

/// The encoding, if it is named or implied.
std::string encoding_of(const BakeArguments& arguments) {
  return arguments.encoding.value_or(arguments.preset == "paper" ? "spherical" : "auto");
}

/// What keeps objects apart by default: options with which the quality of answers may depend on the size of
/// voxels. A grid has a limited number of these, so one for the whole scene would be coarse. Empty if nothing
/// does.
std::string why_apart(const BakeArguments& arguments) {
  const std::string encoding = encoding_of(arguments);
  const std::optional<bake::AnswerKind> kind = bake::kind_of(encoding);
  if (kind && *kind != bake::AnswerKind::exact) return "--encoding " + encoding;
  if (arguments.spherical.view) return "--view";
  if (arguments.colors) return "--colors";
  if (!arguments.max_bytes.empty()) return "--max-bytes";
  return "";
}

}  // namespace

std::optional<mesh::MergeOptions> resolve_merging(const BakeArguments& arguments) {
  const char *names = !arguments.merge_nodes.empty()    ? "--merge-nodes"
                      : !arguments.merge_except.empty() ? "--merge-except"
                                                        : nullptr,
             *copies = !arguments.merge_below.empty()       ? "--merge-below"
                       : !arguments.merge_triangles.empty() ? "--merge-triangles"
                                                            : nullptr;
  if (arguments.carry_props && !arguments.deforms)
    throw Error(Status::usage,
                "--carry-props needs --deforms: joints carry what becomes part of a character");
  if (arguments.no_merge) {
    const char* contrary = arguments.merge         ? "--merge"
                           : names                 ? names
                           : arguments.carry_props ? "--carry-props"
                                                   : copies;
    if (contrary)
      throw Error(Status::usage, fmt::format("--no-merge and {} contradict each other", contrary));
    return std::nullopt;
  }
  if (!arguments.merge) {
    if (copies) throw Error(Status::usage, fmt::format("{} needs --merge", copies));
    if (const std::string why = why_apart(arguments); !why.empty()) {
      if (names)
        throw Error(Status::usage,
                    fmt::format("{} needs --merge here: with {}, nothing is merged by default", names, why));
      if (arguments.carry_props)
        throw Error(
            Status::usage,
            fmt::format("--carry-props needs --merge here: with {}, nothing is merged by default", why));
      return std::nullopt;
    }
  }
  if (arguments.spherical.view)
    throw Error(
        Status::usage,
        "--merge and --view cannot be used together: the rays of a view are for the meshes of the scene "
        "as they are");
  mesh::MergeOptions options = mesh::few_copies();
  options.nodes = arguments.merge_nodes;
  options.except = arguments.merge_except;
  options.skins = arguments.deforms;
  options.carried = arguments.carry_props;
  for (const auto& [names, name] :
       {std::pair{&options.nodes, "--merge-nodes"}, {&options.except, "--merge-except"}})
    if (names->size() > bake::kMostMergeNames)
      throw Error(Status::usage, fmt::format("{} can be given {} times at most; use a pattern", name,
                                             bake::kMostMergeNames));
  if (!arguments.merge) return options;
  options.few_copies = false;
  if (!arguments.merge_below.empty())
    options.part_triangles = parse_count(arguments.merge_below, "--merge-below");
  options.object_triangles = std::max(mesh::kObjectTriangles, options.part_triangles);
  if (options.part_triangles == 0)
    throw Error(Status::usage, "--merge-below 0 and --merge contradict each other: nothing could be copied");
  if (!arguments.merge_triangles.empty())
    options.added_triangles = parse_count(arguments.merge_triangles, "--merge-triangles");
  return options;
}

mesh::AlphaOptions resolve_alpha(const BakeArguments& arguments) {
  const char* given = !arguments.alpha_cutoff.empty() ? "--alpha-cutoff"
                      : arguments.alpha_resolution    ? "--alpha-resolution"
                      : !arguments.blend.empty()      ? "--blend"
                      : !arguments.glass.empty()      ? "--glass"
                                                      : nullptr;
  for (const auto& [set, name] :
       {std::pair{arguments.ignore_alpha, "--ignore-alpha"}, {bool(arguments.spherical.view), "--view"}})
    if (set && given)
      throw Error(
          Status::usage,
          fmt::format("{} and {} cannot be used together: with {}, everything is solid", name, given, name));
  mesh::AlphaOptions options;
  if (arguments.ignore_alpha || arguments.spherical.view) return options;
  options.read = true;
  if (!arguments.blend.empty()) options.blend = bake::blend_named(arguments.blend, "--blend");
  if (!arguments.alpha_cutoff.empty()) {
    if (options.blend != mesh::AlphaOptions::Blend::cutoff)
      throw Error(Status::usage, fmt::format("--alpha-cutoff and --blend {} contradict each other",
                                             bake::name_of(options.blend)));
    options.cutoff = parse_rate(arguments.alpha_cutoff, "--alpha-cutoff");
  }
  if (!arguments.glass.empty() && arguments.glass != "opaque" && arguments.glass != "ignore")
    throw Error(Status::usage, fmt::format("--glass '{}' is not one of ignore, opaque", arguments.glass));
  options.opaque_glass = arguments.glass == "opaque";
  options.resolution = arguments.alpha_resolution.value_or(0);
  return options;
}

bake::BakeOptions resolve_options(const BakeArguments& arguments) {
  resolve_merging(arguments);
  resolve_alpha(arguments);
  check_choice(arguments.choice);
  if (arguments.spherical.view && !arguments.choice.empty())
    throw Error(
        Status::usage,
        fmt::format("{} and --view cannot be used together: the rays of a view are for the meshes of the "
                    "scene as they are",
                    arguments.choice.only.empty() ? "--except" : "--only"));
  bake::BakeOptions options;
  const std::string encoding_name = encoding_of(arguments);
  const std::string preset = arguments.preset.value_or(encoding_name == "spherical" ? "paper" : "balanced");
  const std::optional<bake::Preset> known_preset = bake::preset_named(preset);
  if (!known_preset)
    throw Error(Status::usage,
                fmt::format("--preset '{}' is not one of fast, balanced, high, paper", preset));
  const std::vector<std::string_view> known = bake::encoding_choices();
  if (std::ranges::find(known, encoding_name) == known.end())
    throw Error(Status::usage,
                fmt::format("--encoding '{}' is not one of {}", encoding_name, fmt::join(known, ", ")));
  if (!bake::has_grids(encoding_name) && (arguments.preset || arguments.resolution))
    throw Error(Status::usage, fmt::format("--encoding {} and {} cannot be used together: it has no grid",
                                           encoding_name, arguments.preset ? "--preset" : "--resolution"));
  const std::optional<bake::AnswerKind> kind = bake::kind_of(encoding_name);
  const bool learned = kind == bake::AnswerKind::learned;
  if (kind && !learned && !arguments.mix.empty())
    throw Error(
        Status::usage,
        fmt::format("--encoding {} and --mix cannot be used together: nothing is trained", encoding_name));
  const bool spherical = encoding_name == "spherical";
  if (spherical != (preset == "paper"))
    throw Error(Status::usage, fmt::format("--encoding {} and --preset {} cannot be used together: paper is "
                                           "for spherical, which has no other preset",
                                           encoding_name, preset));
  if (spherical && arguments.resolution)
    throw Error(Status::usage,
                "--encoding spherical and --resolution cannot be used together: use --outer-resolution, "
                "--inner-resolution and --distance-resolution");
  for (const auto& [limit, name] :
       {std::pair{&arguments.max_leak, "--max-leak"}, {&arguments.max_spurious, "--max-spurious"}})
    if (spherical && !limit->empty())
      throw Error(Status::usage,
                  fmt::format("--encoding spherical and {} cannot be used together: these fields, as "
                              "published, have no threshold",
                              name));
  if (arguments.spherical.view && !arguments.mix.empty())
    throw Error(Status::usage,
                "--view and --mix cannot be used together: training rays come from one or the other");
  if (spherical) {
    options.spherical = resolve_spherical(arguments.spherical);
  } else if (const char* idle = arguments.spherical.first_given()) {
    throw Error(Status::usage,
                fmt::format("{} needs --encoding spherical, but the encoding is {}", idle, encoding_name));
  }
  if (arguments.open_rays && kind)
    throw Error(Status::usage,
                fmt::format("--open-rays needs --encoding auto, but the encoding is {}", encoding_name));
  if (!arguments.prefer.empty()) {
    options.prefer = bake::preference_named(arguments.prefer);
    if (!options.prefer)
      throw Error(Status::usage, fmt::format("--prefer '{}' is not one of speed, bytes", arguments.prefer));
    if (kind)
      throw Error(Status::usage,
                  fmt::format("--prefer needs --encoding auto, but the encoding is {}: there is "
                              "nothing to choose",
                              encoding_name));
  }
  if (arguments.source_triangles && kind && kind != bake::AnswerKind::exact)
    throw Error(
        Status::usage,
        fmt::format("--encoding {} and --source-triangles cannot be used together: it stores no triangles",
                    encoding_name));
  options.source_triangles = arguments.source_triangles;
  if (arguments.deforms && ((kind && encoding_name != "bvh") || arguments.colors || arguments.open_rays))
    throw Error(Status::usage,
                fmt::format("{} and --deforms cannot be used together: what bends is a bvh object",
                            arguments.colors      ? "--colors"
                            : arguments.open_rays ? "--open-rays"
                                                  : "--encoding " + encoding_name));
  options.deforms = arguments.deforms;
  if (arguments.colors && (spherical || !bake::has_grids(encoding_name)))
    throw Error(Status::usage,
                fmt::format("--encoding {} and --colors cannot be used together: it has no voxels that could "
                            "keep them",
                            encoding_name));
  options.colors = arguments.colors;
  options.open_rays = arguments.open_rays;
  options.encoding = encoding_name;
  options.preset = *known_preset;
  options.seed = arguments.seed;
  options.strict = arguments.strict;
  options.uncoded = arguments.uncoded;
  options.evaluation_rays = arguments.rays;
  options.resolution = arguments.resolution;
  if (!arguments.max_bytes.empty()) {
    if (arguments.resolution) {
      throw Error(Status::usage,
                  "--resolution and --max-bytes cannot be used together: each sets the size of the grid");
    }
    options.max_bytes = parse_bytes(arguments.max_bytes, "--max-bytes");
  }
  if (!arguments.max_error.empty()) {
    if (arguments.rays == 0) {
      throw Error(Status::usage,
                  "--max-error and --rays 0 cannot be used together: the error would not be measured");
    }
    options.max_error = parse_rate(arguments.max_error, "--max-error");
    if (kind == bake::AnswerKind::open)
      throw Error(
          Status::usage,
          fmt::format("--encoding {} and --max-error cannot be used together: no answer is wrong, and rays "
                      "that stay open have no answer",
                      encoding_name));
    if (options.max_error == 0.0 && learned)
      throw Error(
          Status::usage,
          fmt::format("--max-error 0 and --encoding {} contradict each other: learned answers are wrong "
                      "for some rays; use --encoding exact, or auto",
                      encoding_name));
  }
  if (!arguments.max_leak.empty() && !arguments.max_spurious.empty())
    throw Error(Status::usage,
                "--max-leak and --max-spurious cannot be used together: what limits one kind of error makes "
                "the other more frequent");
  if (!arguments.max_leak.empty())
    options.error_limit = {bake::Mistake::leak, parse_rate(arguments.max_leak, "--max-leak")};
  if (!arguments.max_spurious.empty())
    options.error_limit = {bake::Mistake::spurious, parse_rate(arguments.max_spurious, "--max-spurious")};
  if (!arguments.mix.empty()) options.mix = parse_mix(arguments.mix);
  return options;
}

void add_bake_options(Command command, BakeArguments& arguments) {
  command
      .add_option("--preset", arguments.preset,
                  "fast, balanced or high: finer grids and longer training. paper: spherical, as published")
      .default_str("balanced");
  command.add_option("--encoding", arguments.encoding, bake::encoding_help()).default_str("auto");
  command.add_option(
      "--prefer", arguments.prefer,
      "With auto, what decides between exact and bvh for objects that are exact. speed: the one "
      "with less work, as counted, whatever memory it takes; bytes: bvh, the smaller one. By default, "
      "bvh below 10,000 triangles, else the one with less work that takes no more memory than "
      "Embree. --max-bytes is kept in any case");
  command
      .add_option("--resolution", arguments.resolution,
                  "Finest cells along the longest side, whatever memory they take. By default, as many as "
                  "fit the preset's bytes")
      .range(2u, kernels::kMaxCells);
  command.add_option("--max-bytes", arguments.max_bytes,
                     "Largest size of the file, e.g. 200kB. With auto, objects are exact as long as they "
                     "fit. Grids are as fine as fits, at most as fine as the preset's");
  command.add_option("--max-error", arguments.max_error,
                     "Largest error on each ray set, e.g. 0.002 or 0.2%, with 99% confidence; 0: all objects "
                     "are exact. Bakes fields up to six times to find the smallest that meets it. If none "
                     "does, nothing is written; with auto, the object becomes exact");
  command.add_flag(
      "--open-rays", arguments.open_rays,
      "The caller has a BVH for open rays (nifQueryOpen): auto then chooses proof instead of segment");
  command.add_option(
      "--max-leak", arguments.max_leak,
      "Largest share of the rays of each set that is blocked but answered visible, e.g. 0.05%, with 99% "
      "confidence. Moves the decision threshold, so the other kind of error grows. 0: never, if the network "
      "decides");
  command.add_option("--max-spurious", arguments.max_spurious,
                     "The same for rays that are visible but answered blocked");
  command.add_flag("--uncoded", arguments.uncoded,
                   "Store fields as they are used in memory: files are larger, load faster, and are used in "
                   "place when they are mapped. The answers are the same");
  command.add_flag("--source-triangles", arguments.source_triangles,
                   "Exact objects keep the numbers that their triangles have in the source mesh, for first "
                   "hits (nifIntersect): up to 32 bits per triangle. Otherwise, hits number triangles in the "
                   "order of the asset");
  command.add_flag(
      "--deforms", arguments.deforms,
      "What skins and morph targets of a glTF bend becomes a bvh object whose instances can bend: by "
      "nifPoseInstance, or by vertices that the program gives (nifSetInstanceVertices). In a file in which "
      "nothing bends, all objects do. Takes the shape in which meshes are bound to their joints");
  command.add_flag("--carry-props", arguments.carry_props,
                   "With --deforms, rigid meshes below a joint, such as a helmet or a sword, become part of "
                   "the mesh that bends, moved by that "
                   "joint alone: a character is one instance. Rays are faster, poses cost more. "
                   "--merge-except keeps separate what the program "
                   "swaps or hides");
  command.add_flag("--colors", arguments.colors,
                   "Keep the mean base colour of the surface in each voxel, for first hits: glTF materials "
                   "with their pictures, and vertex colours. 2 bytes per surface voxel. auto and exact then "
                   "make no bvh objects, because these have no voxels");
  add_choice_options(command, arguments.choice);
  command
      .add_option("--alpha-cutoff", arguments.alpha_cutoff,
                  "Materials that blend (glTF: alphaMode BLEND; all of OBJ) let light through where alpha is "
                  "below this, e.g. "
                  "0.3; those with a cutoff of their own (MASK) keep it")
      .default_str("0.5");
  command
      .add_option(
          "--alpha-resolution", arguments.alpha_resolution,
          "Most texels along a side of the pictures of holes, e.g. 1024: larger ones are halved until "
          "they fit, so outlines of holes are coarser. By default, pictures are as they are")
      .range(1u, mesh::AlphaMap::kMostSide);
  command
      .add_option(
          "--blend", arguments.blend,
          "Materials that blend. cutoff: as above; opaque: they are solid; ignore: they block nothing")
      .default_str("cutoff");
  command
      .add_option("--glass", arguments.glass,
                  "Materials that transmit light (KHR_materials_transmission). ignore: they block nothing; "
                  "opaque: as "
                  "others")
      .default_str("ignore");
  command.add_flag("--ignore-alpha", arguments.ignore_alpha,
                   "Every triangle is solid, whatever its material says");
  command.add_flag(
      "--merge", arguments.merge,
      "Also merge small meshes that are placed many times: thousands of objects and instances "
      "become tens, which is usually faster. By default, meshes that are placed once are merged, and "
      "small copies that add at most a tenth to them. Nothing that moves against others is. Names stay "
      "in the metadata");
  command.add_flag("--no-merge", arguments.no_merge,
                   "Keep an object for each mesh, and an instance for each place: for programs that move or "
                   "hide meshes that no animation moves, and for nif attach. With --colors, --max-bytes and "
                   "encodings that are not exact, this is the default");
  command
      .add_option("--merge-nodes", arguments.merge_nodes,
                  "Merge only nodes with this name, and everything below them. May contain *, ? and [...], "
                  "and may be repeated")
      .one_word_each();
  command
      .add_option("--merge-except", arguments.merge_except,
                  "Do not merge nodes with this name, or anything below them, e.g. 'door*'. Patterns as for "
                  "--merge-nodes")
      .one_word_each();
  command
      .add_option("--merge-below", arguments.merge_below,
                  "With --merge: copy only meshes with fewer triangles than this; larger ones gain little")
      .default_str(fmt::format("{}", mesh::kPartTriangles));
  command
      .add_option("--merge-triangles", arguments.merge_triangles,
                  "With --merge: limit for the triangles that it adds, e.g. 500k, because each copy of a "
                  "mesh takes memory again. 0: no copies")
      .default_str("1M if that is enough for all, otherwise 0");
  command.add_option("--mix", arguments.mix, "Ray sets to train on, e.g. outer-lines=0.5,segments=0.5");
  add_seed_option(command, arguments.seed);
  command
      .add_option("--rays", arguments.rays, "Rays per ray set to measure the error with (0 = do not measure)")
      .capture_default_str();
  command.add_flag("--strict", arguments.strict,
                   "Refuse a mesh that needs repair (triangles without area, covered by another one or "
                   "facing against their neighbours), and a file that is not read completely. By default, a "
                   "note says what was changed or left out");
  add_spherical_options(command, arguments.spherical);
}

}  // namespace nif::tools
