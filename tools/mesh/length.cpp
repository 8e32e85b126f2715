// Parses a number with or without a percent sign. Bounds are those of the triangles; vertices that no
// triangle uses do not count.
#include "tools/mesh/length.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "formats/base/status.hpp"
#include "formats/mesh/box.hpp"

namespace nif::tools {
namespace {

std::array<double, 3> extent(const mesh::Mesh& mesh) {
  std::array<double, 3> size{};
  if (mesh.triangles.empty()) return size;
  const mesh::Box box = mesh::bounds(mesh.positions, mesh.triangles);
  for (size_t axis = 0; axis < 3; ++axis) size[axis] = double(box.max[axis]) - box.min[axis];
  return size;
}

}  // namespace

double longest_side(const mesh::Mesh& mesh) {
  const auto size = extent(mesh);
  return std::max({size[0], size[1], size[2]});
}

double diagonal(const mesh::Mesh& mesh) {
  const auto size = extent(mesh);
  return std::hypot(size[0], size[1], size[2]);
}

Length::Length(const std::string& text, const std::string& option) {
  std::string number = text;
  if (number.ends_with('%')) number.pop_back(), relative_ = true;
  size_t used = 0;
  try {
    value_ = std::stod(number, &used);
  } catch (const std::exception&) {
    used = 0;
  }
  if (used == 0 || used != number.size() || !std::isfinite(value_) || value_ <= 0)
    throw Error(Status::usage, fmt::format("{} '{}' is not a length above 0: write 0.01 (in units of the "
                                           "mesh) or 0.1% (of the diagonal of its bounds)",
                                           option, text));
  if (relative_) value_ /= 100;
}

}  // namespace nif::tools
