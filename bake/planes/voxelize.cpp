// Voxelises triangles. Tests them against boxes by separating axes. It halves ranges of voxels, so that a
// large triangle does not cost its whole box, and runs twice, to count and to write, to save memory.
#include "bake/planes/voxelize.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>

#include "formats/base/vector.hpp"
#include "kernels/reference/planes/cells.hpp"

namespace nif::bake {
namespace {

/// Clearance of the box from the grid's border, in voxels; above kSurfacePadding plus a traversal's rounding.
constexpr double kMargin = 1.0 / 32;

}  // namespace

bool overlaps(const Double3 (&triangle)[3], const Double3& centre, const Double3& half) {
  const Double3 v[3] = {triangle[0] - centre, triangle[1] - centre, triangle[2] - centre};
  for (int a = 0; a < 3; ++a) {
    const auto [low, high] = std::minmax({v[0][a], v[1][a], v[2][a]});
    if (low > half[a] || high < -half[a]) return false;
  }
  for (const Double3& p : v)  // most small triangles have a corner within
    if (std::abs(p[0]) <= half[0] && std::abs(p[1]) <= half[1] && std::abs(p[2]) <= half[2]) return true;
  const Double3 edges[3] = {v[1] - v[0], v[2] - v[1], v[0] - v[2]};
  auto separated = [&](const Double3& axis) {
    const auto [low, high] = std::minmax({dot(axis, v[0]), dot(axis, v[1]), dot(axis, v[2])});
    const double reach =
        half[0] * std::abs(axis[0]) + half[1] * std::abs(axis[1]) + half[2] * std::abs(axis[2]);
    return low > reach || high < -reach;
  };
  if (separated(cross(edges[0], edges[1]))) return false;
  for (const Double3& e : edges) {
    if (separated({0, -e[2], e[1]}) || separated({e[2], 0, -e[0]}) || separated({-e[1], e[0], 0}))
      return false;
  }
  return true;
}

namespace {

struct Range {
  int low[3], high[3];  // voxels, both ends inclusive
};

/// Calls visit(index) with the voxels of `range` that the triangle touches, halving large ranges so that a
/// large triangle costs about as much as the voxels it touches and not its whole box.
template <class Visit>
void visit_touched(const Grid& grid, double padding, const Double3 (&triangle)[3], const Range& range,
                   const Visit& visit) {
  Double3 centre, half;
  size_t count = 1;
  int widest = 0;
  for (int a = 0; a < 3; ++a) {
    const int size = range.high[a] - range.low[a] + 1;
    centre[a] = (range.low[a] + range.high[a] + 1) * 0.5;
    half[a] = size * 0.5 + padding;
    count *= size_t(size);
    if (size > range.high[widest] - range.low[widest] + 1) widest = a;
  }
  if (!overlaps(triangle, centre, half)) return;
  if (count == 1) {
    visit(grid.index(uint32_t(range.low[0]), uint32_t(range.low[1]), uint32_t(range.low[2])));
    return;
  }
  Range first = range, second = range;
  first.high[widest] = (range.low[widest] + range.high[widest]) / 2;
  second.low[widest] = first.high[widest] + 1;
  visit_touched(grid, padding, triangle, first, visit);
  visit_touched(grid, padding, triangle, second, visit);
}

/// Calls visit(number, index) with each triangle and the voxels that it touches, in parallel. Triangles are
/// numbered from `number` on.
template <class Visit>
void visit_all(const Grid& grid, double cell_padding, std::span<const mesh::Float3> positions,
               std::span<const mesh::Triangle> triangles, uint32_t number, const Visit& visit) {
  const double padding = (cell_padding + kRoundingRoom) / grid.cells();
  tbb::parallel_for(size_t{0}, triangles.size(), [&](size_t t) {
    Double3 corners[3];
    for (int c = 0; c < 3; ++c) corners[c] = grid.to_grid(positions[triangles[t][c]]);
    Range range;
    for (int a = 0; a < 3; ++a) {
      const auto [low, high] = std::minmax({corners[0][a], corners[1][a], corners[2][a]});
      const int top = int(grid.voxels[a]) - 1;
      range.low[a] = std::clamp(int(std::floor(low - padding)), 0, top);
      range.high[a] = std::clamp(int(std::floor(high + padding)), 0, top);
    }
    visit_touched(grid, padding, corners, range, [&](size_t voxel) { visit(number + uint32_t(t), voxel); });
  });
}

}  // namespace

Double3 Grid::to_grid(const std::array<float, 3>& p) const {
  return (to_double(p) - to_double(origin)) * double(voxels_per_unit);
}

Grid make_grid(const mesh::Box& box, uint32_t resolution, uint32_t levels) {
  Grid grid;
  grid.levels = levels;
  const Double3 size = to_double(box.max) - to_double(box.min);
  const double longest = std::max({size[0], size[1], size[2]});
  // The float nearest to the wanted value may be larger, and origins far from zero are coarse: so ask for a
  // little less and count the voxels afterwards.
  for (double voxels = resolution - 2 * kMargin;; voxels *= 0.999) {
    grid.voxels_per_unit = static_cast<float>(voxels / longest);
    const double scale = grid.voxels_per_unit;
    uint32_t most = 0;
    for (int a = 0; a < 3; ++a) {
      const double wanted = double(box.min[a]) - kMargin / scale;
      grid.origin[a] = static_cast<float>(wanted);
      if (grid.origin[a] > wanted)
        grid.origin[a] = std::nextafter(grid.origin[a], -std::numeric_limits<float>::max());
      const double top = (double(box.max[a]) - double(grid.origin[a])) * scale + kMargin;
      grid.voxels[a] = std::max(1u, static_cast<uint32_t>(std::ceil(top)));
      most = std::max(most, grid.voxels[a]);
    }
    if (most <= resolution) return grid;
  }
}

SurfaceVoxels voxelize(const Grid& grid, const mesh::CleanMesh& mesh, double padding) {
  // The voxels that a triangle touches are found twice, to count and to write, because storing all pairs
  // would take more.
  std::vector<uint32_t> counts(grid.count(), 0);
  const auto visit_triangles = [&](const auto& visit) {
    visit_all(grid, padding, mesh.positions, mesh.triangles, 0, visit);
  };
  const auto visit_slivers = [&](const auto& visit) {
    visit_all(grid, padding, mesh.positions, mesh.slivers, uint32_t(mesh.triangles.size()), visit);
  };
  const auto count = [&](uint32_t, size_t voxel) {
    std::atomic_ref(counts[voxel]).fetch_add(1, std::memory_order_relaxed);
  };
  visit_triangles(count);

  SurfaceVoxels surface;
  surface.marks.resize(grid.count());
  for (size_t i = 0; i < counts.size(); ++i) {
    surface.marks[i] = counts[i] != 0;
    if (counts[i] != 0) surface.voxels.push_back(uint32_t(i));
  }
  visit_slivers([&](uint32_t triangle, size_t voxel) {
    if (surface.marks[voxel]) count(triangle, voxel);
  });
  surface.first.assign(surface.voxels.size() + 1, 0);
  for (size_t i = 0; i < surface.voxels.size(); ++i) {
    surface.first[i + 1] = surface.first[i] + counts[surface.voxels[i]];
    counts[surface.voxels[i]] = uint32_t(i);  // from here on: its index among the marked ones
  }

  surface.touching.resize(surface.first.back());
  std::vector<uint32_t> written(surface.voxels.size(), 0);
  const auto write = [&](uint32_t triangle, size_t voxel) {
    if (!surface.marks[voxel]) return;
    const uint32_t i = counts[voxel];
    const uint32_t at = std::atomic_ref(written[i]).fetch_add(1, std::memory_order_relaxed);
    surface.touching[surface.first[i] + at] = triangle;
  };
  visit_triangles(write);
  visit_slivers(write);
  tbb::parallel_for(size_t{0}, surface.voxels.size(), [&](size_t i) {
    std::sort(surface.touching.begin() + ptrdiff_t(surface.first[i]),
              surface.touching.begin() + ptrdiff_t(surface.first[i + 1]));
  });
  return surface;
}

}  // namespace nif::bake
