// What traversals of triangles ask about holes: of `bvh` and `exact` objects nothing, of `cutout` objects which
// triangles have some, and whether they block a ray that meets them.
#pragma once

#include <cstdint>
#include <memory_resource>
#include <vector>

#include "kernels/cpu/triangles/tree.hpp"
#include "kernels/reference/holes/holes_field.hpp"

namespace nif::kernels::cpu {

/// The patches of the triangles of a DecodedLeaf; of those without holes, 0.
struct alignas(16) LeafHoles {
  int32_t places[3][2][kBvhLeafTriangles];  ///< by corner and axis
  float unit[kBvhLeafTriangles];            ///< of the places, in texels
  uint32_t maps[kBvhLeafTriangles];
};
static_assert(sizeof(LeafHoles) == 128);

/// A `cutout` object as the SIMD kernel keeps it.
struct CutoutTree {
  BuiltBytes built_bytes() const {
    BuiltBytes bytes = bvh.built_bytes();
    bytes.decoded_triangles += lanes.capacity() + leaves.capacity() * sizeof(LeafHoles);
    return bytes;
  }

  BvhTree bvh;
  HolesField holes;
  // [leaves of bvh.decoded]
  std::pmr::vector<uint8_t> lanes;  ///< triangles with holes as bits
  std::pmr::vector<LeafHoles> leaves;
};

/// The holes of the triangles of a CutoutTree; by default there are none.
struct SomeHoles {
  static constexpr bool kAny = true;
  const HolesField* holes = nullptr;
  const uint8_t* lanes = nullptr;     ///< CutoutTree::lanes
  const LeafHoles* leaves = nullptr;  ///< CutoutTree::leaves

  /// Triangles of a decoded leaf, as bits.
  uint32_t in_leaf(uint32_t leaf) const { return lanes[leaf]; }
  const AlphaPatch* patch(uint32_t triangle) const {
    return holes == nullptr ? nullptr : patch_of(*holes, triangle);
  }
  /// As AllTriangles.
  bool operator()(uint32_t triangle, const TriangleCrossing<double>& crossing) const {
    const AlphaPatch* const shown = patch(triangle);
    return shown == nullptr || blocks_light(*holes, *shown, crossing);
  }
};

#ifdef __wasm__
/// On a web page, code for objects without holes alone is too much to download.
using NoHoles = SomeHoles;
#else
/// There are none.
struct NoHoles : AllTriangles {
  static constexpr bool kAny = false;

  static constexpr uint32_t in_leaf(uint32_t) { return 0; }
};
#endif

}  // namespace nif::kernels::cpu
