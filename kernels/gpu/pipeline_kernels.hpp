// A whole scene by the pipeline of the paper (Fujieda, Kao and Harada 2023), to the bits of scene_answer():
//
// 1. pipeline_walk(): a thread takes its ray through the top level and the objects' occupancy until the ray
// is
//    answered or a network has to be asked. The latter becomes an item of work. Items lie without gaps, and
//    each has a place in the list of its object and field.
// 2. pipeline_offsets() and pipeline_order(): items in the order of lists, each list from a new tile on. A
// scene
//    of one instance has two lists, which need no putting in order: one starts at the first item, the other
//    at the last one.
// 3. Networks: blocks take tiles, load a list's network once, gather the inputs of its items and run the
//    network for a wave's items at once, by matrix instructions. What these have no room for, and rays of
//    more runs than items have room for, go to pipeline_alone(), a thread an item.
// 4. In scenes of several instances that is a round: pipeline_walk() joins the answers and goes on with the
//    rays that are not decided yet. Rays that are left after some rounds are for scene_answer().
//
// The order of items is left to chance. Each names its ray, and nothing of it depends on its neighbours, so
// answers do not depend on that order. How many there are is nowhere asked by the host.
#pragma once

#include "kernels/gpu/scene_kernels.hpp"
#include "kernels/gpu/spherical/half_kernels.hpp"

