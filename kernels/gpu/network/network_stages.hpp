// The pipeline's stages for the `segment` encoding: items from traversals, and their networks.
#pragma once

#include "kernels/gpu/network/network_kernels.hpp"
#include "kernels/gpu/pipeline_work.hpp"

namespace nif::kernels::gpu {

static_assert(kKeptWords <= kItemWords);

/// OpenItem::about of a `segment` item: the number of intervals, and flags from this bit on.
inline constexpr uint32_t kItemFlags = 8;
/// Flag: the item has points instead of intervals.
inline constexpr uint32_t kHasPoints = 1u << 12;

/// OpenItem::about for an open traversal, with intervals or with points.
NIF_HOST_DEVICE inline uint32_t describe_points(const TraversalResult& traversal) {
  const uint32_t flags = uint32_t(traversal.saw_outside) | uint32_t(traversal.saw_inside) << 1 |
                         uint32_t(traversal.starts_open) << 2 | uint32_t(traversal.ends_open) << 3;
  return flags << kItemFlags | kHasPoints;
}
NIF_HOST_DEVICE inline uint32_t describe_intervals(const TraversalResult& traversal) {
  return traversal.interval_count | (describe_points(traversal) & ~kHasPoints);
}

/// The points of a traversal with too many intervals to keep, in the words of its item: the total length of
/// the intervals, each point's t, and the heights, four to a word. A second traversal places them, because
/// their positions follow from the length; the words after those record its progress.
class KeptPoints {
 public:
  static constexpr uint32_t kMost = 8;  ///< for fields whose points have room

  NIF_HOST_DEVICE explicit KeptPoints(uint32_t* column) : column_(column) {}
  /// Called after the first traversal.
  NIF_HOST_DEVICE void start(const TraversalResult& traversal) const {
    at(kLength) = bits_as<uint32_t>(traversal.open_t);
    at(kHeights) = at(kHeights + 1) = 0;
    at(kIntervals) = traversal.interval_count;
    at(kIntervalStart) = at(kPlaced) = 0;
  }
  /// Called for each interval of the second one.
  NIF_HOST_DEVICE void add(uint32_t samples, const TraversalResult& traversal, uint32_t number,
                           const Interval& interval) const {
    const float length = bits_as<float>(at(kLength));
    PointSpread spread{samples, length / static_cast<float>(samples), presented_reversed(traversal),
                       bits_as<float>(at(kIntervalStart)), at(kPlaced)};
    spread.place(interval, number + 1 == at(kIntervals), [&](uint32_t point, float t, uint8_t height) {
      at(kTimes + point) = bits_as<uint32_t>(t);
      at(kHeights + point / 4) |= uint32_t{height} << 8 * (point % 4);
    });
    at(kIntervalStart) = bits_as<uint32_t>(spread.interval_start);
    at(kPlaced) = spread.placed;
  }

  // Indices of an item's words.
  static constexpr uint32_t kLength = 0, kTimes = 1, kHeights = kTimes + kMost, kWords = kHeights + kMost / 4;

 private:
  static constexpr uint32_t kIntervals = kWords, kIntervalStart = kIntervals + 1, kPlaced = kIntervals + 2;
  static_assert(kPlaced < kKeptWords && kWords <= kItemWords);
  NIF_HOST_DEVICE uint32_t& at(uint32_t word) const { return column_[word * kBlockThreads]; }

