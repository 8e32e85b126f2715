#include "bake/encoding.hpp"

#include <fmt/format.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>

#include "kernels/reference/bvh/query.hpp"
#include "kernels/reference/segment/query.hpp"

namespace nif::bake {
namespace {

constexpr size_t kWorkRays = 10'000, kErrorRays = 50'000;

/// What was counted over some rays.
struct Count {
  uint64_t rays = 0;
  uint64_t voxels = 0, ambiguous = 0;  ///< of a field, see below; rays that the network is asked
  uint64_t nodes = 0, leaves = 0;      ///< of a BVH

  Count operator+(const Count& other) const {
    return {rays + other.rays, voxels + other.voxels, ambiguous + other.ambiguous, nodes + other.nodes,
            leaves + other.leaves};
  }
};

// Nanoseconds, by least squares over times of the AVX-512 kernels on the meshes of docs/results/encoding.md.
constexpr double kVoxel = 6.5, kAmbiguous = 55, kNode = 45, kLeaf = 35;

double work_of(const Count& count) {
  if (count.rays == 0) return 0;
  return (kVoxel * double(count.voxels) + kAmbiguous * double(count.ambiguous) + kNode * double(count.nodes) +
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

/// "12", "1.2": two digits at least.
std::string digits(double value) { return fmt::format("{:.{}f}", value, value < 9.95 ? 1 : 0); }

}  // namespace

EncodingCost cost_of_field(const format::SegmentData& data, uint64_t network_bytes) {
  EncodingCost cost;
  cost.bytes = bytes_of(data.brick_table) + bytes_of(data.brick_states) + bytes_of(data.brick_corners) +
               bytes_of(data.corner_base) + bytes_of(data.features) + network_bytes;
  return cost;
}

EncodingCost cost_of_bvh(const format::Bvh& bvh) {
  EncodingCost cost;
  cost.bytes = bvh.bytes();
  cost.error = 0;
  return cost;
}

double work_of(const kernels::SegmentField& field, const RaySource& source, uint64_t seed) {
  return count_work(source, seed, [&](const Segment& segment, Count& count) {
    // Only voxels of mixed bricks: a fast walk leaps over the others.
    kernels::Walk walk;
    kernels::walk_segment(field, segment, walk, [&](const int32_t(&voxel)[3]) {
      const uint32_t x = uint32_t(voxel[0]) / kernels::kBrickSide,
                     y = uint32_t(voxel[1]) / kernels::kBrickSide,
                     z = uint32_t(voxel[2]) / kernels::kBrickSide;
      const uint16_t entry = field.brick_table[x + field.bricks[0] * (y + field.bricks[1] * z)];
      count.voxels += entry >= kernels::kFirstMixedBrick;
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
