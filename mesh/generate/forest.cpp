// Plots of equal ground in a square, with trees in a grid that chance moves. Clearings are left around the middle.
#include "mesh/generate/forest.hpp"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "formats/base/random.hpp"
#include "formats/base/status.hpp"
#include "mesh/generate/assembly.hpp"
#include "mesh/generate/placing.hpp"
#include "mesh/generate/turn.hpp"

namespace nif::generate {
namespace {

constexpr uint64_t kForestStream = 0x666f7265, kGroveStream = 0x67726f76;  // "fore", "grov"
constexpr double kPlot = 44;                                               // side of a plot
constexpr uint32_t kRow = 8;                                               // trees along a plot
constexpr double kClearing = 9;                                            // radius around the middle

/// The ground, then the trees in the order of their kinds.
using ForestKind = uint32_t;
using ForestPlace = PlaceOf<ForestKind>;
constexpr ForestKind kGround = 0;

/// Plots join without a step, because this repeats with each of them.
double ground_height(double x, double z) {
  const double u = x / kPlot, v = z / kPlot;
  return 0.55 * turn(u + 0.1).cos * turn(v).cos + 0.22 * turn(2 * u + 3 * v).cos +
         0.1 * turn(5 * u - 3 * v).cos;
}

mesh::Mesh make_ground() {
  Assembly assembly;
  constexpr uint64_t kGrid = 32;
  assembly.slab({-kPlot / 2, -kPlot / 2}, {kPlot / 2, kPlot / 2}, kGrid, kGrid, -2, ground_height);
  return assembly.take("ground");
}

class ForestPlanner {
 public:
  ForestPlanner(uint64_t seed, uint32_t plots) : plots_(plots) {
    for (uint32_t z = 0; z < plots; ++z)
      for (uint32_t x = 0; x < plots; ++x) {
        Random random(seed, kForestStream, 1 + z * plots + x);
        plan_plot(middle(x), middle(z), random);
      }
  }

  const std::vector<ForestPlace>& needed() const { return needed_; }
  std::vector<ForestPlace>& wanted() { return wanted_; }

 private:
  double middle(uint32_t plot) const { return (plot - (plots_ - 1) / 2.0) * kPlot; }

  void plan_plot(double x, double z, Random& random) {
    needed_.push_back({kGround, {x, 0, z}});
    // Each kind is more frequent in some plots, as kinds grow in groups.
    const uint32_t usual = random.below(kTreeKinds);
    constexpr double kStep = kPlot / kRow;
    for (uint32_t i = 0; i < kRow * kRow; ++i) {
      const double at_x = x - kPlot / 2 + kStep * (i % kRow + random.uniform(0.1, 0.9)),
                   at_z = z - kPlot / 2 + kStep * (i / kRow + random.uniform(0.1, 0.9));
      const uint32_t kind = random.below(3) == 0 ? usual : random.below(kTreeKinds);
      const double turns = random.uniform(), scale = random.uniform(0.7, 1.15);
      if (at_x * at_x + at_z * at_z < kClearing * kClearing) continue;
      wanted_.push_back({1 + kind, {at_x, ground_height(at_x - x, at_z - z) - 0.08, at_z}, turns, scale});
    }
  }

  uint32_t plots_;
  std::vector<ForestPlace> needed_, wanted_;
};

}  // namespace

PaintedScene make_forest(const ForestRequest& request) {
  if (request.instances < kForestFewestInstances || request.instances > kForestMostInstances)
    throw Error(Status::usage, fmt::format("{} instances: a forest can have {} to {}", request.instances,
                                           kForestFewestInstances, kForestMostInstances));
  PaintedScene made;
  mesh::Scene& scene = made.scene;
  scene.meshes.resize(1 + kTreeKinds);
  scene.meshes[0] = make_ground();
  std::array<mesh::Paint, kTreeKinds> paints;
  tbb::parallel_for(size_t{0}, kTreeKinds, [&](size_t kind) {
    const uint64_t seed = Random(request.seed, kGroveStream, kind).bits();
    scene.meshes[1 + kind] = make_cutout_mesh(tree_kind(kind), {kForestTreeTriangles, seed});
    add_materials(tree_kind(kind), seed, paints[kind]);
  });
  made.paint.materials.push_back({"ground", {0.12f, 0.13f, 0.05f}});
  scene.meshes[0].look.materials.assign(scene.meshes[0].triangles.size(), 0);
  for (size_t kind = 0; kind < kTreeKinds; ++kind) {
    const auto material = uint32_t(made.paint.materials.size()),
               picture = uint32_t(made.paint.pictures.size());
    for (uint32_t& m : scene.meshes[1 + kind].look.materials) m += material;
    for (mesh::PaintedMaterial& m : paints[kind].materials) {
      if (m.picture != mesh::kNoTexture) m.picture += picture;
      made.paint.materials.push_back(m);
    }
    std::ranges::move(paints[kind].pictures, std::back_inserter(made.paint.pictures));
  }
  const std::vector<ForestPlace> places =
      smallest_plan<ForestPlace>(request.instances, Random(request.seed, kForestStream, UINT64_MAX),
                                 [&](uint32_t plots) { return ForestPlanner(request.seed, plots); });
  const std::array<uint32_t, 1 + kTreeKinds> variants{1, 1, 1, 1, 1, 1};
  place_all(places, std::span<const uint32_t>(variants), request.seed, scene);
  double half = 0;
  for (const ForestPlace& place : places) half = std::max(half, place.position[0]);
  const Double3 plot = places[0].position;
  scene.cameras = {
      camera("overview", {-0.9 * half, 0.45 * half + 16, 1.25 * half}, {0, 2, 0}, 45),
      camera("clearing", {-7, 1.7 + ground_height(-7 - plot[0], 4 - plot[2]), 4}, {6, 4.5, -3}, 60),
      camera("crowns", {-3, 9, 7}, {5, 4, -9}, 55)};
  return made;
}

}  // namespace nif::generate
