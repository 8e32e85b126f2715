// Makes a `bvh` object without the baker: random triangles in a tree that halves them by position; and finds
// answers by testing each triangle.
#pragma once

#include <algorithm>
#include <cmath>
#include <deque>
#include <vector>

#include "formats/nif/triangles/pack.hpp"
#include "kernels/reference/triangles/triangles_query.hpp"
#include "tests/support/test_random.hpp"

namespace nif::test {

struct Soup {
  std::vector<std::array<float, 3>> positions;
  std::vector<std::array<uint32_t, 3>> triangles;
};

/// Triangles that share vertices, of all sizes, some flat along an axis, around `centre`.
inline Soup random_soup(Random& random, uint32_t triangles, float centre = 0, float size = 1) {
  Soup soup;
  const uint32_t points = 3 + triangles / 2;
  for (uint32_t i = 0; i < points; ++i) {
    std::array<float, 3> p;
    for (float& x : p) x = centre + size * random.between(-1.0f, 1.0f);
    if (i > 0 && random.below(4) == 0) p[i % 3] = soup.positions.back()[i % 3];
    if (i > 0 && random.below(3) == 0)
      for (size_t a = 0; a < 3; ++a) p[a] = soup.positions.back()[a] + (p[a] - centre) * 0.01f;
    soup.positions.push_back(p);
  }
  while (soup.triangles.size() < triangles) {
    const uint32_t a = random.below(points - 2);
    const uint32_t b = random.below(8) ? a + 1 : random.below(points);
    soup.triangles.push_back({a, b, random.below(8) ? a + 2 : random.below(points)});
  }
  return soup;
}

class RandomTree {
 public:
  explicit RandomTree(const Soup& soup) : soup_(soup) {}

  /// `order` and `sources` as in pack_bvh().
  format::TrianglesData pack(Random& random, std::vector<uint32_t>* order = nullptr,
                             std::vector<uint32_t>* sources = nullptr) {
    std::vector<uint32_t> all(soup_.triangles.size());
    for (uint32_t i = 0; i < all.size(); ++i) all[i] = i;
    return format::pack_bvh(grow(random, all), soup_.positions, soup_.triangles, order, sources);
  }

 private:
  format::BvhBranch& grow(Random& random, std::span<uint32_t> part) {
    format::BvhBranch& branch = branches_.emplace_back();
    if (part.size() <= 1 + random.below(kernels::kBvhLeafTriangles)) {
      branch.triangle_count = uint32_t(part.size());
      std::copy(part.begin(), part.end(), branch.triangles);
      return branch;
    }
    const size_t axis = random.below(3);
    std::sort(part.begin(), part.end(), [&](uint32_t a, uint32_t b) {
      const float x = soup_.positions[soup_.triangles[a][0]][axis],
                  y = soup_.positions[soup_.triangles[b][0]][axis];
      return x < y || (x == y && a < b);
    });
    const uint32_t children = std::min(2 + random.below(kernels::kBvhWidth - 1), uint32_t(part.size()));
    for (uint32_t c = 0; c < children; ++c) {
      const size_t first = part.size() * c / children, last = part.size() * (c + 1) / children;
      format::BvhBranch& child = grow(random, part.subspan(first, last - first));
      branch.children[branch.child_count++] = &child;
    }
    return branch;
  }

  const Soup& soup_;
  std::deque<format::BvhBranch> branches_;
};

inline format::TrianglesData random_bvh(Random& random, uint32_t triangles, float centre = 0,
                                        float size = 1) {
  const Soup soup = random_soup(random, triangles, centre, size);
  return RandomTree(soup).pack(random);
}

/// The answer of a loop over all triangles.
inline kernels::Answer ask_each_triangle(const kernels::TrianglesField& field,
                                         const kernels::Segment& segment) {
  kernels::BvhRay ray;
  if (!kernels::prepare_ray(field, segment, ray)) return kernels::answer_no_ray(segment);
  bool visible = true;
  for (uint32_t n = 0; n < field.node_count; ++n)
    for (const uint8_t slot : field.nodes[n].slots)
      if (slot != 0 && kernels::slot_kind(slot) != kernels::kInnerSlot)
        visible = visible && !kernels::meets_leaf(field, ray, field.nodes[n], slot);
  return {visible, kernels::certain_bvh(field, segment),
          visible ? kernels::kCertainLogit : -kernels::kCertainLogit};
}

/// A difficult or invalid segment: at vertices, edges and centres of triangles, from far away and from
/// inside, along axes, in planes of boxes, with parts that are zero, infinite, NaN or out of order.
inline kernels::Segment random_segment(Random& random, const kernels::TrianglesField& field) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  const auto vertex = [&] { return field.vertices[random.below(field.vertex_count)]; };
  const float *from = vertex(), *to = vertex(), *other = vertex();
  const uint32_t kind = random.below(8);
  // Up to where rays are too far away to meet anything, and a little more.
  const float far = std::exp2(random.between(0.0f, 33.0f));
  const float distance = kind == 0 ? far : kind == 1 ? 100.0f : 2.0f, share = random.unit();
  kernels::Segment segment{{}, {}, 0, kInfinity};
  for (int a = 0; a < 3; ++a) {
    const float target = random.below(4) ? to[a] + share * (other[a] - to[a]) : to[a];
    segment.origin[a] = kind == 2 ? from[a] : target + field.extent * distance * random.between(-1.0f, 1.0f);
    segment.direction[a] = target - segment.origin[a];
  }
  if (random.below(4) == 0) {  // along an axis, or in a plane across one
    const uint32_t axis = random.below(3), other_axis = random.below(3);
    for (uint32_t a = 0; a < 3; ++a)
      if (a != axis && a != other_axis)
        segment.origin[a] = to[a], segment.direction[a] = random.below(2) ? 0.0f : -0.0f;
  }
  if (random.below(16) == 0) segment.direction[random.below(3)] *= 1e-12f;
  if (random.below(4) == 0) segment.tmin = random.between(-2.0f, 2.0f);
  if (random.below(4) == 0) segment.tmax = random.below(2) ? 1.0f : random.between(-2.0f, 2.0f);
  if (random.below(16) == 0) segment.tmin = -kInfinity;
  if (random.below(64) == 0) {
    constexpr float kOdd[] = {
        std::numeric_limits<float>::quiet_NaN(), kInfinity, -kInfinity, 0.0f, 3e38f, 1e-45f, 1e-30f};
    float* const parts[] = {&segment.origin[0], &segment.direction[1], &segment.direction[2], &segment.tmin,
                            &segment.tmax};
    *parts[random.below(5)] = kOdd[random.below(7)];
  }
  return segment;
}

}  // namespace nif::test