namespace nif::kernels::gpu {

/// Items that are worked on together, of one list.
inline constexpr uint32_t kTileItems = kBlockThreads;

/// What answers the items of a list: a kernel for each. Half precision: narrow are networks of kHalfTiles,
/// wide ones of kMostHalfTiles.
enum Stage : uint32_t {
  kPairNetworks,
  kAnyNetworks,
  kNarrowOuter,
  kWideOuter,
  kNarrowInner,
  kWideInner,
  kAlone,
  kStages
};

/// A list of items: those of an object's field. Device memory.
struct PipelineList {
  const void* field;  ///< as SceneObject's
  SegmentLayout segment;
  SphericalHalfLayout half;
};

/// All lists of a scene, those of a stage one after the other.
struct PipelineLists {
  const PipelineList* lists;       ///< device memory
  uint32_t first[kStages + 1];     ///< of each stage
  uint32_t walk_words;             ///< of shared memory, for each thread of pipeline_walk(); for the host
  uint32_t shared_bytes[kStages];  ///< that each stage's blocks take; for the host
  uint32_t count() const { return first[kStages]; }
};

/// A round's items. Device memory, [capacity] each.
struct PipelineItems {
  uint32_t* counts;  ///< [1 + lists]: of all items, and of each list's; 0 before the round
  uint32_t* ray;
  uint32_t* instance;  ///< only where items are put in order
  int32_t* logit;      ///< the answers. From here on only of scenes of several instances
  SceneWay* way;       ///< where rays are on their way, this instance asked
};

/// What rounds use one after the other. Device memory.
struct PipelineMemory {
  uint32_t capacity;  ///< items of a round; rays of a query
  uint32_t* about;    ///< [capacity]: see OpenItem
  uint32_t* words;    ///< [kItemWords][capacity]
  // Where items are put in order, else null:
  uint32_t* list;        ///< [capacity]
  uint32_t* place;       ///< [capacity]: in the list
  uint32_t* order;       ///< [capacity + kTileItems * lists]: items by lists, each list from a new tile on
  uint32_t* first_tile;  ///< [1 + lists], of `order`
};

/// Words of an item: the runs of a walk, or the coordinates of a `spherical` ray.
inline constexpr uint32_t kItemWords = 2 * kKeptRuns, kItemCoordinates = 5;
static_assert(kItemCoordinates <= kItemWords);

/// What a kernel of the pipeline is given.
struct PipelineWork {
  SceneArrays scene;
  SceneQuery query;  ///< without visible_bits
  PipelineLists lists;
  PipelineItems before;  ///< of the round before; none in the first
  PipelineItems items;
  PipelineMemory memory;
  uint32_t first_list;    ///< of the stage: for kernels that answer items
  uint32_t end_list;      ///< behind its last one
  uint32_t inputs_alone;  ///< whether networks are left out, for measuring how long the rest takes
};

/// An item in the making; its words are in the thread's column of shared memory.
struct OpenItem {
  uint32_t instance;
  uint32_t list;
  uint32_t about;  ///< `segment`: runs, and flags from bit kItemFlags on
  uint32_t words;  ///< that it has
};
inline constexpr uint32_t kItemFlags = 8;

/// Asks one instance, by a ray in world space. False where a network has to be asked: then `item` says all
/// about it. `column` is the thread's, of words kBlockThreads apart.
template <uint32_t kKinds, bool kDetails>
NIF_HOST_DEVICE bool walk_instance(const SceneArrays& scene, uint32_t number, const Segment& ray,
                                   uint32_t* column, OpenItem& item, ObjectAnswer& answer) {
  const PlacedInstance& instance = scene.instances[number];
  const SceneObject& object = scene.objects[instance.object];
  const Segment local = instance.identity ? ray : to_object(instance.to_object, ray);
  bool known = false;
  if constexpr ((kKinds & kSphericalObject) != 0) {
    if (object.kind == kSphericalObject) {
      const SphericalRay spherical =
          prepare_spherical(*static_cast<const SphericalField*>(object.field), local);
      if (spherical.kind != SphericalKind::none) {
        const bool inner = spherical.kind == SphericalKind::inner;
        const SphericalCoordinates& at = spherical.at;
        item = {number, object.lists[inner], 0, inner ? kItemCoordinates : kItemCoordinates - 1};
        column[0] = bits_as<uint32_t>(at.position_theta);
        column[kBlockThreads] = bits_as<uint32_t>(at.position_phi);
        column[2 * kBlockThreads] = bits_as<uint32_t>(at.direction_theta);
        column[3 * kBlockThreads] = bits_as<uint32_t>(at.direction_phi);
        column[4 * kBlockThreads] = bits_as<uint32_t>(at.distance);
        return false;
      }
      answer = {kCertainLogit, spherical.certain};
      known = true;
    }
  }
  if constexpr ((kKinds & kBvhObject) != 0) {
    if (object.kind == kBvhObject) {
      answer = answer_bvh_ray<kBlockThreads>(*static_cast<const BvhField*>(object.field), local, column);
      known = true;
    }
  }
  if (!known) {
    const KeptRuns<kBlockThreads> kept(reinterpret_cast<float*>(column));
    WalkResult walk;
    walk_object(*static_cast<const DeviceSegmentField*>(object.field), local, walk,
                [&](uint32_t i, const Run& run) { kept.keep(i, run); });
    if (walk.verdict == Verdict::ambiguous) {
      const bool hard = walk.run_count > kKeptRuns;
      const uint32_t flags = uint32_t(walk.saw_outside) | uint32_t(walk.saw_inside) << 1 |
                             uint32_t(walk.starts_in_surface) << 2 | uint32_t(walk.ends_in_surface) << 3;
      item = {number, object.lists[hard], walk.run_count | flags << kItemFlags,
              hard ? 0 : 2 * walk.run_count};
      return false;
    }
    answer = answer_of(walk);
  }
  if (kDetails && !instance.identity && answer.certain && !(ray.tmin > ray.tmax))
    answer.certain =
        instance.well_conditioned && stays_certain(instance.to_object, object.reach_scale, ray, local);
  return true;
}

/// Without details only where the ray is counts.
template <bool kDetails>
NIF_HOST_DEVICE void copy_way(const SceneWay& way, SceneWay& to) {
  to.cursor = way.cursor;
  if (kDetails) to.combined = way.combined;
}

/// Takes one ray on until it is answered, or to the next network: then false, and `item` and `way` say what
/// to ask and where to go on. `at` is the ray, or the item of the round before that it was.
template <uint32_t kKinds, bool kDetails>
NIF_HOST_DEVICE bool walk_on(const PipelineWork& work, uint32_t at, uint32_t* column, uint32_t& number,
                             OpenItem& item, SceneWay& way) {
  const SceneArrays& scene = work.scene;
  const SceneQuery& query = work.query;
  const bool with_probability = kDetails && query.probability;
  number = work.before.counts ? work.before.ray[at] : at;
  const Segment ray = load_ray(query, number);
  SceneAnswer result;
  if (scene.instance_count == 1) {
    ObjectAnswer answer;
    if (!walk_instance<kKinds, kDetails>(scene, 0, ray, column, item, answer)) return false;
    store_answer<kDetails>(
        query, number,
        only_answer(answer, scene.objects[scene.instances[0].object].logit_scale, with_probability));
    return true;
  }
  BoxRay prepared;
  bool done = false;
  if (work.before.counts) {
    prepare_box_ray(ray, prepared);
    copy_way<kDetails>(work.before.way[at], way);
    const PlacedInstance& asked = scene.instances[work.before.instance[at]];
    done = join_answer<kDetails>({work.before.logit[at], false}, scene.objects[asked.object].logit_scale,
                                 with_probability, way, result);
  } else {
    done = !start_way(scene, ray, prepared, way, result);
  }
  const auto ask = [&](uint32_t instance, ObjectAnswer& answer) {
    return walk_instance<kKinds, kDetails>(scene, instance, ray, column, item, answer);
  };
  if (!done && !follow_scene<kDetails>(scene, ray, prepared, with_probability, way, ask, result))
    return false;
  store_answer<kDetails>(query, number, result);
  return true;
}

/// A place in each lane's list, for those lanes that want one. For all lanes of a wave.
template <class Thread>
NIF_HOST_DEVICE uint32_t append_to(const Thread& thread, bool wanted, uint32_t list, uint32_t* counts) {
  uint32_t place = 0;
  for (uint64_t rest = thread.ballot(wanted); rest != 0;) {
    const uint32_t leader = lowest_bit(rest), shared = thread.shuffle(list, leader);
    const bool mine = wanted && list == shared;
    const uint64_t same = thread.ballot(mine);
    uint32_t first = 0;
    if (thread.lane() == leader) first = thread.add(counts + shared, count_bits(same));
    first = thread.shuffle(first, leader);
    if (mine) place = first + count_bits(same & ((uint64_t{1} << thread.lane()) - 1));
    rest &= ~same;
  }
  return place;
}

/// Answers what needs no network, and lists the rest. Blocks of kBlockThreads, any number of them;
/// work.lists.walk_words for each thread.
template <uint32_t kKinds, bool kDetails, class Thread>
NIF_HOST_DEVICE void pipeline_walk(const Thread& thread, const PipelineWork& work) {
  const PipelineItems& items = work.items;
  const PipelineMemory& memory = work.memory;
  uint32_t* const column = reinterpret_cast<uint32_t*>(thread.shared()) + thread.index();
  const uint32_t count = work.before.counts ? *work.before.counts : work.query.count,
                 step = thread.blocks() * kBlockThreads;
  // All lanes of a wave go round together.
  for (uint32_t first = thread.block() * kBlockThreads; first < count;) {
    uint32_t ray = 0;
    OpenItem open{};
    SceneWay way{};
    const bool wanted = thread.index() < count - first &&
                        !walk_on<kKinds, kDetails>(work, first + thread.index(), column, ray, open, way);
    const uint32_t place = append_to(thread, wanted, open.list, items.counts + 1);
    uint32_t item = open.list == 0 ? place : memory.capacity - 1 - place;
    if (memory.order) item = append(thread, wanted, items.counts);
    if (wanted) {
      items.ray[item] = ray;
      if (memory.order) {
        items.instance[item] = open.instance;
        if (items.way) copy_way<kDetails>(way, items.way[item]);
        memory.list[item] = open.list;
        memory.place[item] = place;
      }
      memory.about[item] = open.about;
      for (uint32_t i = 0; i < open.words; ++i)
        memory.words[size_t(i) * memory.capacity + item] = column[i * kBlockThreads];
    }
    if (count - first <= step) return;  // first + step may be more than 32 bits
    first += step;
  }
}

/// Where each list's tiles start. One block of kBlockThreads; as many words of shared memory, and one.
template <class Thread>
NIF_HOST_DEVICE void pipeline_offsets(const Thread& thread, const PipelineWork& work) {
  uint32_t* const sums = reinterpret_cast<uint32_t*>(thread.shared());
  const uint32_t lists = work.lists.first[kStages], share = (lists + kBlockThreads - 1) / kBlockThreads;
  const uint32_t first = thread.index() * share < lists ? thread.index() * share : lists,
                 last = lists - first < share ? lists : first + share;
  const auto tiles = [&](uint32_t list) {
    return (work.items.counts[1 + list] + kTileItems - 1) / kTileItems;
  };
  uint32_t sum = 0;
  for (uint32_t list = first; list < last; ++list) sum += tiles(list);
  sums[thread.index()] = sum;
  thread.sync();
  if (thread.index() == 0) {
    uint32_t before = 0;
    NIF_NO_UNROLL
    for (uint32_t i = 0; i < kBlockThreads; ++i) {
      const uint32_t own = sums[i];
      sums[i] = before;
      before += own;
    }
    work.memory.first_tile[lists] = before;
  }
  thread.sync();
  uint32_t at = sums[thread.index()];
  for (uint32_t list = first; list < last; ++list) {
    work.memory.first_tile[list] = at;
    at += tiles(list);
  }
}

/// Puts items in the order of lists. Blocks of kBlockThreads, any number of them; no shared memory.
template <class Thread>
NIF_HOST_DEVICE void pipeline_order(const Thread& thread, const PipelineWork& work) {
  const PipelineMemory& memory = work.memory;
  const uint32_t count = *work.items.counts, step = thread.blocks() * kBlockThreads;
  for (uint32_t item = thread.block() * kBlockThreads + thread.index(); item < count;) {
    memory.order[memory.first_tile[memory.list[item]] * kTileItems + memory.place[item]] = item;
    if (count - item <= step) return;
    item += step;
  }
}

/// Where a list's tiles start; behind the last list: where all of them end.
NIF_HOST_DEVICE inline uint32_t first_tile(const PipelineWork& work, uint32_t list) {
  if (work.memory.order) return work.memory.first_tile[list];
  uint32_t tiles = 0;
  for (uint32_t before = 0; before < list; ++before)
    tiles += (work.items.counts[1 + before] + kTileItems - 1) / kTileItems;
  return tiles;
}

/// Up to a block's threads of items, all of one list.
struct PipelineTile {
  uint32_t list;
  uint32_t place;  ///< of the first one, in the list
  uint32_t order;  ///< and in PipelineMemory::order
  uint32_t count;

