// The options of a bake.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "bake/bake_encodings.hpp"
#include "bake/mix.hpp"

namespace nif::bake {

/// How fine an object's encoding is, and how long it is trained.
enum class Preset {
  fast,
  balanced,
  high,
  paper,  ///< only for `spherical`, which has no other; the others are for `segment` fields
};
/// Objects with at least this many triangles get the preset's resolution and rays.
inline constexpr double kFullTriangles = 150'000;
std::string_view name_of(Preset preset);
std::optional<Preset> preset_named(std::string_view name);

std::string_view name_of(Preference preference);
std::optional<Preference> preference_named(std::string_view name);

/// Takes the place of an encoding's name: whichever suits each object, see bake/choice.hpp.
inline constexpr std::string_view kAutomatic = "auto";
/// What BakeOptions::encoding may be: kAutomatic, and the name of each encoding.
std::vector<std::string_view> encoding_choices();
/// One sentence for each of them.
std::string encoding_help();
/// False for an encoding without grids, for which presets mean nothing.
bool has_grids(std::string_view encoding);
/// None for kAutomatic.
std::optional<AnswerKind> kind_of(std::string_view encoding);

/// Includes the options of each encoding, see its file in bake/encodings.
struct BakeOptions : EncodingOptions {
  std::string encoding{kAutomatic};
  Preset preset = Preset::balanced;  ///< no effect on `bvh`, which has no grid
  uint64_t seed = 1;
  bool strict = false;  ///< refuse meshes that preparation would change, or that were not read completely
  /// Stores everything in the file as in memory, for mapped files; otherwise coded, which is smaller.
  bool uncoded = false;
  /// Objects with triangles store the numbers of these in the source mesh.
  bool source_triangles = false;
  /// Objects of meshes that bend, by skins or morph targets, are `bvh` whose instances can bend; in a scene in which none
  /// does, all are. The scene must have been read with ReadLimits::skins.
  bool deforms = false;
  /// Objects with a grid store the colours of their surface. No effect if the scene has none.
  bool colors = false;
  /// For the whole file: takes the finest grids that fit, up to the preset's, and exact objects if there is
  /// room.
  std::optional<uint64_t> max_bytes;
  /// Which exact encoding objects get that are exact. No effect unless the encoding is kAutomatic.
  std::optional<Preference> prefer;
  std::optional<double> max_error;  ///< for every stated ray set; 0: only exact objects
  bool open_rays = false;           ///< the caller has a BVH for open rays: "auto" proves instead of learning
  std::optional<Mix> mix;           ///< instead of the encoding's
  std::optional<double> effort;     ///< factor on the number of training rays, > 0
  uint64_t evaluation_rays = 1'000'000;  ///< per set, divided among the objects
};

}  // namespace nif::bake
