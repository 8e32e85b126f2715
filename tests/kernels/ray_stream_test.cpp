// Streams of rays choose the rays that the scalar box test chooses, and bring them to object space with its bits:
// also those with infinities, NaN, and origins on planes of boxes.
#include "kernels/cpu/top_level/ray_stream.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <memory>
#include <vector>

#include "kernels/reference/batch.hpp"
#include "kernels/reference/scene_hit.hpp"
#include "tests/support/test_random.hpp"

namespace nif::test {
namespace {

using kernels::Segment;
using kernels::WorldBox;
using kernels::cpu::Isa;
using kernels::cpu::RayStream;

constexpr float kInfinity = std::numeric_limits<float>::infinity();

/// Small whole numbers, so that origins lie on planes of boxes; sometimes what is hard to compute with.
float coordinate(Random& random) {
  constexpr float kHard[] = {0.0f,     -0.0f,  kInfinity, -kInfinity, std::numeric_limits<float>::quiet_NaN(),
                             0x1p126f, -1e30f, 0x1p-126f, 0x1p-140f,  3e38f};
  return random.below(40) == 0 ? kHard[random.below(std::size(kHard))] : float(random.between(-4, 4)) * 0.5f;
}

Segment random_ray(Random& random) {
  Segment ray;
  for (int a = 0; a < 3; ++a) {
    ray.origin[a] = coordinate(random);
    ray.direction[a] = random.below(3) == 0 ? 0 : coordinate(random);
  }
  ray.tmin = random.below(8) == 0 ? coordinate(random) : 0;
  ray.tmax = random.below(4) == 0 ? coordinate(random) : kInfinity;
  return ray;
}

WorldBox random_box(Random& random) {
  WorldBox box;
  for (int a = 0; a < 3; ++a) {
    box.min[a] = float(random.between(-4, 3)) * 0.5f;
    box.max[a] = box.min[a] + float(random.below(14)) * 0.5f;
    if (random.below(30) == 0) box.min[a] = -kInfinity;
    if (random.below(30) == 0) box.max[a] = kInfinity;
  }
  return box;
}

bool same_bits(const Segment& a, const Segment& b) { return std::memcmp(&a, &b, sizeof(a)) == 0; }

Segment ray_of(const RayStream& stream, uint32_t k) {
  return {{stream.origin[0][k], stream.origin[1][k], stream.origin[2][k]},
          {stream.direction[0][k], stream.direction[1][k], stream.direction[2][k]},
          stream.tmin[k],
          stream.tmax[k]};
}

class RayStreams : public testing::TestWithParam<Isa> {
 protected:
  void SetUp() override {
    if (!kernels::cpu::available(GetParam())) GTEST_SKIP() << "this machine does not have it";
  }
  /// Draws rays, and starts the stream with them. Checks which are in it. `all`: none of them meets no box.
  void start(Random& random, uint32_t count, bool masked, bool all = false) {
    batch_->count = count;
    for (uint32_t i = 0; i < count; ++i) {
      set_segment(*batch_, i,
                  all ? Segment{{0, float(i), 1}, {1, 0.5f, 2}, 0, kInfinity} : random_ray(random));
      masks_[i] = masked ? random.below(16) : ~0u;
    }
    functions().start(*batch_, masked ? masks_ : nullptr, *stream_);
    uint32_t k = 0;
    for (uint32_t i = 0; i < count; ++i) {
      const Segment ray = segment_of(*batch_, i);
      kernels::BoxRay prepared;
      if (!prepare_box_ray(ray, prepared)) continue;
      ASSERT_LT(k, stream_->count);
      ASSERT_EQ(stream_->ray[k], i);
      ASSERT_EQ(stream_->mask[k], masks_[i]);
      ASSERT_TRUE(same_bits(ray_of(*stream_, k), ray));
      for (int a = 0; a < 3; ++a) ASSERT_EQ(stream_->inverse[a][k], prepared.inverse[a]);
      ++k;
    }
    ASSERT_EQ(stream_->count, k);
  }
  bool meets(uint32_t k, const WorldBox& box) const {
    const kernels::BoxRay prepared{{stream_->inverse[0][k], stream_->inverse[1][k], stream_->inverse[2][k]}};
    return may_meet(box, ray_of(*stream_, k), prepared);
  }
  static const kernels::cpu::StreamFunctions& functions() {
    return kernels::cpu::stream_functions(GetParam());
  }

