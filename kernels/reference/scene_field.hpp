// The memory of a scene's top level: a bounding volume hierarchy (BVH) over the instances' world boxes, four
// children a node, and the instances themselves. The runtime builds it; the traversals on CPU and GPU read
// it.
#pragma once

#include <cstdint>

#include "kernels/reference/instance.hpp"

namespace nif::kernels {

inline constexpr uint32_t kTopWidth = 4;
inline constexpr uint32_t kTopLeaf = 0x80000000u;
inline constexpr uint32_t kNoBox = 0xffffffffu;

/// The boxes of the instances are the innermost children and stored nowhere else.
struct alignas(64) TopNode {
  float min[3][kTopWidth], max[3][kTopWidth];  ///< inverted if there is no child
  uint32_t child[kTopWidth];                   ///< a node, or kTopLeaf | instance
  uint32_t lanes;                              ///< a bit for each existing child
  uint32_t parent;                             ///< index of this node in its parent; kNoBox for the root
  /// By the signs of a ray's direction, bit `axis` if negative: the children from near to far, two bits each from bit 0 on.
  uint8_t near_first[8];
};
static_assert(sizeof(TopNode) == 128);

/// One placed object, as compact as a scene with very many needs it.
struct PlacedInstance {
  WorldToObject to_object;
  uint32_t object : 29;           ///< index among the scene's objects
  uint32_t unproven : 1;          ///< its file proves nothing: no answer about it is certain
  uint32_t identity : 1;          ///< rays need no transform
  uint32_t well_conditioned : 1;  ///< the inverse is as good as its rounding to float
  uint32_t place;  ///< of its box in the hierarchy: kTopWidth * node + child; kNoBox if it has none
  uint32_t mask;   ///< a ray meets it only if their masks have a bit in common
};
static_assert(sizeof(PlacedInstance) == 72);

/// Does an answer that is certain for the ray in the instance's object space hold in the world? `reach_scale`
/// is the object's. Not if the file proves nothing.
NIF_HOST_DEVICE inline bool stays_certain(const PlacedInstance& instance, float reach_scale,
                                          const Segment& world, const Segment& local) {
  return !instance.unproven &&
         (instance.identity || world.tmin > world.tmax ||
          (instance.well_conditioned && stays_certain(instance.to_object, reach_scale, world, local)));
}

}  // namespace nif::kernels
