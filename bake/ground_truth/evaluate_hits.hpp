// Measures the accuracy of an asset's first hits against Embree's on the source mesh.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "bake/ground_truth/ray_sets.hpp"
#include "formats/mesh/mesh_scene.hpp"

namespace nif::bake {

inline constexpr std::array kPercentiles{0.50, 0.90, 0.95, 0.99};
using Percentiles = std::array<double, kPercentiles.size()>;
/// For each share the smallest value that this share of the values does not exceed. There must be some
/// values.
Percentiles percentiles_of(std::vector<float> values);

/// The figures stated for the first hits of a ray set (docs/ray-sets.md). Counts are of rays.
struct HitCounts {
  uint64_t rays = 0;
  uint64_t missed = 0;        ///< a triangle is met, but no hit was found
  uint64_t false_hits = 0;    ///< no triangle is met, but a hit was found
  uint64_t certain = 0;       ///< it is proven that something is met, or that nothing is
  uint64_t bounds_wrong = 0;  ///< the true hit undoubtedly lies outside low..high: must be 0
  uint64_t triangles = 0;     ///< of the rays that both sides call hits, those with a named triangle
  uint64_t displaced = 0;     ///< of those, more than kDisplaced from Embree's hit
  uint64_t named = 0;         ///< likewise, those whose triangle belongs to the source mesh
  uint64_t otherwise = 0;     ///< of those, the ones for which Embree names another triangle
  /// And those for which u and v on that triangle are more than kDisplaced from the hit: must be 0.
  uint64_t misnamed = 0;

  double rate(uint64_t count) const { return rays ? double(count) / double(rays) : 0; }
};

/// Also for the rays that both sides call hits; none if there are none.
struct HitFigures : HitCounts {
  uint64_t compared = 0;
  std::optional<Percentiles> place;   ///< distance from the true hit, in diagonals of the object's bounds
  std::optional<Percentiles> voxels;  ///< the same in voxels, for objects that have any
  std::optional<Percentiles> angle;   ///< between the normal and the true one, in degrees
};

/// The same during the measurement, with every single value.
struct HitAccuracy : HitCounts {
  std::vector<float> place, voxels, angle;

  HitAccuracy& operator+=(const HitAccuracy& other);
  HitFigures figures() const;
};

using SetHits = std::array<HitAccuracy, kAllRaySets.size()>;       ///< by RaySet
using SetHitFigures = std::array<HitFigures, kAllRaySets.size()>;  ///< by RaySet
SetHitFigures figures_of(const SetHits& sets);

/// Distances in diagonals: what counts as another position on a triangle, and how much the bounds are widened
/// before the true hit must lie within them, since Embree rounds, too.
inline constexpr double kDisplaced = 1e-6, kBoundsTolerance = 1e-5;

/// The units for the distances of an object.
struct ObjectScale {
  double diagonal;         ///< of its bounds
  double voxels_per_unit;  ///< 0: it has no grid
};

/// The mesh that an object was baked from, if its hits name triangles of that mesh.
struct SourceMesh {
  const mesh::Mesh& mesh;
  std::vector<uint32_t> numbers;  ///< of each of the ground truth's triangles
};

/// The first hits of consecutive segments; each array has one entry per segment. As in NifHits.
struct FirstHits {
  static constexpr uint32_t kNoTriangle = 0xffffffff;  ///< for `triangle`: none can be named

  std::vector<uint8_t> hit, certain;
  std::vector<float> t, u, v, low, high;
  std::vector<std::array<float, 3>> normal;
  std::vector<uint32_t> triangle;

  explicit FirstHits(size_t count)
      : hit(count),
        certain(count),
        t(count),
        u(count),
        v(count),
        low(count),
        high(count),
        normal(count),
        triangle(count) {}
};
/// Finds those of consecutive segments, at least one; called from several threads at once.
using HitFinder = std::function<FirstHits(std::span<const Segment>)>;

/// Compares the hits with the ground truth, in parallel. Figures do not depend on the number of threads.
/// `source` may be null.
HitAccuracy evaluate_hits(std::span<const Segment> segments, const HitFinder& find, const EmbreeTruth& embree,
                          const ObjectScale& scale, const SourceMesh* source = nullptr);

}  // namespace nif::bake
