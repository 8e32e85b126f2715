// The undecided rays of a batch in a scene, in columns without gaps: an instance's box is tested against many of
// them at once, and those that may meet it go to its kernel together. Decided rays leave the stream.
//
// Which rays those are, and with which bits they come to object space, is defined in
// kernels/reference/instance.hpp.
#pragma once

#include <limits>

#include "kernels/cpu/isa.hpp"
#include "kernels/reference/hit.hpp"
#include "kernels/reference/instance.hpp"
#include "kernels/reference/object_kernel.hpp"
#include "kernels/reference/scene_field.hpp"
#include "kernels/reference/scene_hit.hpp"

namespace nif::kernels::cpu {

/// Rays in world space that can meet a box (prepare_box_ray()).
struct RayStream {
  uint32_t count;
  uint32_t dropped;  ///< of these, since the last pack()
  bool masked;       ///< false: all masks have all bits
  alignas(64) float origin[3][kBatchRoom];
  float direction[3][kBatchRoom];
  float inverse[3][kBatchRoom];  ///< BoxRay
  float tmin[kBatchRoom], tmax[kBatchRoom];
  uint32_t mask[kBatchRoom];
  uint32_t ray[kBatchRoom];  ///< its number in the batch

  /// Entry k meets nothing from now on, and pack() removes it.
  void drop(uint32_t k) {
    tmin[k] = std::numeric_limits<float>::infinity();
    tmax[k] = -tmin[k];
    ++dropped;
  }
};

/// An instance as a stream meets it.
struct StreamInstance {
  WorldBox box;
  const WorldToObject* to_object;  ///< null: the identity
  uint32_t mask;
};

/// First hits with the object of an instance, of rays that a stream brought to object space.
struct StreamHits {
  const uint32_t* entries;  ///< [met.count] the rays' numbers in the stream, ascending, as meet() gives them
  const SegmentBatch& local;  ///< the rays in object space
  const HitBatch& met;        ///< their hits there
  const PlacedInstance& instance;
  uint32_t number;    ///< the instance's
  float reach_scale;  ///< the object's
};

/// What an instruction set has for streams.
struct StreamFunctions {
  /// Fills the stream with the rays that can meet a box. `masks` [rays.count]: null if the query has none.
  void (*start)(const SegmentBatch& rays, const uint32_t* masks, RayStream& stream);
  /// The rays of the stream that may meet the instance: `local` gets them in object space, `entries` their
  /// numbers in the stream [kBatchRoom].
  void (*meet)(const RayStream& stream, const StreamInstance& instance, SegmentBatch& local,
               uint32_t* entries);
  /// The rays of the stream that may meet the box: `narrowed` gets them, `entries` their numbers in the stream
  /// [kBatchRoom].
  void (*narrow)(const RayStream& stream, const WorldBox& box, RayStream& narrowed, uint32_t* entries);
  /// Adds hits to those of the batch, `hits` and `instances`, as SceneHit::add() does: proofs hold if they do in
  /// the world, and nothing is met before the instance's box. Entries end at the proven hit, because a box that
  /// begins beyond it cannot hold the first one.
  void (*join)(RayStream& stream, const WorldBox& box, const StreamHits& added, HitBatch& hits,
               uint32_t* instances);
  /// Removes the entries that were dropped, or whose tmax is below their tmin.
  void (*pack)(RayStream& stream);
#ifndef __wasm__  // where Highway lacks doubles
  /// Turns the normals of the batch's hits as world_normal() does. `in` [kBatchRoom]: the instance of each ray's hit, an index
  /// into `instances`; kNoInstance: there is no hit.
  void (*turn)(const SegmentBatch& rays, const PlacedInstance* instances, const uint32_t* in, HitBatch& hits);
  /// Finds the rays of which stays_certain() is false: a proof about one of `local`, in object space, does not hold for it in the
  /// world. `numbers` [kBatchRoom]: theirs among `world`, also beyond the last; null: the same. Not for instances that prove something
  /// and have no transform. `found` [kBatchRoom] receives numbers among `local`, and may be `numbers`. Returns how many there are.
  uint32_t (*find_unproven)(const SegmentBatch& world, const uint32_t* numbers, const SegmentBatch& local,
                            const PlacedInstance& instance, float reach_scale, uint32_t* found);
#endif
};
/// The isa must be available().
const StreamFunctions& stream_functions(Isa isa);

}  // namespace nif::kernels::cpu