  NIF_HOST_DEVICE uint32_t item(const PipelineMemory& memory, uint32_t i) const {
    if (memory.order) return memory.order[order + i];
    return list == 0 ? place + i : memory.capacity - 1 - (place + i);
  }
};

/// Deals the tiles of the work's lists to blocks, to each as many in a row. Calls begin(list) before the
/// first tile of each list, and answer(tile) for up to kThreads items. For all threads.
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
      // The last list that starts here or before: those without items start where the next one does.
      uint32_t above = work.end_list;
      while (above - list > 1) {
        const uint32_t middle = list + (above - list) / 2;
        if (first_tile(work, middle) <= tile)
          list = middle;
        else
          above = middle;
      }
      start_of_list = first_tile(work, list);
      end_of_list = first_tile(work, list + 1);
      thread.sync();  // others may still be at the list before
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

/// Gives the answer of an item's network to its ray.
NIF_HOST_DEVICE inline void deliver(const PipelineWork& work, uint32_t item, int32_t logit) {
  if (work.scene.instance_count > 1) {
    work.items.logit[item] = logit;
    return;
  }
  const SceneObject& object = work.scene.objects[work.scene.instances[0].object];
  store_answer<true>(work.query, work.items.ray[item],
                     only_answer({logit, false}, object.logit_scale, work.query.probability));
}

NIF_HOST_DEVICE inline const PlacedInstance& instance_of(const PipelineWork& work, uint32_t item) {
  return work.scene.instances[work.memory.order ? work.items.instance[item] : 0];
}

/// An item's ray in its object's space.
NIF_HOST_DEVICE inline Segment local_ray(const PipelineWork& work, uint32_t item) {
  const PlacedInstance& instance = instance_of(work, item);
  const Segment ray = load_ray(work.query, work.items.ray[item]);
  return instance.identity ? ray : to_object(instance.to_object, ray);
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
  walk.starts_in_surface = about >> (kItemFlags + 2) & 1;
  walk.ends_in_surface = about >> (kItemFlags + 3) & 1;
  const auto run = [&](uint32_t i) {
    const uint32_t* const at = memory.words + size_t(2 * i) * memory.capacity + item;
    return Run{bits_as<float>(at[0]), bits_as<float>(at[memory.capacity])};
  };
  // In the walk's own order, so with its bits.
  walk.surface_t = 0;
  for (uint32_t i = 0; i < walk.run_count; ++i) walk.surface_t += run(i).end - run(i).begin;
  SamplePlacer placer(field, walk);
  for (uint32_t i = 0; i < walk.run_count; ++i)
    placer.add(run(i), i + 1 == walk.run_count, [&](uint32_t number, const SamplePoint& point) {
      put_features<kFeatures>(field, number, point, inputs);
    });
  put_globals(field, walk, inputs);
}

/// Asks the networks of `segment` objects. Blocks of kBlockThreads, any number of them.
template <class Matrix, uint32_t kFeatures, class Thread>
NIF_HOST_DEVICE void pipeline_segments(const Thread& thread, const PipelineWork& work) {
  const auto layout_of = [&](uint32_t list) -> const SegmentLayout& {
    return work.lists.lists[list].segment;
  };
  const auto field_of = [&](uint32_t list) -> const DeviceSegmentField& {
    return *static_cast<const DeviceSegmentField*>(work.lists.lists[list].field);
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

/// Asks the networks of `spherical` objects in half precision, the outer or the inner ones. Blocks of
/// kHalfThreads, any number of them.
template <class Matrix, SphericalKind kKind, uint32_t kTiles, class Thread>
NIF_HOST_DEVICE void pipeline_halves(const Thread& thread, const PipelineWork& work) {
  constexpr bool kOuter = kKind == SphericalKind::outer;
  const auto layout_of = [&](uint32_t list) -> const HalfNetworkLayout& {
    return kOuter ? work.lists.lists[list].half.outer : work.lists.lists[list].half.inner;
  };
  const auto field_of = [&](uint32_t list) -> const SphericalField& {
    return *static_cast<const SphericalField*>(work.lists.lists[list].field);
  };
  const auto begin = [&](uint32_t list) {
    load_half_network(thread, kOuter ? field_of(list).outer : field_of(list).inner, layout_of(list));
  };
  const uint32_t wave = thread.wave_size(), first = thread.wave() * wave;
  for_each_tile<kHalfThreads>(thread, work, begin, [&](const PipelineTile& tile) {
    if (first >= tile.count) return;
    const HalfNetworkLayout& layout = layout_of(tile.list);
    const SphericalField& field = field_of(tile.list);
    const SphericalNetwork& network = kOuter ? field.outer : field.inner;
    unsigned char* const rows = thread.shared() + layout.inputs_offset + first * layout.first_stride;
    const bool present = thread.lane() < tile.count - first;
    const uint32_t item = present ? tile.item(work.memory, first + thread.lane()) : 0;
    if (present) {
      const auto coordinate = [&](uint32_t i) {
        return bits_as<float>(work.memory.words[size_t(i) * work.memory.capacity + item]);
      };
      const SphericalRay ray{
          kKind,
          false,
          0,
          {coordinate(0), coordinate(1), coordinate(2), coordinate(3), kOuter ? 0.0f : coordinate(4)}};
      put_half_inputs(field, ray, network.inputs, rows + thread.lane() * layout.first_stride);
    }
    if (work.inputs_alone) return;
    const float output = evaluate_half_wave<Matrix, kTiles>(thread, network, layout, field.slope, rows);
    if (present) deliver(work, item, spherical_logit(output));
  });
}

/// Asks objects by a thread an item, from the ray on. Blocks of kSceneThreads, any number of them;
/// work.scene.layout.bytes.
template <class Thread>
NIF_HOST_DEVICE void pipeline_alone(const Thread& thread, const PipelineWork& work) {
  constexpr uint32_t kKinds = kSegments | kSphericalObject;
  const SceneLayout& layout = work.scene.layout;
  uint32_t* const row = reinterpret_cast<uint32_t*>(thread.shared()) + thread.index() * layout.row;
  for_each_tile<kTileItems>(
      thread, work, [](uint32_t) {},
      [&](const PipelineTile& tile) {
        if (thread.index() >= layout.rays) return;
        for (uint32_t i = thread.index(); i < tile.count; i += layout.rays) {
          const uint32_t item = tile.item(work.memory, i);
          const PlacedInstance& instance = instance_of(work, item);
          const ObjectAnswer answer =
              ask_object<kKinds>(thread, work.scene.objects[instance.object], local_ray(work, item), row);
          deliver(work, item, answer.logit);
        }
      });
}

/// What pack_bits() is given. Device memory of any alignment.
struct PackWork {
  const unsigned char* visible;  ///< [count]
  unsigned char* bits;           ///< [(count + 7) / 8]
  uint32_t count;
};

/// visible_bits of what is visible, a thread eight rays. Blocks of kBlockThreads; no shared memory.
template <class Thread>
NIF_HOST_DEVICE void pack_bits(const Thread& thread, const PackWork& work) {
  const uint32_t bytes = (work.count + 7) / 8, step = thread.blocks() * kBlockThreads;
  for (uint32_t i = thread.block() * kBlockThreads + thread.index(); i < bytes;) {
    uint32_t bits = 0;
    for (uint32_t k = 0; k < 8 && 8 * i + k < work.count; ++k) bits |= (work.visible[8 * i + k] & 1u) << k;
    work.bits[i] = static_cast<unsigned char>(bits);
    if (bytes - i <= step) return;
    i += step;
  }
}

}  // namespace nif::kernels::gpu
