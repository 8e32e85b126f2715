#include "bake/encoding.hpp"

#include <fmt/format.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <cstdlib>

#include "kernels/cpu/walk_grid.hpp"
#include "kernels/reference/bvh.hpp"
#include "kernels/reference/segment.hpp"

namespace nif::bake {
namespace {

constexpr size_t kWorkRays = 10'000, kErrorRays = 50'000;

/// What was counted over some rays.
struct Count {
  uint64_t rays = 0;
  uint64_t leaps = 0, ambiguous = 0;  ///< of a field: steps of the SIMD walk; rays that the network is asked
  uint64_t nodes = 0, leaves = 0;     ///< of a BVH

  Count operator+(const Count& other) const {
    return {rays + other.rays, leaps + other.leaps, ambiguous + other.ambiguous, nodes + other.nodes,
            leaves + other.leaves};
  }
};

// Nanoseconds, by least squares over the times that docs/results/encoding.md is about (AVX-512, Zen 4).
constexpr double kLeap = 9, kAmbiguous = 110, kNode = 40, kLeaf = 35;

double work_of(const Count& count) {
  if (count.rays == 0) return 0;
  return (kLeap * double(count.leaps) + kAmbiguous * double(count.ambiguous) + kNode * double(count.nodes) +
          kLeaf * double(count.leaves)) /
         double(count.rays);
}

/// Sums `count_one` over the rays of both sets; integers, so that the order of adding does not matter.
template <class CountOne>
double count_work(const RaySource& source, uint64_t seed, const CountOne& count_one) {
  double work = 0;
  for (RaySet set : {RaySet::outer_lines, RaySet::inner_surface}) {
    const LabelledRays rays = make_ray_set(source, set, kWorkRays, seed);
    const Count sum = tbb::parallel_reduce(
        tbb::blocked_range<size_t>(0, rays.segments.size(), 256), Count{},
        [&](const tbb::blocked_range<size_t>& range, Count part) {
          for (size_t i = range.begin(); i < range.end(); ++i) {
            ++part.rays;
            count_one(rays.segments[i], part);
          }
          return part;
        },
        [](const Count& a, const Count& b) { return a + b; });
    work += work_of(sum) / 2;
  }
  return work;
}

template <class T>
uint64_t bytes_of(const std::vector<T>& values) {
  return values.size() * sizeof(T);
}

/// Words of the walk's own grid, which a runtime with SIMD kernels makes for itself.
uint64_t walk_grid_bytes(const format::Object& object) {
  const uint64_t voxels = uint64_t(object.voxels[0]) * object.voxels[1] * object.voxels[2];
  return voxels <= kernels::cpu::kMaxGridVoxels ? (voxels / 8 + 1) * sizeof(uint32_t) : 0;
}

/// "12", "1.2": two digits at least.
std::string digits(double value) { return fmt::format("{:.{}f}", value, value < 9.95 ? 1 : 0); }

}  // namespace

std::string_view name_of(format::Encoding encoding) {
  switch (encoding) {
    case format::kSegment:
      return "segment";
    case format::kSpherical:
      return "spherical";
    case format::kBvh:
      return "bvh";
  }
  return "";
}

uint64_t file_bytes_of_field(const format::Object& object, uint64_t network_bytes) {
  return bytes_of(object.brick_table) + bytes_of(object.brick_states) + bytes_of(object.brick_corners) +
         bytes_of(object.corner_base) + bytes_of(object.features) + network_bytes;
}

EncodingCost cost_of_field(const format::Object& object, uint64_t network_bytes) {
  EncodingCost cost;
  cost.bytes = file_bytes_of_field(object, network_bytes) + walk_grid_bytes(object);
  return cost;
}

EncodingCost cost_of_bvh(const format::Bvh& bvh) {
  EncodingCost cost;
  cost.bytes = bvh.bytes();
  cost.error = 0;
  return cost;
}

double work_of(const kernels::SegmentField& field, const RaySource& source, uint64_t seed) {
  const uint64_t voxels = uint64_t(field.voxels[0]) * field.voxels[1] * field.voxels[2];
  std::optional<kernels::cpu::WalkGrid> grid;
  if (voxels <= kernels::cpu::kMaxGridVoxels) grid.emplace(field, std::pmr::get_default_resource());
  return count_work(source, seed, [&](const Segment& segment, Count& count) {
    // A leap ends where the walk leaves the cube of voxels that are less than its distance away.
    int32_t start[3] = {}, distance = 0;
    kernels::Walk walk;
    kernels::walk_segment(field, segment, walk, [&](const int32_t(&voxel)[3]) {
      if (std::abs(voxel[0] - start[0]) < distance && std::abs(voxel[1] - start[1]) < distance &&
          std::abs(voxel[2] - start[2]) < distance)
        return;
      ++count.leaps;
      std::copy(voxel, voxel + 3, start);
      const uint64_t n =
          uint64_t(voxel[0]) + field.voxels[0] * (uint64_t(voxel[1]) + field.voxels[1] * uint64_t(voxel[2]));
      distance = grid ? int32_t(kernels::cpu::kCodeDistance[grid->codes[n / 8] >> (4 * (n % 8)) & 15]) : 1;
    });
    count.ambiguous += walk.verdict == kernels::Verdict::ambiguous;
  });
}

double work_of(const kernels::BvhField& field, const RaySource& source, uint64_t seed) {
  return count_work(source, seed, [&](const Segment& segment, Count& count) {
    kernels::BvhRay ray;
    if (!kernels::prepare_ray(field, segment, ray)) return;
    kernels::BvhWork work;
    kernels::meets_bvh(field, ray, &work);
    count.nodes += work.nodes;
    count.leaves += work.leaves;
  });
}

WorstError worst_error(const Answerer& answer, const RaySource& source, uint64_t seed) {
  WorstError worst;
  for (RaySet set : kRaySets) {
    if (set == RaySet::sun) continue;
    const double error = evaluate(make_ray_set(source, set, kErrorRays, seed), answer, source.oracle).error();
    if (error > worst.error) worst = {error, set};
  }
  return worst;
}

double gain_of(const EncodingCost& field, const EncodingCost& bvh) {
  const double faster = field.work > 0 && bvh.work > 0 ? bvh.work / field.work : 1;
  return double(bvh.bytes) / double(field.bytes) * faster;
}

std::string describe_gain(const EncodingCost& field, const EncodingCost& bvh) {
  const double smaller = double(bvh.bytes) / double(field.bytes);
  return fmt::format("1/{} as large and {} times as fast", digits(smaller),
                     digits(gain_of(field, bvh) / smaller));
}

}  // namespace nif::bake