  std::unique_ptr<kernels::SegmentBatch> batch_ = std::make_unique<kernels::SegmentBatch>(),
                                         local_ = std::make_unique<kernels::SegmentBatch>();
  std::unique_ptr<RayStream> stream_ = std::make_unique<RayStream>(),
                             narrowed_ = std::make_unique<RayStream>();
  uint32_t masks_[kernels::kBatchRoom], entries_[kernels::kBatchRoom];
};

TEST_P(RayStreams, MeetWhatTheScalarTestMeets) {
  Random random(1);
  uint32_t met = 0, missed = 0;
  for (const uint32_t count : {0u, 1u, 2u, 15u, 16u, 17u, 100u, 1000u, kernels::kBatchRays})
    for (int round = 0; round < 20; ++round) {
      ASSERT_NO_FATAL_FAILURE(start(random, count, random.below(2) == 0));
      const WorldBox box = random_box(random);
      const float transform[12] = {2, 0.5f, 0, 1, 0, 1, -0.25f, 0, 0.125f, 0, 1, -3};
      const float remainder[3] = {0x1p-30f, 0, -0x1p-28f};
      kernels::WorldToObject to_object;
      bool well_conditioned;
      ASSERT_TRUE(kernels::invert(transform, to_object, well_conditioned, remainder));
      const bool identity = round % 2 == 0;
      const uint32_t mask = round % 3 == 0 ? ~0u : 1 + random.below(15);
      functions().meet(*stream_, {box, identity ? nullptr : &to_object, mask}, *local_, entries_);
      uint32_t found = 0;
      for (uint32_t k = 0; k < stream_->count; ++k) {
        if (!(stream_->mask[k] & mask) || !meets(k, box)) continue;
        const Segment ray = ray_of(*stream_, k);
        ASSERT_LT(found, local_->count);
        ASSERT_EQ(entries_[found], k);
        ASSERT_TRUE(
            same_bits(segment_of(*local_, found), identity ? ray : kernels::to_object(to_object, ray)));
        ++found;
      }
      ASSERT_EQ(local_->count, found);
      met += found;
      missed += stream_->count - found;

      functions().narrow(*stream_, box, *narrowed_, entries_);
      found = 0;
      for (uint32_t k = 0; k < stream_->count; ++k) {
        if (!meets(k, box)) continue;
        ASSERT_LT(found, narrowed_->count);
        ASSERT_EQ(entries_[found], k);
        ASSERT_EQ(narrowed_->ray[found], stream_->ray[k]);
        ASSERT_EQ(narrowed_->mask[found], stream_->mask[k]);
        ASSERT_TRUE(same_bits(ray_of(*narrowed_, found), ray_of(*stream_, k)));
        ++found;
      }
      ASSERT_EQ(narrowed_->count, found);
    }
  EXPECT_GT(met, 2'000u);
  EXPECT_GT(missed, 10'000u);
}

/// A random hit, often at a t that others have, too.
kernels::Hit random_hit(Random& random) {
  kernels::Hit hit = kernels::no_hit(random.below(2) == 0);
  if (random.below(3) == 0) return hit;
  hit.t = float(random.below(6)) * 0.5f;
  if (random.below(4) == 0) hit.t = -hit.t;
  hit.low = -kInfinity;
  if (random.below(2) == 0) hit.low = hit.high = hit.t;
  for (float& n : hit.normal) n = random.between(-1.0f, 1.0f);
  hit.triangle = random.below(100);
  hit.u = random.unit();
  hit.v = random.unit();
  return hit;
}

TEST_P(RayStreams, JoinHitsAsTheScalarCodeDoes) {
  Random random(3);
  const auto met = std::make_unique<kernels::HitBatch>(), hits = std::make_unique<kernels::HitBatch>();
  uint32_t instances[kernels::kBatchRoom], changed = 0, kept = 0, forgotten = 0;
  for (const uint32_t count : {1u, 15u, 17u, 100u, 1000u, kernels::kBatchRays})
    for (int round = 0; round < 40; ++round) {
      // Half of the time all rays are met, so that they follow each other, as those of neighbouring pixels may.
      const bool all = round >= 20;
      ASSERT_NO_FATAL_FAILURE(start(random, count, false, all));
      const WorldBox box = all ? WorldBox{{-1, -1, -1}, {1e9f, 1e9f, 1e9f}} : random_box(random);
      const float transform[12] = {2, 0.5f, 0, 1, 0, 1, -0.25f, 0, 0.125f, 0, 1, -3};
      const float remainder[3] = {0x1p-30f, 0, 0};
      kernels::PlacedInstance instance{};
      bool well_conditioned;
      ASSERT_TRUE(kernels::invert(transform, instance.to_object, well_conditioned,
                                  round % 2 == 0 ? remainder : nullptr));
      instance.identity = round % 3 == 0;
      instance.unproven = round % 7 == 0;
      instance.well_conditioned = round % 5 != 0;
      functions().meet(*stream_, {box, instance.identity ? nullptr : &instance.to_object, ~0u}, *local_,
                       entries_);
      ASSERT_TRUE(!all || local_->count == count);
      const uint32_t number = random.below(3) == 0 ? 0x7ffffffeu : random.below(5);
      const float reach_scale = round % 4 == 0 ? 1e4f : 1.0f;
      std::vector<kernels::SceneHit> expected(count);
      std::vector<bool> shortened;
      for (uint32_t i = 0; i < count; ++i) {
        kernels::SceneHit before;
        before.add(random_hit(random), random.below(5));
        kernels::set_hit(*hits, i, before);
        instances[i] = before.instance;
        expected[i] = before;
      }
      for (uint32_t k = 0; k < local_->count; ++k) {
        kernels::Hit hit = random_hit(random);
        kernels::set_hit(*met, k, hit);
        const uint32_t entry = entries_[k], i = stream_->ray[entry];
        if (!stays_certain(instance, reach_scale, ray_of(*stream_, entry), segment_of(*local_, k))) {
          kernels::forget_proof(hit);
          ++forgotten;
        }
        const kernels::BoxRay prepared{
            {stream_->inverse[0][entry], stream_->inverse[1][entry], stream_->inverse[2][entry]}};
        kernels::begin_in_box(hit, kernels::pass_box(box, ray_of(*stream_, entry), prepared).enter);
        const uint32_t instance_before = expected[i].instance;
        const float low_before = expected[i].low, high_before = expected[i].high;
        expected[i].add(hit, number);
        (expected[i].instance == instance_before ? kept : changed) += 1;
        shortened.push_back(expected[i].low < low_before || expected[i].high < high_before);
      }
      functions().join(*stream_, box,
                       {.entries = entries_,
                        .local = *local_,
                        .met = *met,
                        .instance = instance,
                        .number = number,
                        .reach_scale = reach_scale},
                       *hits, instances);
      for (uint32_t i = 0; i < count; ++i) {
        const kernels::Hit found = kernels::hit_of(*hits, i), &wanted = expected[i];
        ASSERT_EQ(std::memcmp(&found, &wanted, sizeof(found)), 0) << found.t << ' ' << wanted.t;
        ASSERT_EQ(instances[i], expected[i].instance);
      }
      uint32_t dropped = 0;
      for (uint32_t k = 0; k < local_->count; ++k) {
        // What changes a ray's bounds ends it at the proven hit.
        const uint32_t entry = entries_[k], i = stream_->ray[entry];
        const Segment ray = segment_of(*batch_, i);
        const float end = kernels::min_of(hits->high[i], ray.tmax);
        if (shortened[k])
          ASSERT_TRUE(ray.tmin <= end ? stream_->tmax[entry] == end
                                      : !(stream_->tmin[entry] <= stream_->tmax[entry]));
        else
          ASSERT_EQ(stream_->tmax[entry], ray.tmax);
        dropped += shortened[k] && !(ray.tmin <= end);
      }
      ASSERT_EQ(stream_->dropped, dropped);
    }
  EXPECT_GT(changed, 500u);
  EXPECT_GT(kept, 500u);
  EXPECT_GT(forgotten, 500u);
}

TEST_P(RayStreams, TurnNormalsAsTheScalarCodeDoes) {
  Random random(7);
  const auto number = [&] { return random.below(4) == 0 ? 0 : float(random.between(-999, 999)) * 0x1p-9f; };
  const auto hits = std::make_unique<kernels::HitBatch>(), expected = std::make_unique<kernels::HitBatch>();
  for (uint32_t round = 0; round < 300; ++round) {
    std::vector<kernels::PlacedInstance> instances(1 + random.below(5));
    for (kernels::PlacedInstance& instance : instances) {
      instance.identity = random.below(2) == 0;
      for (float& entry : instance.to_object.inverse) entry = number();
    }
    batch_->count = 1 + random.below(40);
    std::vector<uint32_t> in(kernels::kBatchRoom, 0);
    for (uint32_t i = 0; i < batch_->count; ++i) {
      Segment ray = random_ray(random);
      for (float& component : ray.direction) component = number();
      ray.direction[random.below(3)] = 1;
      set_segment(*batch_, i, ray);
      in[i] = random.below(4) == 0 ? kernels::kNoInstance : random.below(uint32_t(instances.size()));
      const bool none = random.below(8) == 0;  // then the way back is the normal
      float normal[3], turned[3];
      for (int a = 0; a < 3; ++a) turned[a] = normal[a] = hits->normal[a][i] = none ? 0 : number();
      if (in[i] != kernels::kNoInstance) {
        const kernels::PlacedInstance& instance = instances[in[i]];
        kernels::world_normal(instance.identity ? nullptr : &instance.to_object, normal, ray.direction,
                              turned);
      }
      for (int a = 0; a < 3; ++a) expected->normal[a][i] = turned[a];
    }
    functions().turn(*batch_, instances.data(), in.data(), *hits);
    for (int a = 0; a < 3; ++a)
      ASSERT_EQ(std::memcmp(hits->normal[a], expected->normal[a], batch_->count * sizeof(float)), 0) << round;
  }
}

TEST_P(RayStreams, FindUnprovenRaysAsTheScalarCodeDoes) {
  Random random(11);
  uint32_t proven = 0, unproven = 0, empty = 0;
  for (uint32_t round = 0; round < 400; ++round) {
    kernels::PlacedInstance instance{};
    const float transform[12] = {2, 0.5f, 0, 1, 0, 1, -0.25f, 0, 0.125f, 0, 1, -3};
    const float remainder[3] = {0x1p-30f, 0, 0};
    bool well_conditioned;
    ASSERT_TRUE(kernels::invert(transform, instance.to_object, well_conditioned,
                                round % 2 == 0 ? remainder : nullptr));
    instance.identity = round % 7 == 6;
    instance.unproven = instance.identity || round % 7 == 5;
    instance.well_conditioned = round % 5 != 0;
    const uint32_t count = 1 + random.below(100);
    const float reach_scale = random.between(0.0f, 200.0f);
    batch_->count = local_->count = count;
    std::vector<uint32_t> numbers(kernels::kBatchRoom, 0), found(kernels::kBatchRoom);
    const bool in_order = round % 3 == 0;
    for (uint32_t i = 0; i < count; ++i) set_segment(*batch_, i, random_ray(random));
    for (uint32_t k = 0; k < count; ++k) {
      numbers[k] = in_order ? k : random.below(count);
      const Segment ray = segment_of(*batch_, numbers[k]);
      set_segment(*local_, k, instance.identity ? ray : to_object(instance.to_object, ray));
    }
    std::vector<uint32_t> expected;
    for (uint32_t k = 0; k < count; ++k) {
      const Segment ray = segment_of(*batch_, numbers[k]);
      const bool stays = stays_certain(instance, reach_scale, ray, segment_of(*local_, k));
      if (!stays) expected.push_back(k);
      (ray.tmin > ray.tmax ? empty : stays ? proven : unproven) += 1;
    }
    const uint32_t unproven_here = functions().find_unproven(*batch_, in_order ? nullptr : numbers.data(),
                                                             *local_, instance, reach_scale, found.data());
    found.resize(unproven_here);
    ASSERT_EQ(found, expected) << round;
    if (in_order) continue;
    ASSERT_EQ(
        functions().find_unproven(*batch_, numbers.data(), *local_, instance, reach_scale, numbers.data()),
        unproven_here);
    numbers.resize(unproven_here);
    ASSERT_EQ(numbers, expected) << round;
  }
  EXPECT_GT(proven, 1000u);
  EXPECT_GT(unproven, 1000u);
  EXPECT_GT(empty, 0u);
}

TEST_P(RayStreams, LoseDroppedRaysAndNoOthers) {
  Random random(2);
  for (const uint32_t count : {1u, 16u, 33u, 1000u, kernels::kBatchRays}) {
    ASSERT_NO_FATAL_FAILURE(start(random, count, random.below(2) == 0));
    std::vector<uint32_t> kept;
    std::vector<Segment> rays;
    for (uint32_t k = 0; k < stream_->count; ++k)
      if (random.below(3) == 0) {
        stream_->drop(k);
      } else {
        kept.push_back(stream_->ray[k]);
        rays.push_back(ray_of(*stream_, k));
      }
    // Dropped rays meet nothing, whatever the box.
    const WorldBox all{{-kInfinity, -kInfinity, -kInfinity}, {kInfinity, kInfinity, kInfinity}};
    functions().meet(*stream_, {all, nullptr, ~0u}, *local_, entries_);
    for (uint32_t k = 0; k < local_->count; ++k) EXPECT_LE(local_->tmin[k], local_->tmax[k]);
    functions().pack(*stream_);
    ASSERT_EQ(stream_->count, kept.size());
    EXPECT_EQ(stream_->dropped, 0u);
    for (uint32_t k = 0; k < stream_->count; ++k) {
      EXPECT_EQ(stream_->ray[k], kept[k]);
      EXPECT_TRUE(same_bits(ray_of(*stream_, k), rays[k]));
    }
  }
}

const char* name_of(const testing::TestParamInfo<Isa>& info) {
  constexpr const char* kNames[] = {"sse4", "avx2", "avx512", "neon"};
  return kNames[size_t(info.param)];
}
INSTANTIATE_TEST_SUITE_P(Each, RayStreams, testing::Values(Isa::sse4, Isa::avx2, Isa::avx512, Isa::neon),
                         name_of);

}  // namespace
}  // namespace nif::test
