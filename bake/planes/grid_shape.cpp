// Defines the presets of grids without features, the budgets of all grids, and the steps that make one:
// voxelise, classify, store, fit planes. `segment`, `exact` and `proof` go through these steps.
#include "bake/planes/grid_shape.hpp"

#include <nlohmann/json.hpp>
#include <utility>

#include "bake/loaded/grid_memory.hpp"
#include "bake/options.hpp"

namespace nif::bake {
namespace {

/// With --resolution voxels are cut as often as leaves this many of them, because features need voxels.
constexpr uint32_t kLeastVoxels = 12;

/// Voxels along an axis that may be cut `levels` times.
uint32_t most_voxels(uint32_t levels) { return std::min(kernels::kMaxVoxels, kernels::kMaxCells >> levels); }

// docs/results/exact.md shows what `balanced` gives. Without features there is no reason for few voxels, and
// a traversal that follows fewer links is faster (docs/results/cpu-kernels.md, "Planes without a network").
constexpr std::pair<Preset, GridShape> kProofShapes[] = {{Preset::fast, {48, 1, 1.5, 110'000}},
                                                         {Preset::balanced, {80, 1, 1.5, 200'000}},
                                                         {Preset::high, {128, 1, 1.0, 450'000}}};

/// Memory in bytes that a grid without features may take: about as much as the object's BVH, which it stands
/// in front of, except for very small ones.
double most_resident(uint64_t triangles) {
  constexpr double kResidentPerTriangle = 20, kLeast = 300'000;
  return std::max(kResidentPerTriangle * double(triangles), kLeast);
}

}  // namespace

GridShape proof_shape_for(const BakeOptions& options) {
  GridShape shape = kProofShapes[1].second;
  for (const auto& [preset, known] : kProofShapes)
    if (preset == options.preset) shape = known;
  if (options.resolution) set_resolution(*options.resolution, shape);
  return shape;
}

void add_shape_options(const BakeOptions& options, nlohmann::ordered_json& json) {
  json["preset"] = name_of(options.preset);
  if (options.resolution) json["resolution"] = *options.resolution;
}

void set_resolution(uint32_t resolution, GridShape& shape) {
  while (shape.levels > 0 && resolution >> shape.levels < kLeastVoxels) --shape.levels;
  while (resolution >> shape.levels > kernels::kMaxVoxels) ++shape.levels;
  shape.voxels = (resolution + (1u << shape.levels) - 1) >> shape.levels;
  shape.budget = kNoBudget;
}

bool has_scale(const GridShape& shape, double scale) {
  constexpr double kFewest = 4;
  return shape.voxels * scale >= kFewest && shape.voxels * scale <= most_voxels(shape.levels);
}

uint64_t budget_for(const GridShape& shape, uint64_t triangles) {
  constexpr uint64_t kBytesPerTriangle = 10, kLeastBudget = 24'000;
  if (shape.budget == kNoBudget) return kNoBudget;
  const double most = double(shape.budget) * std::max(1.0, std::sqrt(double(triangles) / 1e6));
  return std::min(uint64_t(most), std::max(kBytesPerTriangle * triangles, kLeastBudget));
}

double growth_for(const GridShape& shape, uint64_t triangles) {
  if (shape.budget == kNoBudget) return 1.0;
  return std::clamp(std::pow(double(triangles) / 1e6, 0.4), 1.0,
                    double(most_voxels(shape.levels)) / shape.voxels);
}

void add_grid(const GridReport& report, nlohmann::ordered_json& json) {
  json["voxels"] = report.voxels;
  json["surface_voxels"] = report.surface_voxels;
  json["inside_voxels"] = report.inside_voxels;
  json["unknown_voxels"] = report.unknown_voxels;
  json["children"] = report.children;
  json["planes"] = report.planes;
  json["walls"] = report.walls;
}

LaidOut lay_out_grid(const Prepared& prepared, const GridShape& shape, double scale, bool cut) {
  const mesh::CleanMesh& mesh = prepared.surface;
  const double wanted = double(shape.voxels) * scale;
  // The coarsest grids are for the fewest bytes: with this few voxels, cells do not pay off.
  constexpr double kVoxelsToCut = 4;
  uint32_t levels = shape.levels;
  while (levels > 0 && !cut && wanted < kVoxelsToCut * (1u << levels)) --levels;
  const uint32_t voxels = std::clamp(uint32_t(std::lround(wanted)), 2u, most_voxels(levels));
  LaidOut laid_out;
  laid_out.grid = make_grid(prepared.box, voxels, levels);
  laid_out.surface = voxelize(laid_out.grid, mesh);
  laid_out.occupancy = classify(laid_out.grid, mesh, std::move(laid_out.surface.marks), prepared.closed);
  laid_out.thickness =
      shape.thickness / scale * prepared.bias * laid_out.grid.voxels_per_unit * laid_out.grid.cells();
  return laid_out;
}

GridReport fit_planes(const Prepared& prepared, const LaidOut& grid, std::string_view name,
                      format::PlanesData& data) {
  const CellCounts cells = fit_cells(grid.grid, prepared.surface, grid.surface, grid.thickness, name, data);
  const Occupancy& occupancy = grid.occupancy;
  return {grid.grid.voxels,
          occupancy.surface_voxels,
          occupancy.inside_voxels,
          occupancy.unknown_voxels,
          cells.children,
          cells.planes,
          cells.walls};
}

double fit_proof(const Prepared& prepared, const GridShape& shape, double scale, bool bounded,
                 const BakeOptions& options, std::string_view name, format::PlanesData& data,
                 GridReport& report, const std::function<uint64_t()>& count) {
  data.coded = options.uncoded ? 0u : format::kCodedOccupancy | format::kCodedCells;
  const uint64_t triangles = prepared.surface.triangles.size(), budget = budget_for(shape, triangles);
  return fit_budget(shape, scale, bounded, triangles, [&](double grid_scale) {
    const LaidOut grid = lay_out_grid(prepared, shape, grid_scale, options.resolution.has_value());
    store_occupancy(grid.occupancy, name, data);
    report = fit_planes(prepared, grid, name, data);
    const double of_file = double(count()) / double(budget);
    if (budget == kNoBudget) return of_file;
    return std::max(of_file, double(loaded_bytes(format::field_of(data))) / most_resident(triangles));
  });
}

}  // namespace nif::bake
