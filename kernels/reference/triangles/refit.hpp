// Triangles that move: new boxes for the tree that a `bvh` object has, after its vertices have changed. Takes linear
// time. Boxes never change an answer (docs/encodings/bvh.md), so a tree that has been refitted answers as one that was
// built anew.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "kernels/reference/triangles/triangles_field.hpp"

namespace nif::kernels {

/// Largest coordinate of a vertex: a quarter of the limit, because a frame may reach beyond its contents.
inline constexpr float kMaxVertexCoordinate = kMaxBvhCoordinate / 4;

/// The finest frame in which the interval has at most 255 steps and its ends have 24 bits. For an interval within
/// it the frame is no coarser, so that boxes stay nested when they are rounded outwards. The interval must be within
/// kMaxVertexCoordinate.
inline uint32_t fit_frame(double low, double high, double& scale) {
  int exponent =
      std::ilogb(std::max({high - low, std::abs(low) * 0x1p-16, std::abs(high) * 0x1p-16, 0x1p-80})) - 8;
  for (;; ++exponent) {
    scale = std::ldexp(1.0, exponent);
    const double base = std::floor(low / scale), end = std::ceil(high / scale);
    if (base < -0x1p23 || end >= 0x1p23 || end - base > 255) continue;
    return uint32_t(exponent + 127) | uint32_t(int32_t(base)) << 8;
  }
}

/// The planes of a box along an axis, rounded outwards, as steps of a frame that holds it.
struct FrameSteps {
  uint8_t low, high;
};
inline FrameSteps steps_in(uint32_t frame, double scale, double low, double high) {
  const double base = frame_base(frame);
  return {uint8_t(std::floor(low / scale) - base), uint8_t(std::ceil(high / scale) - base)};
}

struct alignas(16) VertexBox {
  float low[4], high[4];  ///< x, y, z; the fourth is not used

  void clear() {
    std::fill_n(low, 4, std::numeric_limits<float>::infinity());
    std::fill_n(high, 4, -std::numeric_limits<float>::infinity());
  }
  void include(const float* least, const float* most) {
    for (int a = 0; a < 3; ++a) {
      low[a] = std::min(least[a], low[a]);
      high[a] = std::max(most[a], high[a]);
    }
  }
};

/// A root with one slot around this box: what a root with its slots within that box says of the object's extent
/// and box.
inline BvhNode root_around(const VertexBox& box) {
  BvhNode root{};
  root.slots[0] = make_slot(kInnerSlot, 0);
  for (int a = 0; a < 3; ++a) {
    double scale;
    root.frame[a] = fit_frame(double(box.low[a]), double(box.high[a]), scale);
    const FrameSteps steps = steps_in(root.frame[a], scale, double(box.low[a]), double(box.high[a]));
    root.low[a][0] = steps.low;
    root.high[a][0] = steps.high;
  }
  return root;
}

/// Sets frames and boxes of nodes by the field's vertices. `nodes` are those of the field, each after its parent.
/// `boxes`: [node_count], receives the box of each node.
inline void refit(const TrianglesField& field, BvhNode* nodes, VertexBox* boxes) {
  for (uint32_t i = field.node_count; i-- > 0;) {
    BvhNode& node = nodes[i];
    VertexBox slots[kBvhWidth];
    boxes[i].clear();
    uint32_t used = 0;
    for (; used < kBvhWidth && node.slots[used] != 0; ++used) {
      VertexBox& own = slots[used];
      const uint32_t kind = slot_kind(node.slots[used]), rank = slot_rank(node.slots[used]);
      if (kind == kInnerSlot) {
        own = boxes[node.first_node + rank];
      } else {
        own.clear();
        for (uint32_t t = 0; t < kind; ++t)
          for (const uint8_t v : field.triangles[node.first_triangle + rank + t]) {
            const float* const at = field.vertices[size_t{node.first_vertex} + v];
            own.include(at, at);
          }
      }
      boxes[i].include(own.low, own.high);
    }
    for (int a = 0; a < 3; ++a) {
      double scale;
      node.frame[a] = fit_frame(double(boxes[i].low[a]), double(boxes[i].high[a]), scale);
      for (uint32_t s = 0; s < used; ++s) {
        const FrameSteps steps =
            steps_in(node.frame[a], scale, double(slots[s].low[a]), double(slots[s].high[a]));
        node.low[a][s] = steps.low;
        node.high[a][s] = steps.high;
      }
    }
  }
}

/// Triangles that have moved, as ObjectKernel::move() takes them.
struct MovedTriangles {
  /// Its extent is the new one. Its nodes and vertices are new only if the kernel reads_nodes().
  TrianglesField field;
  VertexBox box;  ///< around all triangles
  /// Of each vertex that triangles have, 16-byte aligned; the last is no coordinate, and may be any finite number.
  const float (*positions)[4];
  const uint32_t (*corners)[3];  ///< [triangle of the object] its vertices, as indices of `positions`
};

}  // namespace nif::kernels
