// What a bake is asked for.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "bake/encodings.hpp"
#include "bake/mix.hpp"

namespace nif::bake {

/// How fine an object's encoding is, and how long it is trained.
enum class Preset {
  fast,
  balanced,
  high,
  paper,  ///< of `spherical`, the only one: the others are for `segment` fields
};
std::string_view name_of(Preset preset);
std::optional<Preset> preset_named(std::string_view name);

/// In place of an encoding's name: whichever suits each object, see bake/choice.hpp.
inline constexpr std::string_view kAutomatic = "auto";
/// What BakeOptions::encoding may be: kAutomatic, and the name of each encoding.
std::vector<std::string_view> encoding_choices();
/// One sentence for each of them.
std::string encoding_help();
/// False for an encoding without grids, to which presets mean nothing.
bool has_grids(std::string_view encoding);
/// None of kAutomatic.
std::optional<AnswerKind> kind_of(std::string_view encoding);

/// With what each encoding has for itself, see bake/encodings.
struct BakeOptions : EncodingOptions {
  std::string encoding{kAutomatic};
  Preset preset = Preset::balanced;  ///< without meaning for `bvh`, which has no grid
  uint64_t seed = 1;
  bool strict = false;  ///< refuse what preparation would change, and what was not read whole
  /// Everything in the file as it is used in memory, for files that are mapped; else coded, which is smaller.
  bool uncoded = false;
  /// Objects with triangles keep which ones of the source mesh they are.
  bool source_triangles = false;
  /// Objects with a grid keep the colours of their surface. Of a scene without any it means nothing.
  bool colors = false;
  /// Of the whole file: the finest grids up to the preset's that fit, and exact objects where there is room.
  std::optional<uint64_t> max_bytes;
  std::optional<double> max_error;  ///< of every stated ray set; 0: exact objects alone
  bool open_rays = false;  ///< who asks has a BVH for what is left open: "auto" proves in place of learning
  std::optional<Mix> mix;  ///< in place of the encoding's
  std::optional<double> effort;          ///< factor on the training rays, > 0
  uint64_t evaluation_rays = 1'000'000;  ///< of each set, spread over the objects
};

}  // namespace nif::bake
