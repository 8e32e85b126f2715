// Decides how fine an object's grid is: what a preset means, within a budget of bytes.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <string_view>

#include "bake/ground_truth/prepare.hpp"
#include "bake/planes/fit_cells.hpp"
#include "bake/planes/occupancy.hpp"

namespace nif::bake {

struct BakeOptions;

/// The grid of a preset.
struct GridShape {
  uint32_t voxels;   ///< along the longest side
  uint32_t levels;   ///< how often a voxel is cut in two along each axis, at most
  double thickness;  ///< times the bias: distance of planes from which on a cell is cut
  uint64_t budget;   ///< bytes per object, see budget_for()
};

/// Takes the place of a budget: grids are as the options say, at any size.
inline constexpr uint64_t kNoBudget = ~uint64_t{0};

/// Sets the shape for `resolution` finest cells along the longest side.
void set_resolution(uint32_t resolution, GridShape& shape);

/// Whether a grid can be made at this scale.
bool has_scale(const GridShape& shape, double scale);

/// Budget of an object's grid, including what is trained in it: half of what a BVH would take, except for
/// very small objects, and at most the preset's budget. Beyond a million triangles, the preset's budget grows
/// with the square root of their number.
uint64_t budget_for(const GridShape& shape, uint64_t triangles);

/// How much finer the grid of a large object is than the preset says, within its budget.
double growth_for(const GridShape& shape, uint64_t triangles);

/// Makes grids until one is within its budgets, if `bounded` says that they count: make(scale) makes one, and
/// returns its size divided by the budget. Returns the scale, without the growth of large objects.
template <class Make>
double fit_budget(const GridShape& shape, double scale, bool bounded, uint64_t triangles, const Make& make) {
  const double growth = growth_for(shape, triangles);
  for (;;) {
    const double times = make(scale * growth);
    // Bytes fall with the square of the scale, or a little faster.
    const double next = scale * std::clamp(std::pow(times, -1 / 2.5), 0.3, 0.85);
    if (!bounded || times <= 1 || !has_scale(shape, next)) return scale;
    scale = next;
  }
}

/// Figures that are reported about a grid.
struct GridReport {
  std::array<uint32_t, 3> voxels{};
  size_t surface_voxels = 0, inside_voxels = 0, unknown_voxels = 0;
  size_t children = 0;  ///< of surface voxels that are cut
  size_t planes = 0;    ///< surface voxels and children with planes
  size_t walls = 0;     ///< of those, with a wall
};

void add_grid(const GridReport& report, nlohmann::ordered_json& json);

/// A grid at a scale of the shape, before it is stored.
struct LaidOut {
  Grid grid;
  SurfaceVoxels surface;  ///< without marks
  Occupancy occupancy;
  double thickness;  ///< as for fit_cells()
};
/// `cut`: cuts voxels even if there are few.
LaidOut lay_out_grid(const Prepared& prepared, const GridShape& shape, double scale, bool cut);

/// For an object without features.
GridShape proof_shape_for(const BakeOptions& options);
/// Adds the options that it depends on.
void add_shape_options(const BakeOptions& options, nlohmann::ordered_json& json);

/// Calls fit_cells() on what store_occupancy() has stored, and makes the report.
GridReport fit_planes(const Prepared& prepared, const LaidOut& grid, std::string_view name,
                      format::PlanesData& data);

/// A grid without features within its budgets for a file and for memory, as fit_budget(); `count` returns its
/// size in a file. Returns its scale.
double fit_proof(const Prepared& prepared, const GridShape& shape, double scale, bool bounded,
                 const BakeOptions& options, std::string_view name, format::PlanesData& data,
                 GridReport& report, const std::function<uint64_t()>& count);

}  // namespace nif::bake
