// First hits that the runtime finds, compared with Embree's on the source mesh.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "bake/oracle/ray_sets.hpp"
#include "nif/nif.h"

namespace nif::tools {

/// What is stated of the first hits of a ray set (docs/ray-sets.md). Counts are of rays.
struct HitAccuracy {
  uint64_t rays = 0;
  uint64_t missed = 0;        ///< meet a triangle, and no hit was found
  uint64_t false_hits = 0;    ///< meet no triangle, and a hit was found
  uint64_t certain = 0;       ///< NifHits::certain
  uint64_t bounds_wrong = 0;  ///< the true hit lies outside of t_low..t_high, without a doubt: must be 0
  uint64_t triangles = 0;     ///< of the rays that both sides call hits, those for which a triangle was named
  uint64_t displaced = 0;     ///< of those, more than kDisplaced from Embree's hit
  uint64_t named = 0;         ///< of the same, those whose triangle is one of the source mesh
  uint64_t otherwise = 0;     ///< of those, where Embree names another triangle
  uint64_t misnamed =
      0;  ///< and where u and v on that triangle are more than kDisplaced from the hit: must be 0

  // Of the rays that both sides call hits:
  std::vector<float> place;   ///< distance from the true hit, in diagonals of the object's bounds
  std::vector<float> voxels;  ///< the same in voxels, of objects that have some
  std::vector<float> angle;   ///< between the normal and the true one, in degrees

  HitAccuracy& operator+=(const HitAccuracy& other);
};

using SetHits = std::array<HitAccuracy, bake::kRaySets.size()>;  ///< by RaySet

/// Distances in diagonals: what counts as another place on a triangle, and by how much the bounds are widened
/// before the true hit must lie within them, since Embree rounds, too.
inline constexpr double kDisplaced = 1e-6, kBoundsTolerance = 1e-5;

/// What the distances of an object are measured in.
struct ObjectScale {
  double diagonal;         ///< of its bounds
  double voxels_per_unit;  ///< 0: it has no grid
};

/// The mesh that an object was baked from, where its hits name the triangles of that.
struct SourceMesh {
  const mesh::Mesh& mesh;
  std::vector<uint32_t> numbers;  ///< of each of the oracle's triangles
};

/// Asks the scene for the first hits of all rays and compares them with the oracle's, in parallel. Figures do
/// not depend on the number of threads. `source` may be null.
HitAccuracy evaluate_hits(std::span<const bake::Segment> segments, NifScene scene, const bake::Oracle& oracle,
                          const ObjectScale& scale, const SourceMesh* source);

/// The rays whose first hits differ between the two in any bit of any output.
uint64_t different_hits(std::span<const bake::Segment> segments, NifScene scene, NifScene reference);

inline constexpr std::array kPercentiles{0.50, 0.90, 0.95, 0.99};
using Percentiles = std::array<double, kPercentiles.size()>;
/// For each share the smallest value that this share of them does not exceed. There must be some values.
Percentiles percentiles_of(std::vector<float> values);

}  // namespace nif::tools
