// The conversion from sRGB to linear light, and the repairs that keep colours in range (NaN becomes 0) and
// arrays as long as the mesh.
#include "formats/mesh/appearance.hpp"

#include <algorithm>
#include <cmath>

namespace nif::mesh {

double linear_of(double srgb) {
  const double c = std::clamp(srgb, 0.0, 1.0);
  return c <= 0.04045 ? c / 12.92 : std::pow((c + 0.055) / 1.055, 2.4);
}

void Appearance::set_color(size_t vertex, const std::array<float, 3>& color) {
  if (colors.size() <= vertex) colors.resize(vertex + 1, {1, 1, 1});
  for (size_t c = 0; c < 3; ++c)
    colors[vertex][c] = color[c] >= 0 ? std::min(color[c], 1.0f) : 0;  // also for NaN
}

void Appearance::complete(size_t vertices, size_t triangles) {
  if (!colors.empty()) colors.resize(vertices, {1, 1, 1});
  if (!coordinates.empty()) coordinates.resize(vertices);
  if (!materials.empty()) materials.resize(triangles);
}

}  // namespace nif::mesh
