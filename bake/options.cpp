#include "bake/options.hpp"

namespace nif::bake {
namespace {

constexpr std::pair<Preset, std::string_view> kPresets[] = {
    {Preset::fast, "fast"}, {Preset::balanced, "balanced"}, {Preset::high, "high"}, {Preset::paper, "paper"}};

template <class... Baking>
struct NamesOf {
  static constexpr std::string_view kNames[] = {kAutomatic,
                                                format::EncodingOfContent<typename Baking::Data>::kName...};
};

}  // namespace

std::string_view name_of(Preset preset) {
  for (const auto& [known, name] : kPresets)
    if (known == preset) return name;
  return {};
}

std::optional<Preset> preset_named(std::string_view name) {
  for (const auto& [preset, known] : kPresets)
    if (known == name) return preset;
  return std::nullopt;
}

std::vector<std::string_view> encoding_choices() {
  using Names = OfEncoders<NamesOf>;
  return {std::begin(Names::kNames), std::end(Names::kNames)};
}

}  // namespace nif::bake
