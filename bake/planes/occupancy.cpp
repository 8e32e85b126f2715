// Classifies voxels. A flood fill finds the regions between surface voxels. Sums of solid angles give the
// winding number of enclosed regions, which tells inside from outside. Then voxels are stored brick by brick.
#include "bake/planes/occupancy.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <numbers>

#include "formats/base/status.hpp"
#include "formats/base/vector.hpp"
#include "kernels/reference/planes/grid_traversal.hpp"

namespace nif::bake {
namespace {

using kernels::VoxelState;
constexpr uint8_t state_byte(VoxelState state) { return static_cast<uint8_t>(state); }
constexpr uint8_t kSurface = state_byte(VoxelState::surface);
constexpr uint8_t kUnvisited = 255;

/// Limit of the triangles whose solid angle is summed, over all enclosed regions; some seconds of work.
constexpr uint64_t kWindingBudget = 400'000'000;

/// Solid angle of a triangle seen from `p` (van Oosterom and Strackee 1983), positive from its back side.
double solid_angle(const Double3& p, const Double3& a, const Double3& b, const Double3& c) {
  const Double3 u = a - p, v = b - p, w = c - p;
  const double lu = length(u), lv = length(v), lw = length(w);
  const double denominator = lu * lv * lw + dot(u, v) * lw + dot(v, w) * lu + dot(w, u) * lv;
  return 2 * std::atan2(dot(u, cross(v, w)), denominator);
}

struct Region {
  size_t voxels = 0;
  size_t seed = 0;  // index of its first voxel
  bool border = false;
  VoxelState state = VoxelState::unknown;
};

/// Numbers the connected regions of voxels without surface; labels[voxel] is the region.
std::vector<Region> find_regions(const Grid& grid, std::span<const uint8_t> surface,
                                 std::vector<uint32_t>& labels) {
  constexpr uint32_t kNone = 0xffffffffu;
  const uint32_t nx = grid.voxels[0], ny = grid.voxels[1], nz = grid.voxels[2];
  labels.assign(grid.count(), kNone);
  std::vector<Region> regions;
  std::vector<size_t> open;
  for (size_t start = 0; start < grid.count(); ++start) {
    if (surface[start] || labels[start] != kNone) continue;
    const uint32_t label = uint32_t(regions.size());
    Region region;
    region.seed = start;
    labels[start] = label;
    open.push_back(start);
    while (!open.empty()) {
      const size_t i = open.back();
      open.pop_back();
      ++region.voxels;
      const uint32_t x = uint32_t(i % nx), y = uint32_t(i / nx % ny), z = uint32_t(i / nx / ny);
      auto visit = [&](size_t j) {
        if (surface[j] || labels[j] != kNone) return;
        labels[j] = label;
        open.push_back(j);
      };
      region.border |= x == 0 || y == 0 || z == 0 || x + 1 == nx || y + 1 == ny || z + 1 == nz;
      if (x > 0) visit(i - 1);
      if (x + 1 < nx) visit(i + 1);
      if (y > 0) visit(i - nx);
      if (y + 1 < ny) visit(i + nx);
      if (z > 0) visit(i - size_t(nx) * ny);
      if (z + 1 < nz) visit(i + size_t(nx) * ny);
    }
    regions.push_back(region);
  }
  return regions;
}

/// State of the region around `p` from its winding numbers about the given components. `p` is a voxel's
/// centre and so at least half a voxel away from every triangle, which keeps the sums within a small fraction
/// of an integer.
VoxelState classify_point(const Double3& p, const mesh::CleanMesh& mesh, const ClosedComponents& closed,
                          std::span<const uint32_t> components) {
  for (uint32_t c : components) {
    double sum = 0;
    for (uint32_t t = closed.first[c]; t < closed.first[c + 1]; ++t) {
      const mesh::Triangle v = closed.triangle(mesh, t);
      sum += solid_angle(p, to_double(mesh.positions[v[0]]), to_double(mesh.positions[v[1]]),
                         to_double(mesh.positions[v[2]]));
    }
    const double winding = sum / (4 * std::numbers::pi);
    if (std::abs(winding - std::round(winding)) > 0.01) return VoxelState::unknown;
    if (std::round(winding) != 0) return VoxelState::inside;
  }
  return VoxelState::outside;
}

}  // namespace

Occupancy classify(const Grid& grid, const mesh::CleanMesh& mesh, std::vector<uint8_t> surface,
                   const ClosedComponents& closed) {
  std::vector<uint32_t> labels;
  std::vector<Region> regions = find_regions(grid, surface, labels);

  std::vector<mesh::Box> boxes(closed.count());
  for (size_t c = 0; c < boxes.size(); ++c) {
    boxes[c] = mesh::bounds(mesh.positions, {});
    for (size_t t = closed.first[c]; t < closed.first[c + 1]; ++t)
      boxes[c].add(mesh.positions, closed.triangle(mesh, t));
  }

  // Large regions first: they answer the most segments, in case the budget does not suffice for all.
  std::vector<uint32_t> order;
  for (uint32_t r = 0; r < regions.size(); ++r) {
    if (regions[r].border) {
      regions[r].state = VoxelState::outside;
    } else {
      order.push_back(r);
    }
  }
  std::stable_sort(order.begin(), order.end(),
                   [&](uint32_t a, uint32_t b) { return regions[a].voxels > regions[b].voxels; });
  struct Task {
    uint32_t region;
    Double3 point;
    std::vector<uint32_t> components;
  };
  std::vector<Task> tasks;
  uint64_t work = 0;
  for (uint32_t r : order) {
    const size_t i = regions[r].seed;
    const uint32_t x = uint32_t(i % grid.voxels[0]), y = uint32_t(i / grid.voxels[0] % grid.voxels[1]),
                   z = uint32_t(i / grid.voxels[0] / grid.voxels[1]);
    Task task{
        r, to_double(grid.origin) + Double3{x + 0.5, y + 0.5, z + 0.5} * (1.0 / grid.voxels_per_unit), {}};
    uint64_t triangles = boxes.size();
    for (uint32_t c = 0; c < boxes.size(); ++c) {
      bool within = true;
      for (int a = 0; a < 3; ++a)
        within = within && task.point[a] >= boxes[c].min[a] && task.point[a] <= boxes[c].max[a];
      if (!within) continue;
      task.components.push_back(c);
      triangles += closed.first[c + 1] - closed.first[c];
    }
    work += triangles;
    if (work > kWindingBudget) break;
    tasks.push_back(std::move(task));
  }
  tbb::parallel_for(size_t{0}, tasks.size(), [&](size_t t) {
    regions[tasks[t].region].state = classify_point(tasks[t].point, mesh, closed, tasks[t].components);
  });

  Occupancy occupancy{grid, std::move(surface)};
  for (size_t i = 0; i < occupancy.states.size(); ++i) {
    uint8_t& state = occupancy.states[i];
    state = state ? kSurface : state_byte(regions[labels[i]].state);
    occupancy.surface_voxels += state == kSurface;
    occupancy.inside_voxels += state == state_byte(VoxelState::inside);
    occupancy.unknown_voxels += state == state_byte(VoxelState::unknown);
  }
  return occupancy;
}

void store_occupancy(const Occupancy& occupancy, std::string_view name, format::PlanesData& data,
                     std::vector<uint64_t>* corners) {
  const Grid& grid = occupancy.grid;
  data.origin = grid.origin;
  data.voxels_per_unit = grid.voxels_per_unit;
  data.levels = grid.levels;
  data.voxels = grid.voxels;
  data.brick_table.clear();
  data.brick_states.clear();
  if (corners) corners->clear();

  auto state_at = [&](uint32_t x, uint32_t y, uint32_t z) -> uint8_t {
    if (x >= grid.voxels[0] || y >= grid.voxels[1] || z >= grid.voxels[2]) return kUnvisited;
    return occupancy.states[grid.index(x, y, z)];
  };
  // A corner exists if one of the eight voxels around it is surface.
  auto has_corner = [&](uint32_t x, uint32_t y, uint32_t z) {
    for (uint32_t c = 0; c < 8; ++c) {  // below zero wraps around and is off the grid, too
      if (state_at(x - (c & 1), y - ((c >> 1) & 1), z - (c >> 2)) == kSurface) return true;
    }
    return false;
  };

  constexpr uint32_t kSide = kernels::kBrickSide;
  for (uint32_t bz = 0; bz < format::bricks_for(grid.voxels[2]); ++bz) {
    for (uint32_t by = 0; by < format::bricks_for(grid.voxels[1]); ++by) {
      for (uint32_t bx = 0; bx < format::bricks_for(grid.voxels[0]); ++bx) {
        kernels::BrickStates states{0, 0};
        uint64_t touched = 0;
        uint8_t common = kUnvisited;
        bool alike = true;
        for (uint32_t bit = 0; bit < 64; ++bit) {
          const uint32_t x = bx * kSide + (bit & 3), y = by * kSide + ((bit >> 2) & 3),
                         z = bz * kSide + (bit >> 4);
          const uint64_t mask = uint64_t{1} << bit;
          if (corners && has_corner(x, y, z)) touched |= mask;
          const uint8_t state = state_at(x, y, z);
          if (state == kUnvisited) continue;
          if (common == kUnvisited) common = state;
          alike = alike && state == common;
          if (state == kSurface || state == state_byte(VoxelState::unknown)) states.surface |= mask;
          if (state == state_byte(VoxelState::inside) || state == state_byte(VoxelState::unknown))
            states.aux |= mask;
        }
        if (alike && touched == 0 && common != kSurface) {
          data.brick_table.push_back(common == kUnvisited ? uint16_t{kernels::kBrickOutside} : common);
          continue;
        }
        const size_t index = data.brick_states.size();
        if (index + kernels::kFirstMixedBrick > 0xffff) {
          throw Error(Status::too_large, "object '" + std::string(name) +
                                             "' needs more than 65,532 mixed bricks at this resolution; " +
                                             "use a lower one");
        }
        data.brick_table.push_back(uint16_t(index + kernels::kFirstMixedBrick));
        data.brick_states.push_back(states);
        if (corners) corners->push_back(touched);
      }
    }
  }
}

}  // namespace nif::bake
