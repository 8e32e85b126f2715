// A fault in a picture, in texture coordinates or in colours costs only their alpha, never the mesh.
#include "formats/mesh/gltf/alpha.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace nif::mesh::detail {
namespace {

/// `transform`: Material::transform.
TexelPoint place_in(const AlphaPicture& picture, const std::array<float, 6>& transform,
                    const std::array<float, 2>& coordinates) {
  const std::array<double, 2> size{double(picture.width()), double(picture.height())};
  TexelPoint place;
  for (size_t a = 0; a < 2; ++a) {
    const float* const row = transform.data() + 3 * a;
    const double at = (double{row[0]} * coordinates[0] + double{row[1]} * coordinates[1] + row[2]) * size[a];
    place[a] = std::isfinite(at) ? at : 0;
  }
  return place;
}

/// Of triangles whose texture coordinates and colours are not known.
TriangleAlpha show_hidden(const GltfDrawn& drawn, const AlphaTest& test) {
  if (!test.picture && drawn.colors == -1) {
    uint64_t steps = 0;
    return test.show({}, steps);
  }
  // The factor alone may be below the cutoff.
  return test.factor < test.cutoff ? TriangleAlpha::clear : TriangleAlpha::cut;
}

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
  ReadPicture& read = known->second;
  if (fresh) read.keep(pictures_.read<AlphaTexels>(image, decode_alpha, read.why));
  if (!read.why.empty()) report_.cannot_read(material, read.why);
  return read.get();
}

/// Many primitives may share large accessors, so what is read is limited.
template <class Value, class Read>
const std::vector<Value>& GltfAlpha::of_vertices(OfVertices<Value>& kept, int accessor, uint32_t count,
                                                 const Read& read) {
  if (kept.accessor == accessor && kept.values.size() >= count) return kept.values;
  read_ += count;
  if (read_ / 3 > input_.limits.max_triangles)
    input_.fail(
        Status::too_large,
        fmt::format("has more texture coordinates and colours than the limit of {} triangles has corners",
                    input_.limits.max_triangles));
  kept = {};  // also if reading fails
  std::vector<Value> values = read(accessor, count);
  if (values.size() < count)
    input_.fail(Status::malformed_mesh,
                fmt::format("accessor {} has {} elements for {} vertices", accessor, values.size(), count));
  kept = {accessor, std::move(values)};
  return kept.values;
}

bool GltfAlpha::may_matter(int material) const {
  return material >= 0 && size_t(material) < source_.surfaces.size() && rule_of(size_t(material));
}

std::vector<TriangleAlpha> GltfAlpha::decide_each(const GltfDrawn& drawn, AlphaTest test, const Part& part,
                                                  HoleCollector& holes) {
  const auto material = size_t(drawn.material);
  const Material& look = source_.look.materials[material].material;
  // What cannot be read costs only alpha, as with pictures.
  const std::vector<std::array<float, 2>>* places = nullptr;
  const std::vector<float>* vertex_alphas = nullptr;
  try {
    if (test.picture)
      places = &of_vertices(coordinates_, drawn.coordinates, part.vertices,
                            [&](int accessor, uint32_t count) { return data_.coordinates(accessor, count); });
    if (drawn.colors != -1 && data_.has_alpha(drawn.colors))
      vertex_alphas = &of_vertices(colors_, drawn.colors, part.vertices, [&](int accessor, uint32_t count) {
        return data_.alphas(accessor, count);
      });
  } catch (const Error& error) {
    if (error.status() == Status::too_large) throw;
    if (!places) test.picture = nullptr;
    report_.cannot_read(material, "has texture coordinates or vertex colours that cannot be read");
  }
  std::vector<TriangleAlpha> alpha;
  for (const Triangle& triangle : part.triangles) {
    AlphaTest::Corners corners;
    for (size_t k = 0; k < 3; ++k) {
      const uint32_t v = triangle[k] - part.base;
      if (test.picture) corners.places[k] = place_in(*test.picture, look.transform, (*places)[v]);
      if (vertex_alphas) corners.alphas[k] = (*vertex_alphas)[v];
    }
    const TriangleAlpha shown = test.show(corners, steps_);
    if (shown == TriangleAlpha::cut)
      report_.keep(material, test.holes(corners, holes_), part.first + alpha.size(), holes);
    else
      report_.count(material, shown);
    alpha.push_back(shown);
  }
  return alpha;
}

std::vector<TriangleAlpha> GltfAlpha::decide(const GltfDrawn& drawn, const Part& part, HoleCollector& holes) {
  if (part.triangles.empty() || !may_matter(drawn.material)) return {};
  const auto material = size_t(drawn.material);
  const std::optional<Rule> rule = rule_of(material);
  const GltfSurface& surface = source_.surfaces[material];
  MaterialAlpha& described = report_.of(material);
  described.name = surface.name.empty() ? fmt::format("material {}", material) : short_name(surface.name);
  described.rule = rule->rule;
  described.cutoff = rule->cutoff;
  AlphaTest test{std::clamp(surface.factor, 0.0, 1.0), rule->cutoff};
  std::vector<TriangleAlpha> alpha;
  if (!rule->always) {
    test.picture = picture_of(material);
    test.wrap = source_.look.materials[material].material.wrap;
  }
  if (test.picture && drawn.coordinates == -1) {
    report_.cannot_place(material);
    test.picture = nullptr;
  }
  if (rule->always || drawn.hidden) {
    const TriangleAlpha all = rule->always ? *rule->always : show_hidden(drawn, test);
    alpha.assign(part.triangles.size(), all);
    for (size_t t = 0; t < alpha.size(); ++t)
      all == TriangleAlpha::cut ? report_.count_filled(material, Filled::draco)
                                : report_.count(material, all);
  } else {
    alpha = decide_each(drawn, test, part, holes);
  }
  const bool solid = std::ranges::count(alpha, TriangleAlpha::solid) == ptrdiff_t(alpha.size());
  return solid ? std::vector<TriangleAlpha>() : alpha;
}

}  // namespace nif::mesh::detail
