// Objects with holes: the SIMD kernels give the reference's bits, and both what a loop over all triangles gives that looks
// texels up in its own way, as docs/answers.md describes them.
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "kernels/reference/encodings/reference_cutout.hpp"
#include "tests/kernels/each_way.hpp"
#include "tests/support/random_asset.hpp"

namespace nif::test {
namespace {

/// An alpha map as a picture, row by row.
struct Picture {
  int64_t size[2];
  uint32_t beyond[2];
  std::vector<bool> texels;

  static int64_t within(int64_t texel, int64_t size, uint32_t beyond) {
    const auto modulo = [&](int64_t by) { return ((texel % by) + by) % by; };
    if (beyond == 0) return modulo(size);
    if (beyond == 2) return std::min(std::max<int64_t>(texel, 0), size - 1);
    const int64_t r = modulo(2 * size);
    return r >= size ? 2 * size - 1 - r : r;
  }
  bool blocks(int64_t x, int64_t y) const {
    return texels[size_t(within(y, size[1], beyond[1]) * size[0] + within(x, size[0], beyond[0]))];
  }
};

Picture picture_of(const kernels::AlphaMap& map) {
  Picture picture{{map.width, map.height}, {map.wrap[0], map.wrap[1]}, {}};
  const size_t columns = (map.width + 7) / 8;
  for (uint32_t y = 0; y < map.height; ++y)
    for (uint32_t x = 0; x < map.width; ++x)
      picture.texels.push_back((map.tiles[y / 8 * columns + x / 8] >> (y % 8 * 8 + x % 8) & 1) != 0);
  return picture;
}

/// A `cutout` object.
class Cutout {
 public:
  Cutout(Random& random, const format::TrianglesData& bvh) : tree_(bvh) {
    for (uint32_t count = 1 + random.below(4); count > 0; --count) add_random_alpha_map(random, maps_);
    for (const kernels::AlphaMap& map : maps_) pictures_.push_back(picture_of(map));
    const uint32_t triangles = tree_.field().triangle_count;
    holes_ = random_holes(random, triangles, maps_);
    // Some corners at corners of texels, where rounding decides.
    for (kernels::AlphaPatch& patch : holes_.patches)
      if (random.below(3) == 0)
        for (auto& place : patch.places)
          for (int32_t& x : place) x &= ~0xffff;
    for (uint32_t i = 0; i < triangles; ++i)
      numbers_.push_back(random.below(uint32_t(holes_.patches.size()) + 1));
    if (random.below(4) == 0) std::fill(numbers_.begin(), numbers_.end(), random.below(2));
    holes_.set_numbers(numbers_);
  }
  Cutout(const Cutout&) = delete;
  Cutout& operator=(const Cutout&) = delete;

  kernels::CutoutField field() const { return {tree_.field(), format::field_of(holes_, maps_)}; }

  /// A ray to a place of a triangle where two texels touch, as nearly as singles allow.
  kernels::Segment ray_to_border(Random& random) const {
    const kernels::TrianglesField& field = tree_.field();
    const kernels::BvhNode* node = nullptr;
    uint32_t triangle = 0;
    do {
      node = field.nodes + random.below(field.node_count);
      const uint8_t slot = node->slots[random.below(kernels::kBvhWidth)];
      if (slot == 0 || kernels::slot_kind(slot) == kernels::kInnerSlot)
        node = nullptr;
      else
        triangle = node->first_triangle + kernels::slot_rank(slot) + random.below(kernels::slot_kind(slot));
    } while (!node);
    double second = double(random.unit());
    const double third = double(random.unit()) * (1 - second);
    if (numbers_[triangle] != 0) {
      const kernels::AlphaPatch& patch = holes_.patches[numbers_[triangle] - 1];
      const uint32_t a = random.below(2);
      const double p = patch.places[0][a], q = patch.places[1][a] - p, r = patch.places[2][a] - p;
      const double texel = std::ldexp(1.0, 16 - int(patch.shift));
      if (q != 0) second = (std::round((p + second * q + third * r) / texel) * texel - p - third * r) / q;
    }
    kernels::Segment ray{{}, {}, 0, std::numeric_limits<float>::infinity()};
    const float distance = random.below(2) ? 2.0f : 0.01f;
    for (int axis = 0; axis < 3; ++axis) {
      double corner[3];
      for (int k = 0; k < 3; ++k)
        corner[k] = double(field.vertices[node->first_vertex + field.triangles[triangle][k]][axis]);
      const double target = corner[0] + second * (corner[1] - corner[0]) + third * (corner[2] - corner[0]);
      ray.origin[axis] = float(target) + field.extent * distance * random.between(-1.0f, 1.0f);
      ray.direction[axis] = float(target - double(ray.origin[axis]));
    }
    return ray;
  }

  /// The first hit of a loop over all triangles. Adds to `seen` how many triangles let light through.
  kernels::Hit first_hit(const kernels::Segment& segment, uint64_t& seen) const {
    const kernels::TrianglesField& field = tree_.field();
    kernels::BvhRay ray;
    if (!kernels::prepare_ray(field, segment, ray)) return kernels::no_hit(segment.tmin > segment.tmax);
    kernels::NearestTriangle nearest;
    for (uint32_t n = 0; n < field.node_count; ++n) {
      const kernels::BvhNode& node = field.nodes[n];
      for (const uint8_t slot : node.slots) {
        if (kernels::slot_kind(slot) == kernels::kInnerSlot) continue;
        const uint32_t first = node.first_triangle + kernels::slot_rank(slot);
        for (uint32_t i = first; i < first + kernels::slot_kind(slot); ++i) {
          const float* corners[3];
          for (int k = 0; k < 3; ++k) corners[k] = field.vertices[node.first_vertex + field.triangles[i][k]];
          kernels::TriangleCrossing<double> crossing;
          if (!kernels::meets_triangle(ray, corners, crossing)) continue;
          if (!blocks(i, crossing))
            ++seen;
          else if (nearest.triangle == kernels::kNoTriangle || crossing.t < nearest.crossing.t ||
                   (crossing.t == nearest.crossing.t && i < nearest.triangle))
            nearest = {crossing, i, node.first_vertex};
        }
      }
    }
    return kernels::hit_of(field, nearest, kernels::certain_bvh(field, segment));
  }

