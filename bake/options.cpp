// Converts names of presets and encodings from and to text, and prints the help about encodings. All that is
// said about encodings comes from the list in bake/bake_encodings.hpp, so a new one appears here by itself.
#include "bake/options.hpp"

#include <fmt/format.h>

#include "bake/choice.hpp"

namespace nif::bake {
namespace {

constexpr std::pair<Preset, std::string_view> kPresets[] = {
    {Preset::fast, "fast"}, {Preset::balanced, "balanced"}, {Preset::high, "high"}, {Preset::paper, "paper"}};

constexpr std::pair<Preference, std::string_view> kPreferences[] = {{Preference::speed, "speed"},
                                                                    {Preference::bytes, "bytes"}};

template <class Value, size_t kSize>
std::string_view name_in(const std::pair<Value, std::string_view> (&table)[kSize], Value value) {
  for (const auto& [known, name] : table)
    if (known == value) return name;
  return {};
}
template <class Value, size_t kSize>
std::optional<Value> named_in(const std::pair<Value, std::string_view> (&table)[kSize],
                              std::string_view name) {
  for (const auto& [value, known] : table)
    if (known == name) return value;
  return std::nullopt;
}

struct EncodingChoice {
  std::string_view name, help;
  bool automatic, grids, for_holes;
  AnswerKind kind;
};
template <class... Baking>
struct ChoicesOf {
  static constexpr EncodingChoice kAll[] = {{kernels::encoding_of_field<typename Baking::Field>().name,
                                             Baking::kHelp, Baking::kAutomatic, Baking::kGrids,
                                             kIsForHoles<Baking>, Baking::kKind}...};
};
constexpr auto& kEncodings = OfEncoders<ChoicesOf>::kAll;

}  // namespace

std::string_view name_of(Preset preset) { return name_in(kPresets, preset); }
std::optional<Preset> preset_named(std::string_view name) { return named_in(kPresets, name); }
std::string_view name_of(Preference preference) { return name_in(kPreferences, preference); }
std::optional<Preference> preference_named(std::string_view name) { return named_in(kPreferences, name); }

std::vector<std::string_view> encoding_choices() {
  std::vector<std::string_view> names{kAutomatic};
  for (const EncodingChoice& encoding : kEncodings)
    if (!encoding.for_holes) names.push_back(encoding.name);
  return names;
}

std::string encoding_help() {
  std::string chosen, named, for_holes;
  for (const EncodingChoice& encoding : kEncodings)
    (encoding.for_holes   ? for_holes
     : encoding.automatic ? chosen
                          : named) += fmt::format("{}: {}. ", encoding.name, encoding.help);
  const std::string text =
      chosen +
      fmt::format(
          "auto: exact below {} triangles if that takes no more memory than Embree, else learned, unless "
          "--max-bytes, --max-error or --open-rays wish otherwise. ",
          kMostExactTriangles) +
      named +
      "What has holes, such as leaves, becomes what is asked for if that is segment, proof or spherical, "
      "else " +
      for_holes;
  return text.substr(0, text.size() - 2);
}

bool has_grids(std::string_view encoding) {
  for (const EncodingChoice& known : kEncodings)
    if (known.name == encoding) return known.grids;
  return true;
}

std::optional<AnswerKind> kind_of(std::string_view encoding) {
  for (const EncodingChoice& known : kEncodings)
    if (known.name == encoding) return known.kind;
  return std::nullopt;
}

}  // namespace nif::bake