  uint32_t* column_;
};

/// Traverses a ray. Returns false if the network must decide: then `item` is of the second sort if there are
/// more intervals than items have room for.
NIF_HOST_DEVICE NIF_INLINE bool traverse_segment_item(const SceneObject& object, const Segment& ray,
                                                      uint32_t* column, OpenItem& item,
                                                      ObjectAnswer& answer) {
  const KeptIntervals<kBlockThreads> kept(column);
  TraversalResult traversal;
  const auto& field = *static_cast<const DeviceSegmentField*>(object.field);
  traverse_object(field, field.words, ray, traversal,
                  [&](uint32_t i, const Interval& interval) { kept.keep(i, interval); });
  if (traversal.verdict != Verdict::open) {
    answer = answer_of(traversal);
    return true;
  }
  const bool hard = traversal.interval_count > kKeptIntervals;
  item.list = object.lists[hard];
  item.about = describe_intervals(traversal);
  item.words = hard ? 0 : kIntervalWords * traversal.interval_count;
  return false;
}

/// Writes the inputs of a `segment` item.
template <uint32_t kFeatures>
NIF_HOST_DEVICE void gather_segment(const PipelineWork& work, const DeviceSegmentField& field, uint32_t item,
                                    unsigned char* inputs) {
  const PipelineMemory& memory = work.memory;
  const uint32_t about = memory.about[item];
  TraversalResult traversal;
  float reach;
  to_grid_space(field, local_ray(work, item), traversal, reach);
  traversal.interval_count = about & ((1u << kItemFlags) - 1);
  traversal.saw_outside = about >> kItemFlags & 1;
  traversal.saw_inside = about >> (kItemFlags + 1) & 1;
  traversal.starts_open = about >> (kItemFlags + 2) & 1;
  traversal.ends_open = about >> (kItemFlags + 3) & 1;
  if (about & kHasPoints) {
    const auto word = [&](uint32_t i) { return memory.words[size_t(i) * memory.capacity + item]; };
    traversal.open_t = bits_as<float>(word(KeptPoints::kLength));
    const SamplePlacer placer(field, traversal);
    for (uint32_t i = 0; i < field.samples; ++i) {
      const uint32_t heights = word(KeptPoints::kHeights + i / 4);
      put_point<kFeatures>(
          field, i,
          placer.point_at(bits_as<float>(word(KeptPoints::kTimes + i)), uint8_t(heights >> 8 * (i % 4))),
          inputs);
    }
    return put_globals(field, traversal, inputs);
  }
  const auto interval = [&](uint32_t i) {
    const uint32_t* const at = memory.words + size_t(kIntervalWords * i) * memory.capacity + item;
    return Interval{bits_as<float>(at[0]), bits_as<float>(at[memory.capacity]),
                    at[2 * size_t{memory.capacity}]};
  };
  // Summed in the traversal's own order, so with its bits.
  traversal.open_t = 0;
  for (uint32_t i = 0; i < traversal.interval_count; ++i)
    traversal.open_t += interval(i).end - interval(i).begin;
  SamplePlacer placer(field, traversal);
  for (uint32_t i = 0; i < traversal.interval_count; ++i)
    placer.add(interval(i), i + 1 == traversal.interval_count,
               [&](uint32_t number, const SamplePoint& point) {
                 put_point<kFeatures>(field, number, point, inputs);
               });
  put_globals(field, traversal, inputs);
}

/// Evaluates the networks of `segment` objects. Any number of blocks of kBlockThreads.
template <class Matrix, uint32_t kFeatures, class Thread>
NIF_HOST_DEVICE void pipeline_segments(const Thread& thread, const PipelineWork& work) {
  const auto layout_of = [&](uint32_t list) -> const SegmentLayout& {
    return work.lists[list].layout_as<SegmentLayout>();
  };
  const auto field_of = [&](uint32_t list) -> const DeviceSegmentField& {
    return *static_cast<const DeviceSegmentField*>(work.lists[list].field);
  };
  unsigned char* const biases = thread.shared();
  const auto begin = [&](uint32_t list) {
    const SegmentLayout& layout = layout_of(list);
    load_network(thread, field_of(list).network, layout, biases, biases + round_up(4 * layout.rows, 16));
  };
  const uint32_t wave = thread.wave_size(), first = thread.wave() * wave;
  for_each_tile<kBlockThreads>(thread, work, begin, [&](const PipelineTile& tile) {
    if (first >= tile.count) return;
    const SegmentLayout& layout = layout_of(tile.list);
    const DeviceSegmentField& field = field_of(tile.list);
    const unsigned char* const weights = biases + round_up(4 * layout.rows, 16);
    unsigned char* const inputs =
        thread.shared() + round_up(4 * layout.rows, 16) + (layout.rows + first) * layout.stride;
    const bool present = thread.lane() < tile.count - first;
    const uint32_t item = present ? tile.item(work.memory, first + thread.lane()) : 0;
    if (present) gather_segment<kFeatures>(work, field, item, inputs + thread.lane() * layout.stride);
    if (work.inputs_alone) return;
    const int32_t logit =
        evaluate_wave<Matrix>(thread, field.network, layout.stride, biases, weights, inputs);
    if (present) deliver(work, item, logit);
  });
}

}  // namespace nif::kernels::gpu
