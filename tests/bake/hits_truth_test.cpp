// Compares first hits of objects with triangles with Embree's. Embree computes in single precision, so from
// far away or at a flat angle it is less exact than the tested code. If the two differ, CGAL's exact
// predicates decide: nothing may be hit before the hit, and something must be hit there.
//
// The hits of `exact` objects are those of `bvh` objects, bit by bit (exact_object_test.cpp).
#include <gtest/gtest.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <mutex>

#include "bake/ground_truth/prepare.hpp"
#include "bake/ground_truth/ray_sets.hpp"
#include "bake/triangles/builder.hpp"
#include "formats/base/vector.hpp"
#include "formats/mesh/read.hpp"
#include "formats/nif/triangles/triangles_part.hpp"
#include "kernels/reference/triangles/triangles_hit.hpp"
#include "tests/bake/exact_truth.hpp"
#include "tests/bake/hard_shapes.hpp"
#include "tests/support/real_meshes.hpp"

namespace nif::test {
namespace {

using kernels::Hit;
using kernels::kNoHit;
using kernels::Segment;

/// Built on first use, because that takes longer than most comparisons.
class LateTruth {
 public:
  explicit LateTruth(const bake::Prepared& prepared) : prepared_(prepared) {}
  const ExactTruth& get() {
    std::call_once(built_, [&] {
      embree_ = std::make_unique<ExactTruth>(prepared_.surface.positions, prepared_.surface.triangles);
    });
    return *embree_;
  }

 private:
  const bake::Prepared& prepared_;
  std::once_flag built_;
  std::unique_ptr<ExactTruth> embree_;
};

struct Tally {
  std::atomic<uint64_t> rays = 0, hits = 0, doubted = 0, wrong = 0;
};

/// Whether a hit is right within the length `off`, by exact predicates. At the very ends of a segment,
/// rounding in double precision decides.
bool is_right(const ExactTruth& exact, const Segment& ray, const Hit& hit, double off, double reach) {
  const auto steps = static_cast<float>(off / length(to_double(std::to_array(ray.direction))));
  const bool met = hit.t < kNoHit;
  Segment before = ray;
  before.tmin = ray.tmin + steps;
  before.tmax = (met ? hit.t : ray.tmax) - steps;
  if (before.tmin <= before.tmax && exact.occluded(before, reach)) return false;
  if (!met) return true;
  Segment there = ray;
  there.tmin = ray.tmin - steps;
  there.tmax = hit.t + steps;
  return exact.occluded(there, reach);
}

void compare(const mesh::Mesh& mesh, uint64_t rays_of_set, Tally& tally) {
  const bake::Prepared prepared = bake::prepare(mesh);
  if (!bake::fits_bvh(prepared.surface.positions)) return;
  const format::TrianglesData bvh = bake::build_bvh(prepared.surface.positions, prepared.surface.triangles);
  const kernels::TrianglesField field = format::field_of(bvh);
  const bake::GroundTruth truth(prepared);
  LateTruth exact(prepared);
  const double off = 1e-6 * prepared.box.diagonal(), reach = 10 * prepared.box.diagonal();
  for (const bake::RaySet set : bake::kRaySets) {
    if (set == bake::RaySet::inner_volume && !truth.source().has_volume) continue;
    const std::vector<Segment> rays = bake::draw_ray_set(truth.source(), set, rays_of_set, 11).segments;
    tbb::parallel_for(size_t{0}, rays.size(), [&](size_t i) {
      const Hit hit = kernels::intersect(field, rays[i]);
      const auto embree = truth.source().embree.first_hit(rays[i]);
      const bool met = hit.t < kNoHit;
      ++tally.rays;
      tally.hits += met;
      const double direction = length(to_double(std::to_array(rays[i].direction)));
      if (met == embree.has_value() &&
          (!met || std::abs(double(hit.t) - double(embree->t)) * direction <= off))
        return;
      ++tally.doubted;
      if (is_right(exact.get(), rays[i], hit, off, reach)) return;
      ++tally.wrong;
      ADD_FAILURE() << bake::name_of(set) << " ray " << i << ": t " << hit.t << ", Embree's "
                    << (embree ? embree->t : kNoHit);
    });
  }
}

TEST(HitsAgainstCgal, OfShapes) {
  for (int shape = 0; shape < kShapes; ++shape) {
    SCOPED_TRACE(shape);
    Tally tally;
    compare(make_shape(Shape(shape), 0), 10'000, tally);
    EXPECT_GT(tally.hits, 100u);
    EXPECT_EQ(tally.wrong, 0u);
  }
}

TEST(HitsOfRealMeshes, AreEmbreesOrRight) {
  if (!real_mesh_folder()) GTEST_SKIP() << "NIF_TEST_MESHES is not set";
  const uint64_t rays = segments_wanted(50'000);
  for (const std::filesystem::path& file : real_meshes(4'000'000)) {
    SCOPED_TRACE(file.filename().string());
    const mesh::Scene scene = mesh::read(file);
    Tally tally;
    // The largest object of a file stands for the others.
    compare(*std::max_element(
                scene.meshes.begin(), scene.meshes.end(),
                [](const auto& a, const auto& b) { return a.triangles.size() < b.triangles.size(); }),
            rays, tally);
    EXPECT_GT(tally.hits, 1'000u);
    EXPECT_EQ(tally.wrong, 0u);
    std::printf("%s: %llu rays, %llu hits, %llu in doubt\n", file.filename().c_str(),
                static_cast<unsigned long long>(tally.rays), static_cast<unsigned long long>(tally.hits),
                static_cast<unsigned long long>(tally.doubted));
  }
}

}  // namespace
}  // namespace nif::test
