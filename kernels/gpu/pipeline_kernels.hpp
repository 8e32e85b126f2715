// Answers a whole scene by the pipeline of the paper (Fujieda, Kao and Harada 2023), with the bits of
// scene_answer():
//
// 1. pipeline_traverse(): a thread takes its ray through the top level and the objects' occupancy until the
// ray
//    is answered or a network must decide. Such a ray becomes an item of work. Items are stored without gaps,
//    and each has a place in the list of its object and field.
// 2. pipeline_offsets() and pipeline_order(): sort items by list, each list starting at a new tile. A scene
//    of one instance has two lists, which need no sorting: one starts at the first item, the other at the
//    last.
// 3. Networks: blocks take tiles, load a list's network once, gather the inputs of its items and evaluate the
//    network for a wave's items at once, by matrix instructions. Networks that do not fit, and rays with more
//    intervals than items have room for, go to pipeline_alone(), one thread per item.
// 4. In scenes of several instances that is one round: pipeline_traverse() combines the answers and continues
//    with the rays that are not decided yet. Rays that are left after some rounds go to scene_answer().
//
// The order of items is left to chance. Each item names its ray, and nothing in it depends on its neighbours,
// so answers do not depend on that order. The host never asks how many items there are.
#pragma once

#include "kernels/gpu/pipeline_work.hpp"
#include "kernels/gpu/scene_kernels.hpp"