 private:
  bool blocks(uint32_t triangle, const kernels::TriangleCrossing<double>& crossing) const {
    if (numbers_[triangle] == 0) return true;
    const kernels::AlphaPatch& patch = holes_.patches[numbers_[triangle] - 1];
    const double second = crossing.weight[1] / crossing.sum, third = crossing.weight[2] / crossing.sum;
    int64_t texel[2];
    for (int a = 0; a < 2; ++a) {
      const double p[3] = {double(patch.places[0][a]), double(patch.places[1][a]),
                           double(patch.places[2][a])};
      const double at = (p[0] + second * (p[1] - p[0])) + third * (p[2] - p[0]);
      texel[a] = int64_t(std::floor(std::ldexp(at, int(patch.shift) - 16)));
    }
    return pictures_[patch.map].blocks(texel[0], texel[1]);
  }

  TreePayload tree_;
  format::AlphaMaps maps_;
  std::vector<Picture> pictures_;
  format::HolesData holes_;
  std::vector<uint32_t> numbers_;
};

std::vector<format::TrianglesData> trees(Random& random) {
  std::vector<format::TrianglesData> all;
  for (const uint32_t triangles : {1u, 2u, 3u, 4u, 5u, 9u, 17u, 33u, 100u, 300u})
    for (const float size : {1.0f, 1e-12f, 1e12f})
      for (const float centre : {0.0f, 1000.0f})
        all.push_back(random_bvh(random, triangles, centre * size, size));
  all.push_back(random_bvh(random, 3000));
  // More triangles at the same t than a ray keeps candidates.
  Soup same;
  same.positions = {{-1, -1, 2}, {3, -1, 2}, {0, 1, 2}, {1, 2, 2}};
  for (uint32_t i = 0; i < 60; ++i) same.triangles.push_back({0, 1, 2 + i % 2});
  for (int i = 0; i < 4; ++i) all.push_back(RandomTree(same).pack(random));
  // Large triangles, with holes and without.
  Soup town = random_soup(random, 400, 0, 0.05f);
  const uint32_t first = uint32_t(town.positions.size());
  for (uint32_t i = 0; i < 12; ++i) {
    const float angle = float(i) * 0.53f;
    town.positions.push_back({std::cos(angle), 0.3f * std::cos(angle), std::sin(angle)});
    town.triangles.push_back({first + i, first + (i + 1) % 12, i});
  }
  for (int i = 0; i < 4; ++i) all.push_back(RandomTree(town).pack(random));
  return all;
}

class CutoutKernels : public testing::TestWithParam<Way> {};

TEST_P(CutoutKernels, GiveTheReferencesBits) {
  if (!kernels::cpu::available(GetParam().isa)) GTEST_SKIP() << "this machine does not have it";
  Random random(4);
  Asked asked;
  uint64_t passed = 0;
  for (const format::TrianglesData& bvh : trees(random)) {
    const Cutout object(random, bvh);
    const kernels::CutoutField field = object.field();
    ASSERT_NO_FATAL_FAILURE(expect_reference_bits(
        field, GetParam(), random, asked,
        [&] { return random.below(2) ? random_segment(random, field) : object.ray_to_border(random); },
        [&](const kernels::Segment& segment, const kernels::Answer& answer, const kernels::Hit& hit) {
          const kernels::Hit expected = object.first_hit(segment, passed);
          ASSERT_TRUE(same_bits(hit, expected)) << hit.t << ' ' << expected.t;
          ASSERT_EQ(answer.visible, expected.triangle == kernels::kNoTriangle);
          ASSERT_EQ(answer.logit, answer.visible ? kernels::kCertainLogit : -kernels::kCertainLogit);
        }));
  }
  EXPECT_GT(asked.met, asked.rays / 8);
  EXPECT_GT(passed, asked.rays / 4);
}

INSTANTIATE_TEST_SUITE_P(Each, CutoutKernels, each_way(), name_of);

/// What is beyond a map, from far to the left to far to the right.
TEST(AlphaMaps, GoOnBeyondTheirBorders) {
  for (uint32_t size = 1; size <= 20; ++size)
    for (uint32_t wrap = 0; wrap < kernels::kAlphaWraps; ++wrap) {
      for (int64_t texel = -100; texel <= 100; ++texel)
        ASSERT_EQ(kernels::wrapped_texel(texel, size, wrap), Picture::within(texel, size, wrap))
            << size << ' ' << texel;
      for (const int64_t far : {int64_t{1} << 34, (int64_t{1} << 34) + 7})
        for (const int64_t texel : {far, -far})
          ASSERT_EQ(kernels::wrapped_texel(texel, size, wrap), Picture::within(texel, size, wrap))
              << size << ' ' << texel;
    }
}

TEST(AlphaMaps, FloorIsThatOfMath) {
  Random random(5);
  for (int i = 0; i < 100'000; ++i) {
    const double x = std::ldexp(double(random.between(-1.0f, 1.0f)), random.between(-20, 35));
    ASSERT_EQ(double(kernels::floor_of(x)), std::floor(x)) << x;
    ASSERT_EQ(double(kernels::floor_of(std::floor(x))), std::floor(x)) << x;
  }
}

}  // namespace
}  // namespace nif::test
