// The pipeline's stages for the `segment` encoding: items from traversals, and their networks.
#pragma once

#include "kernels/gpu/network/kernels.hpp"
#include "kernels/gpu/pipeline_work.hpp"

namespace nif::kernels::gpu {

static_assert(kKeptWords <= kItemWords);

/// OpenItem::about of a `segment` item: the number of intervals, and flags from this bit on.
inline constexpr uint32_t kItemFlags = 8;
/// Flag: the item has points instead of intervals.
inline constexpr uint32_t kHasPoints = 1u << 12;

/// OpenItem::about for an ambiguous traversal, with intervals or with points.
NIF_HOST_DEVICE inline uint32_t describe_points(const WalkResult& walk) {
  const uint32_t flags = uint32_t(walk.saw_outside) | uint32_t(walk.saw_inside) << 1 |
                         uint32_t(walk.starts_open) << 2 | uint32_t(walk.ends_open) << 3;
  return flags << kItemFlags | kHasPoints;
}
NIF_HOST_DEVICE inline uint32_t describe_runs(const WalkResult& walk) {
  return walk.run_count | (describe_points(walk) & ~kHasPoints);
}

/// The points of a traversal with too many intervals to keep, in the words of its item: the total length of
/// the intervals, each point's t, and the heights, four to a word. A second traversal places them, because
/// their positions follow from the length; the words after those record its progress.
class KeptPoints {
 public:
  static constexpr uint32_t kMost = 8;  ///< for fields whose points have room

  NIF_HOST_DEVICE explicit KeptPoints(uint32_t* column) : column_(column) {}
  /// Called after the first traversal.
  NIF_HOST_DEVICE void start(const WalkResult& walk) const {
    at(kLength) = bits_as<uint32_t>(walk.open_t);
    at(kHeights) = at(kHeights + 1) = 0;
    at(kRuns) = walk.run_count;
    at(kRunStart) = at(kPlaced) = 0;
  }
  /// Called for each interval of the second one.
  NIF_HOST_DEVICE void add(uint32_t samples, const WalkResult& walk, uint32_t number, const Run& run) const {
    const float length = bits_as<float>(at(kLength));
    PointSpread spread{samples, length / static_cast<float>(samples), presented_reversed(walk),
                       bits_as<float>(at(kRunStart)), at(kPlaced)};
    spread.place(run, number + 1 == at(kRuns), [&](uint32_t point, float t, uint8_t height) {
      at(kTimes + point) = bits_as<uint32_t>(t);
      at(kHeights + point / 4) |= uint32_t{height} << 8 * (point % 4);
    });
    at(kRunStart) = bits_as<uint32_t>(spread.run_start);
    at(kPlaced) = spread.placed;
  }

  // Indices of an item's words.
  static constexpr uint32_t kLength = 0, kTimes = 1, kHeights = kTimes + kMost, kWords = kHeights + kMost / 4;

 private:
  static constexpr uint32_t kRuns = kWords, kRunStart = kRuns + 1, kPlaced = kRuns + 2;
  static_assert(kPlaced < kKeptWords && kWords <= kItemWords);
  NIF_HOST_DEVICE uint32_t& at(uint32_t word) const { return column_[word * kBlockThreads]; }

  uint32_t* column_;
};

/// Traverses a ray. Returns false if the network must decide: then `item` is of the second sort if there are
/// more intervals than items have room for.
NIF_HOST_DEVICE NIF_INLINE bool walk_segment_item(const SceneObject& object, const Segment& ray,
                                                  uint32_t* column, OpenItem& item, ObjectAnswer& answer) {
  const KeptRuns<kBlockThreads> kept(column);
  WalkResult walk;
  const auto& field = *static_cast<const DeviceSegmentField*>(object.field);
  walk_object(field, field.walk, ray, walk, [&](uint32_t i, const Run& run) { kept.keep(i, run); });
  if (walk.verdict != Verdict::ambiguous) {
    answer = answer_of(walk);
    return true;
  }
  const bool hard = walk.run_count > kKeptRuns;
  item.list = object.lists[hard];
  item.about = describe_runs(walk);
  item.words = hard ? 0 : kRunWords * walk.run_count;
  return false;
}

/// Writes the inputs of a `segment` item.
template <uint32_t kFeatures>
NIF_HOST_DEVICE void gather_segment(const PipelineWork& work, const DeviceSegmentField& field, uint32_t item,
                                    unsigned char* inputs) {
  const PipelineMemory& memory = work.memory;
  const uint32_t about = memory.about[item];
  WalkResult walk;
  float reach;
  to_grid_space(field, local_ray(work, item), walk, reach);
  walk.run_count = about & ((1u << kItemFlags) - 1);
  walk.saw_outside = about >> kItemFlags & 1;
  walk.saw_inside = about >> (kItemFlags + 1) & 1;
  walk.starts_open = about >> (kItemFlags + 2) & 1;
  walk.ends_open = about >> (kItemFlags + 3) & 1;
  if (about & kHasPoints) {
    const auto word = [&](uint32_t i) { return memory.words[size_t(i) * memory.capacity + item]; };
    walk.open_t = bits_as<float>(word(KeptPoints::kLength));
    const SamplePlacer placer(field, walk);
    for (uint32_t i = 0; i < field.samples; ++i) {
      const uint32_t heights = word(KeptPoints::kHeights + i / 4);
      put_point<kFeatures>(
          field, i,
          placer.point_at(bits_as<float>(word(KeptPoints::kTimes + i)), uint8_t(heights >> 8 * (i % 4))),
          inputs);
    }
    return put_globals(field, walk, inputs);
  }
  const auto run = [&](uint32_t i) {
    const uint32_t* const at = memory.words + size_t(kRunWords * i) * memory.capacity + item;
    return Run{bits_as<float>(at[0]), bits_as<float>(at[memory.capacity]), at[2 * size_t{memory.capacity}]};
  };
  // Summed in the traversal's own order, so with its bits.
  walk.open_t = 0;
  for (uint32_t i = 0; i < walk.run_count; ++i) walk.open_t += run(i).end - run(i).begin;
  SamplePlacer placer(field, walk);
  for (uint32_t i = 0; i < walk.run_count; ++i)
    placer.add(run(i), i + 1 == walk.run_count, [&](uint32_t number, const SamplePoint& point) {
      put_point<kFeatures>(field, number, point, inputs);
    });
  put_globals(field, walk, inputs);
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
