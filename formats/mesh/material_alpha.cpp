// The cutoff is turned into the least alpha of a texel that blocks, so that pictures compare whole numbers.
#include "formats/mesh/material_alpha.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <vector>

#include "formats/base/quantities.hpp"
#include "formats/mesh/readers.hpp"

namespace nif::mesh::detail {
namespace {

constexpr double kOpaque = 65535;

bool blocks(double alpha, double cutoff) { return static_cast<float>(alpha) >= static_cast<float>(cutoff); }

/// The least alpha of a texel with which a product is at least the cutoff; 65536 if there is none.
uint32_t least_texel(double factor, double cutoff) {
  if (blocks(0, cutoff)) return 0;
  if (!blocks(factor, cutoff)) return uint32_t(kOpaque) + 1;
  auto least = uint32_t(std::clamp(std::floor(cutoff / factor * kOpaque) - 1, 0.0, kOpaque));
  while (!blocks(factor * (least / kOpaque), cutoff)) ++least;
  return least;
}

/// Why triangles are filled, in few words.
std::string reason(Filled why) {
  switch (why) {
    case Filled::draco:
      return "their texture coordinates or colours are in Draco data";
    case Filled::ambiguous:
      return "polygons have several texture coordinates at one vertex";
    case Filled::far:
      return "their texture coordinates are too far outside the picture";
    case Filled::large:
      return fmt::format("a picture has more than {} texels along a side", AlphaMap::kMostSide);
    case Filled::many:
      break;
  }
  return fmt::format("the pictures together have more than {} texels", HoleMaker::kMostTexels);
}

/// At most 128 bytes, of whole characters.
std::string short_clean_name(std::string_view name) {
  constexpr size_t kMost = 128;
  if (name.size() > kMost) {
    size_t end = kMost;
    while (end > kMost - 4 && (uint8_t(name[end]) & 0xC0) == 0x80) --end;
    name = name.substr(0, end);
  }
  return clean_name(name);
}

/// "2 materials ('leaf', 'bark')"
std::string named(const std::vector<std::string>& names) {
  constexpr size_t kNamed = 5;
  std::string list;
  for (size_t i = 0; i < std::min(kNamed, names.size()); ++i)
    list += fmt::format("{}'{}'", i == 0 ? "" : ", ", names[i]);
  return fmt::format("{} ({}{})", count_of(names.size(), "material"), list,
                     names.size() > kNamed ? ", ..." : "");
}

}  // namespace

uint32_t AlphaTest::least_texel_for(const Corners& corners) const {
  const auto& [a, b, c] = corners.alphas;
  return least_texel(factor * ((double{a} + b + c) / 3), cutoff);
}

TriangleAlpha AlphaTest::show(const Corners& corners, uint64_t& steps) const {
  if (picture) return picture->show(corners.places, wrap, least_texel_for(corners), steps);
  const auto [least, most] = std::ranges::minmax(corners.alphas);
  if (blocks(factor * least, cutoff)) return TriangleAlpha::solid;
  return blocks(factor * most, cutoff) ? TriangleAlpha::cut : TriangleAlpha::clear;
}

NewHoles AlphaTest::holes(const Corners& corners, HoleMaker& maker) const {
  if (picture) return maker.of_picture(*picture, wrap, least_texel_for(corners), corners.places);
  std::array<double, 3> ratios;
  std::ranges::transform(corners.alphas, ratios.begin(),
                         [&](float alpha) { return factor * alpha / cutoff; });
  return maker.of_corners(ratios);
}

void AlphaReport::count(size_t material, TriangleAlpha alpha) {
  MaterialAlpha& counted = materials_[material];
  ++(alpha == TriangleAlpha::solid ? counted.solid : counted.clear);
}

void AlphaReport::count_filled(size_t material, Filled why) {
  ++materials_[material].filled;
  filled_.insert(why);
}

void AlphaReport::keep(size_t material, const NewHoles& made, size_t triangle, HoleCollector& holes) {
  if (!made.map) return count_filled(material, made.why);
  ++materials_[material].cut;
  holes.add(triangle, made.map, made.holes);
}

void AlphaReport::write(const Input& input, Scene& scene) const {
  const auto note = [&](NoteKind kind, const std::string& text) {
    scene.notes.push_back({kind, fmt::format("{}: {}", input.file.string(), text)});
  };
  std::vector<std::string> filled, clear;
  uint64_t holes = 0, gone = 0;
  for (const auto& [number, described] : materials_) {
    MaterialAlpha& material = scene.see_through.emplace_back(described);
    material.name = short_clean_name(described.name);
    if (material.filled != 0) filled.push_back(material.name);
    if (material.clear != 0) clear.push_back(material.name);
    holes += material.filled, gone += material.clear;
  }
  if (!filled.empty()) {
    std::vector<std::string> reasons;
    std::ranges::transform(filled_, std::back_inserter(reasons), reason);
    note(NoteKind::see_through,
         fmt::format("{} of {} {} holes, which are filled ({}): {} as if solid.", count_of(holes, "triangle"),
                     named(filled), holes == 1 ? "has" : "have", fmt::join(reasons, "; "),
                     holes == 1 ? "it blocks" : "they block"));
  }
  if (!clear.empty())
    note(NoteKind::clear,
         fmt::format("{} of {} {} light through, and {} nothing.", count_of(gone, "triangle"), named(clear),
                     gone == 1 ? "lets" : "let", gone == 1 ? "blocks" : "block"));
  size_t notes = 0;
  for (const auto& [material, why] : unread_)
    if (++notes <= kMostNotes)
      note(NoteKind::pictures, fmt::format("the picture of material '{}' {}",
                                           short_clean_name(materials_.at(material).name), why));
  if (notes > kMostNotes)
    note(NoteKind::pictures,
         fmt::format("the pictures of {} more materials cannot be read", notes - kMostNotes));
}

}  // namespace nif::mesh::detail
