// Alpha is compared in doubles, as it is written here.
#include "formats/mesh/gltf/alpha.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace nif::mesh::detail {
namespace {

constexpr double kOpaque = 65535;

/// The least alpha of a texel with which a product is at least the cutoff; 65536 if there is none.
uint32_t least_texel(double factor, double cutoff) {
  if (!(factor * 0 < cutoff)) return 0;
  if (!(factor >= cutoff)) return uint32_t(kOpaque) + 1;
  auto least = uint32_t(std::clamp(std::floor(cutoff / factor * kOpaque) - 1, 0.0, kOpaque));
  while (!(factor * (least / kOpaque) >= cutoff)) ++least;
  return least;
}

double finite_or_zero(double x) { return std::isfinite(x) ? x : 0; }

}  // namespace

std::optional<GltfAlpha::Rule> GltfAlpha::rule_of(size_t material) const {
  const AlphaOptions& options = input_.limits.alpha;
  const GltfSurface& surface = source_.surfaces[material];
  if (surface.transmits && !options.opaque_glass)
    return Rule{MaterialAlpha::Rule::glass, TriangleAlpha::clear, 0};
  if (surface.alpha == GltfSurface::Alpha::mask)
    return Rule{MaterialAlpha::Rule::mask, std::nullopt, surface.cutoff};
  if (surface.alpha != GltfSurface::Alpha::blend) return std::nullopt;
  switch (options.blend) {
    case AlphaOptions::Blend::opaque:
      return Rule{MaterialAlpha::Rule::blend, TriangleAlpha::solid, 0};
    case AlphaOptions::Blend::ignore:
      return Rule{MaterialAlpha::Rule::blend, TriangleAlpha::clear, 0};
    case AlphaOptions::Blend::cutoff:
      break;
  }
  return Rule{MaterialAlpha::Rule::blend, std::nullopt, options.cutoff};
}

const AlphaPicture* GltfAlpha::picture_of(size_t material) {
  const int image = source_.look.materials[material].image;
  if (image == -1) return nullptr;
  const auto [known, fresh] = known_.try_emplace(image);
  auto& [picture, why] = known->second;
  if (fresh) {
    std::optional<AlphaTexels> texels = pictures_.read<AlphaTexels>(image, decode_alpha, why);
    if (texels && !texels->alpha.empty()) picture.emplace(std::move(*texels));
  }
  if (!why.empty()) unread_[material] = why;
  return picture ? &*picture : nullptr;
}

std::vector<TriangleAlpha> GltfAlpha::decide(const GltfDrawn& drawn, std::span<const Triangle> triangles,
                                             uint32_t base, uint32_t vertices) {
  if (triangles.empty() || drawn.material < 0 || size_t(drawn.material) >= source_.surfaces.size()) return {};
  const auto material = size_t(drawn.material);
  const std::optional<Rule> rule = rule_of(material);
  if (!rule) return {};
  const GltfSurface& surface = source_.surfaces[material];
  const auto [at, fresh] = materials_.try_emplace(material);
  MaterialAlpha& counted = at->second;
  if (fresh) {
    counted.name = surface.name.empty() ? fmt::format("material {}", material) : short_name(surface.name);
    counted.rule = rule->rule;
    counted.cutoff = rule->cutoff;
  }
  std::vector<TriangleAlpha> alpha(triangles.size(), rule->always.value_or(TriangleAlpha::cut));
  if (!rule->always && !drawn.hidden) {
    const double factor = std::clamp(surface.factor, 0.0, 1.0);
    std::vector<float> colors;
    if (drawn.colors != -1) colors = data_.alphas(drawn.colors, vertices);
    colors.resize(vertices, 1.0f);
    const AlphaPicture* const picture = drawn.coordinates == -1 ? nullptr : picture_of(material);
    std::vector<TexelPoint> places;
    if (picture) {
      const std::vector<std::array<float, 2>> coordinates = data_.coordinates(drawn.coordinates, vertices);
      const std::array<float, 6>& to = source_.look.materials[material].material.transform;
      for (const auto& [u, v] : coordinates)
        places.push_back(
            {finite_or_zero((double{to[0]} * u + double{to[1]} * v + to[2]) * picture->width()),
             finite_or_zero((double{to[3]} * u + double{to[4]} * v + to[5]) * picture->height())});
    }
    places.resize(vertices);
    for (size_t t = 0; t < triangles.size(); ++t) {
      std::array<TexelPoint, 3> corners;
      double sum = 0;
      for (size_t k = 0; k < 3; ++k) {
        const uint32_t v = triangles[t][k] - base;
        corners[k] = places[v];
        sum += colors[v];
      }
      const double whole = factor * (sum / 3);
      if (picture)
        alpha[t] = picture->show(corners, source_.look.materials[material].material.wrap,
                                 least_texel(whole, rule->cutoff));
      else
        alpha[t] = whole >= rule->cutoff ? TriangleAlpha::solid : TriangleAlpha::clear;
    }
  }
  for (const TriangleAlpha one : alpha)
    ++(one == TriangleAlpha::solid ? counted.solid : one == TriangleAlpha::cut ? counted.cut : counted.clear);
  return std::ranges::count(alpha, TriangleAlpha::solid) == ptrdiff_t(alpha.size())
             ? std::vector<TriangleAlpha>()
             : alpha;
}

void GltfAlpha::report(Scene& scene) const {
  for (const auto& [material, counted] : materials_) scene.see_through.push_back(counted);
  size_t notes = 0;
  for (const auto& [material, why] : unread_)
    if (++notes <= kMostNotes)
      scene.notes.push_back(
          {NoteKind::pictures, fmt::format("{}: the picture of material '{}' {}; it counts as opaque",
                                           input_.file.string(), materials_.at(material).name, why)});
  if (notes > kMostNotes)
    scene.notes.push_back(
        {NoteKind::pictures, fmt::format("{}: the pictures of {} more materials cannot be read",
                                         input_.file.string(), notes - kMostNotes)});
}

}  // namespace nif::mesh::detail
