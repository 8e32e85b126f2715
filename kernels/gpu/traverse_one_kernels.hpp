// The pipeline's traversal (pipeline_kernels.hpp) for a scene of one instance of a `segment` object.
//
// Rays take very different numbers of steps, so most lanes of a wave would wait for its longest ray. Here a
// lane whose traversal is over takes the next ray, after Aila and Laine (Understanding the Efficiency of Ray
// Traversal on GPUs, HPG 2009). Waves take rays from one counter, enough at a time that this is rare.
//
// A traversal with more intervals than items have room for restarts at once, and places the network's points.
#pragma once

#include "kernels/gpu/pipeline_kernels.hpp"

namespace nif::kernels::gpu {

/// Rays that a wave takes from the query at once.
inline constexpr uint32_t kWaveShare = 64;

/// What one lane is doing.
struct TraversingLane {
  enum State : uint32_t { kIdle, kTraversing, kOver };
  State state = kIdle;
  bool again = false;  ///< the second traversal, which places points
  uint32_t ray = 0;
  TraversalResult traversal;
  SkippingTraversal skipping;
};

/// Like pipeline_traverse(), with the same answers and items, except for items with points. The first of the
/// counts, which is unused if items are not sorted, counts the rays that were taken. Any number of blocks of
/// kBlockThreads; kKeptWords for each thread.
template <bool kDetails, class Thread>
NIF_HOST_DEVICE void pipeline_traverse_one(const Thread& thread, const PipelineWork& work) {
  const SceneQuery& query = work.query;
  const PlacedInstance& instance = work.scene.instances[work.scene.sole];
  const SceneObject& object = work.scene.objects[instance.object];
  const auto& field = *static_cast<const DeviceSegmentField*>(object.field);
  uint32_t* const column = reinterpret_cast<uint32_t*>(thread.shared()) + thread.index();
  const KeptIntervals<kBlockThreads> intervals(column);
  const KeptPoints points(column);
  const bool has_room = field.samples <= KeptPoints::kMost;
  // Refilling when three lanes in eight are idle was best on an H200; a quarter to a half is about the same.
  const uint32_t few = thread.wave_size() * 5 / 8;
  const uint64_t lower = (uint64_t{1} << thread.lane()) - 1;

  TraversingLane lane;
  const auto begin = [&] {
    const Segment world = load_ray(query, lane.ray);
    const Segment local = instance.identity ? world : to_object(instance.to_object, world);
    lane.state = lane.skipping.begin(field, local, lane.traversal) ? TraversingLane::kTraversing
                                                                   : TraversingLane::kOver;
  };
  const auto keep = [&](uint32_t i, const Interval& interval) {
    if (lane.again)
      points.add(field.samples, lane.traversal, i, interval);
    else
      intervals.keep(i, interval);
  };
  // Of the wave: the rays that it has taken, and whether there may be more.
  uint32_t next = 0, last = 0;
  bool more = true;
  for (;;) {
    // Handles the results of traversals that are over.
    bool open = lane.state == TraversingLane::kOver;
    if (open && lane.traversal.verdict != Verdict::open) {
      ObjectAnswer answer = answer_of(lane.traversal);
      if (kDetails && instance.unproven) answer.certain = false;
      if (kDetails && !instance.identity) {
        const Segment world = load_ray(query, lane.ray);
        to_world<kDetails>(instance, object.reach_scale, world, to_object(instance.to_object, world), answer);
      }
      store_answer<kDetails>(query, lane.ray,
                             only_answer(answer, object.calibration, kDetails && query.probability));
      lane.state = TraversingLane::kIdle;
      open = false;
    }
    if (thread.ballot(open) != 0) {
      const bool hard = lane.traversal.interval_count > kKeptIntervals && !lane.again;
      const bool listed = open && !(hard && has_room);
      const uint32_t list = object.lists[hard];
      const uint32_t place = append_to(thread, listed, list, work.items.counts + 1);
      if (listed) {
        const uint32_t item = list == 0 ? place : work.memory.capacity - 1 - place;
        const uint32_t words = hard         ? 0
                               : lane.again ? KeptPoints::kWords
                                            : kIntervalWords * lane.traversal.interval_count;
        work.items.ray[item] = lane.ray;
        work.memory.about[item] =
            lane.again ? describe_points(lane.traversal) : describe_intervals(lane.traversal);
        for (uint32_t i = 0; i < words; ++i)
          work.memory.words[size_t(i) * work.memory.capacity + item] = column[i * kBlockThreads];
        lane.state = TraversingLane::kIdle;
        lane.again = false;
      } else if (open) {
        points.start(lane.traversal);
        lane.again = true;
        begin();
      }
    }

    // Takes the next rays.
    if (next == last && more) {
      uint32_t first = 0;
      if (thread.lane() == 0) first = thread.add(work.items.counts, kWaveShare);
      first = thread.shuffle(first, 0);
      next = first < query.count ? first : query.count;
      last = query.count - next < kWaveShare ? query.count : next + kWaveShare;
      more = last < query.count;
    }
    const uint64_t idle = thread.ballot(lane.state == TraversingLane::kIdle);
    const uint32_t place = count_bits(idle & lower), wanted = count_bits(idle), left = last - next;
    if (lane.state == TraversingLane::kIdle && place < left) {
      lane.ray = next + place;
      begin();
    }
    next += wanted < left ? wanted : left;
    const bool rest = next == last && !more;
    if (rest && thread.ballot(lane.state != TraversingLane::kIdle) == 0) return;

    // Continues until enough of the wave's traversals are over, or all of the last ones.
    while (count_bits(thread.ballot(lane.state == TraversingLane::kTraversing)) > (rest ? 0 : few))
      if (lane.state == TraversingLane::kTraversing &&
          !lane.skipping.go_on(field, field.words, lane.traversal, keep))
        lane.state = TraversingLane::kOver;
  }
}

}  // namespace nif::kernels::gpu
