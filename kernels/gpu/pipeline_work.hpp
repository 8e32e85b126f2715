// Data of the pipeline's kernels (pipeline_kernels.hpp): items, their lists, and tiles of lists.
#pragma once

#include "kernels/gpu/scene_way.hpp"

namespace nif::kernels::gpu {

/// Items of one list that are processed together.
inline constexpr uint32_t kTileItems = kBlockThreads;

/// A list of items: those for an object's field, of one sort. Device memory.
struct PipelineList {
  const void* field;  ///< as in SceneObject
  alignas(
      8) unsigned char layout[56];  ///< encoding-specific: layout of a network and its items in shared memory

  template <class Layout>
  NIF_HOST_DEVICE const Layout& layout_as() const {
    static_assert(sizeof(Layout) <= sizeof(layout) && alignof(Layout) <= 8);
    return *reinterpret_cast<const Layout*>(layout);
  }
};

/// A round's items. Device memory, [capacity] each.
struct PipelineItems {
  uint32_t* counts;  ///< [1 + lists]: of all items, then of each list; 0 before the round
  uint32_t* ray;
  uint32_t* instance;  ///< only if items are sorted
  int32_t* logit;      ///< the answers. From here on only for scenes of several instances
  SceneWay* way;       ///< the rays' progress through the scene, after this instance
};

/// Memory that successive rounds reuse. Device memory.
struct PipelineMemory {
  uint32_t capacity;  ///< items of a round; rays of a query
  uint32_t* about;    ///< [capacity]: see OpenItem
  uint32_t* words;    ///< [kItemWords][capacity]
  // If items are sorted, else null:
  uint32_t* list;        ///< [capacity]
  uint32_t* place;       ///< [capacity]: in the list
  uint32_t* order;       ///< [capacity + kTileItems * lists]: items by list, each list starting at a new tile
  uint32_t* first_tile;  ///< [1 + lists], of `order`
};

/// Arguments of a kernel of the pipeline.
struct PipelineWork {
  SceneArrays scene;
  SceneQuery query;           ///< without visible_bits
  const PipelineList* lists;  ///< device memory; those of a stage are consecutive
  uint32_t list_count;
  PipelineItems before;  ///< items of the previous round; none in the first
  PipelineItems items;
  PipelineMemory memory;
  uint32_t first_list;    ///< of the stage: for kernels that answer items
  uint32_t end_list;      ///< behind its last one
  uint32_t inputs_alone;  ///< whether to skip networks, to measure how long the rest takes
};

/// Where a list's tiles start; for the list after the last one: where all of them end.
NIF_HOST_DEVICE inline uint32_t first_tile(const PipelineWork& work, uint32_t list) {
  if (work.memory.order) return work.memory.first_tile[list];
  uint32_t tiles = 0;
  for (uint32_t before = 0; before < list; ++before)
    tiles += (work.items.counts[1 + before] + kTileItems - 1) / kTileItems;
  return tiles;
}

/// The stage's list that a tile belongs to: the last one that starts at or before it, since an empty list
/// starts where the next one does. `list`: not after the result.
NIF_HOST_DEVICE inline uint32_t list_of_tile(const PipelineWork& work, uint32_t tile, uint32_t list) {
  uint32_t above = work.end_list;
  while (above - list > 1) {
    const uint32_t middle = list + (above - list) / 2;
    if (first_tile(work, middle) <= tile)
      list = middle;
    else
      above = middle;
  }
  return list;
}

/// Items of one list, at most one per thread of a block.
struct PipelineTile {
  uint32_t list;
  uint32_t place;  ///< of the first one, in the list
  uint32_t order;  ///< and its index in PipelineMemory::order
  uint32_t count;

  NIF_HOST_DEVICE uint32_t item(const PipelineMemory& memory, uint32_t i) const {
    if (memory.order) return memory.order[order + i];
    return list == 0 ? place + i : memory.capacity - 1 - (place + i);
  }
};

/// Assigns the tiles of the work's lists to blocks, an equal number of consecutive ones to each. Calls
/// begin(list) before the first tile of each list, and answer(tile) for up to kThreads items. All threads
/// must call this.
template <uint32_t kThreads, class Thread, class Begin, class Answer>
NIF_HOST_DEVICE void for_each_tile(const Thread& thread, const PipelineWork& work, const Begin& begin,
                                   const Answer& answer) {
  constexpr uint32_t kTiles = kThreads < kTileItems ? 1 : kThreads / kTileItems;
  const uint32_t start = first_tile(work, work.first_list), end = first_tile(work, work.end_list);
  const uint32_t share = (end - start + thread.blocks() - 1) / thread.blocks();
  if (thread.block() * share >= end - start) return;
  uint32_t tile = start + thread.block() * share;
  const uint32_t last = end - tile < share ? end : tile + share;
  uint32_t list = work.first_list, start_of_list = start, end_of_list = 0;
  while (tile < last) {
    if (tile >= end_of_list) {
      list = list_of_tile(work, tile, list);
      start_of_list = first_tile(work, list);
      end_of_list = first_tile(work, list + 1);
      thread.sync();  // others may still be at the previous list
      begin(list);
      thread.sync();
    }
    const uint32_t stop = end_of_list < last ? end_of_list : last;
    const uint32_t together = stop - tile < kTiles ? stop - tile : kTiles;
    PipelineTile items{list, (tile - start_of_list) * kTileItems, tile * kTileItems, together * kTileItems};
    const uint32_t left = work.items.counts[1 + list] - items.place;
    if (left < items.count) items.count = left;
    answer(items);
    tile += together;
  }
}

/// Passes the answer of an item's network to its ray.
NIF_HOST_DEVICE inline void deliver(const PipelineWork& work, uint32_t item, int32_t logit) {
  if (work.scene.instance_count > 1) {
    work.items.logit[item] = logit;
    return;
  }
  const SceneObject& object = work.scene.objects[work.scene.instances[work.scene.sole].object];
  store_answer<true>(work.query, work.items.ray[item],
                     only_answer({logit, false}, object.calibration, work.query.probability));
}

NIF_HOST_DEVICE inline const PlacedInstance& instance_of(const PipelineWork& work, uint32_t item) {
  return work.scene.instances[work.memory.order ? work.items.instance[item] : work.scene.sole];
}

/// An item's ray in its object's space.
NIF_HOST_DEVICE inline Segment local_ray(const PipelineWork& work, uint32_t item) {
  const PlacedInstance& instance = instance_of(work, item);
  const Segment ray = load_ray(work.query, work.items.ray[item]);
  return instance.identity ? ray : to_object(instance.to_object, ray);
}

}  // namespace nif::kernels::gpu