namespace nif::kernels::gpu {

/// Asks one object of the kinds in a set, like Encoding::traverse().
template <uint32_t kKinds, class Encoding, class... Others>
NIF_HOST_DEVICE NIF_INLINE bool traverse_one_of(EncodingList<Encoding, Others...>, const SceneObject& object,
                                                const Segment& ray, uint32_t* column, OpenItem& item,
                                                ObjectAnswer& answer) {
  constexpr uint32_t kOwn = kKinds & kKindsOf<Encoding>, kRest = kKinds & ~kOwn;
  if constexpr (kOwn != 0)
    if (kRest == 0 || (object.kind & kOwn) != 0)
      return Encoding::template traverse<(kOwn >> kFirstKindBit<Encoding>)>(object, ray, column, item,
                                                                            answer);
  if constexpr (kRest != 0)
    return traverse_one_of<kRest>(EncodingList<Others...>(), object, ray, column, item, answer);
  return true;
}

/// Asks one instance, for a ray in world space. Returns false if a network must decide: then `item` describes
/// the question. `column` is the thread's own, of words kBlockThreads apart.
template <uint32_t kKinds, bool kDetails>
NIF_HOST_DEVICE bool traverse_instance(const SceneArrays& scene, uint32_t number, const Segment& ray,
                                       uint32_t* column, OpenItem& item, ObjectAnswer& answer) {
  const PlacedInstance& instance = scene.instances[number];
  const SceneObject& object = scene.objects[instance.object];
  const Segment local = instance.identity ? ray : to_object(instance.to_object, ray);
  item.instance = number;
  if (!traverse_one_of<kKinds>(Encodings(), object, local, column, item, answer)) return false;
  to_world<kDetails>(instance, object.reach_scale, ray, local, answer);
  return true;
}

/// Without details, only the ray's position on its way counts.
template <bool kDetails>
NIF_HOST_DEVICE void copy_way(const SceneWay& way, SceneWay& to) {
  to.cursor = way.cursor;
  if (kDetails) to.combined = way.combined;
}

/// Advances one ray until it is answered, or to the next network: then returns false, and `item` and `way`
/// say what to ask and where to continue. `at` is the ray, or its item in the previous round.
template <uint32_t kKinds, bool kDetails>
NIF_HOST_DEVICE bool traverse_on(const PipelineWork& work, uint32_t at, uint32_t* column, uint32_t& number,
                                 OpenItem& item, SceneWay& way) {
  const SceneArrays& scene = work.scene;
  const SceneQuery& query = work.query;
  const bool with_probability = kDetails && query.probability;
  number = work.before.counts ? work.before.ray[at] : at;
  const Segment ray = load_ray(query, number);
  SceneAnswer result;
  if (scene.instance_count == 1) {
    ObjectAnswer answer;
    if (!traverse_instance<kKinds, kDetails>(scene, scene.sole, ray, column, item, answer)) return false;
    store_answer<kDetails>(
        query, number,
        only_answer(answer, scene.objects[scene.instances[scene.sole].object].calibration, with_probability));
    return true;
  }
  BoxRay prepared;
  bool done = false;
  if (work.before.counts) {
    prepare_box_ray(ray, prepared);
    copy_way<kDetails>(work.before.way[at], way);
    const PlacedInstance& asked = scene.instances[work.before.instance[at]];
    done = join_answer<kDetails>({work.before.logit[at], false}, scene.objects[asked.object].calibration,
                                 with_probability, way, result);
  } else {
    done = !start_way(scene, ray, prepared, way, result);
  }
  const auto ask = [&](uint32_t instance, ObjectAnswer& answer) {
    return traverse_instance<kKinds, kDetails>(scene, instance, ray, column, item, answer);
  };
  const auto meets = [](uint32_t) { return true; };  // queries with masks do not use the pipeline
  if (!done && !follow_scene<kDetails>(scene, ray, prepared, with_probability, way, meets, ask, result))
    return false;
  store_answer<kDetails>(query, number, result);
  return true;
}

/// A place in each lane's list, for the lanes that want one. All lanes of a wave must call this.
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

/// Answers what needs no network, and lists the rest. Any number of blocks of kBlockThreads; shared memory
/// holds as many words per thread as the encodings' traversals need.
template <uint32_t kKinds, bool kDetails, class Thread>
NIF_HOST_DEVICE void pipeline_traverse(const Thread& thread, const PipelineWork& work) {
  const PipelineItems& items = work.items;
  const PipelineMemory& memory = work.memory;
  uint32_t* const column = reinterpret_cast<uint32_t*>(thread.shared()) + thread.index();
  const uint32_t count = work.before.counts ? *work.before.counts : work.query.count,
                 step = thread.blocks() * kBlockThreads;
  // All lanes of a wave loop together.
  for (uint32_t first = thread.block() * kBlockThreads; first < count;) {
    uint32_t ray = 0;
    OpenItem open{};
    SceneWay way{};
    const bool wanted = thread.index() < count - first &&
                        !traverse_on<kKinds, kDetails>(work, first + thread.index(), column, ray, open, way);
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

/// Computes where each list's tiles start. One block of kBlockThreads; one word of shared memory per thread,
/// and one more.
template <class Thread>
NIF_HOST_DEVICE void pipeline_offsets(const Thread& thread, const PipelineWork& work) {
  uint32_t* const sums = reinterpret_cast<uint32_t*>(thread.shared());
  const uint32_t lists = work.list_count, share = (lists + kBlockThreads - 1) / kBlockThreads;
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

/// Sorts items by list. Any number of blocks of kBlockThreads; no shared memory.
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

/// Answers each item by one thread, starting again from the ray. If there are few items, each has a block to
/// itself: lanes of one wave would wait for each other, and such rays take long. Any number of blocks of
/// kSceneThreads; work.scene.layout.bytes of shared memory.
template <class Thread>
NIF_HOST_DEVICE void pipeline_alone(const Thread& thread, const PipelineWork& work) {
  const SceneLayout& layout = work.scene.layout;
  uint32_t* const row = reinterpret_cast<uint32_t*>(thread.shared()) + thread.index() * layout.row;
  const uint32_t start = first_tile(work, work.first_list);
  const uint32_t places = (first_tile(work, work.end_list) - start) * kTileItems;
  const uint32_t even = (places + thread.blocks() - 1) / thread.blocks(),
                 share = even < layout.rays ? even : layout.rays;
  if (thread.index() >= share) return;
  const uint32_t step = thread.blocks() * share;
  for (uint32_t at = thread.block() * share + thread.index(); at < places;) {
    const uint32_t tile = start + at / kTileItems, list = list_of_tile(work, tile, work.first_list),
                   in_list = tile - first_tile(work, list), within = at % kTileItems;
    const PipelineTile items{list, in_list * kTileItems, tile * kTileItems, kTileItems};
    if (items.place + within < work.items.counts[1 + list]) {
      const uint32_t item = items.item(work.memory, within);
      const PlacedInstance& instance = instance_of(work, item);
      const ObjectAnswer answer = ask_object<kKindsWithItems>(thread, work.scene.objects[instance.object],
                                                              local_ray(work, item), row);
      deliver(work, item, answer.logit);
    }
    if (places - at <= step) return;
    at += step;
  }
}

/// Arguments of pack_bits(). Device memory of any alignment.
struct PackWork {
  const unsigned char* visible;  ///< [count]
  unsigned char* bits;           ///< [(count + 7) / 8]
  uint32_t count;
};

/// Packs `visible` into visible_bits, eight rays per thread. Blocks of kBlockThreads; no shared memory.
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
