// Builds scenes and commits them. An instance that no ray can meet (removed, disabled, or with mask 0) gets
// an empty box: it stays in the hierarchy, where it costs only its slot, until the next rebuild.
#include "scene/scene.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>

#include "api/error.hpp"
#include "query/job.hpp"

namespace nif::runtime {

uint32_t asset_object(const NifSceneObject& scene, size_t instance) {
  const uint32_t bent = scene.settings[instance].bent;
  return bent == kNotBent ? scene.instances[instance].object : scene.bent[bent].source;
}

namespace {

Transform read_transform(const float* transform) {
  if (transform == nullptr) return kIdentity;
  Transform result;
  std::copy_n(transform, 12, result.begin());
  return result;
}

/// Reserves room for more elements, in steps that keep adding cheap.
template <class T>
void make_room(std::pmr::vector<T>& values, size_t more) {
  const size_t needed = values.size() + more;
  if (needed > values.capacity()) values.reserve(std::max(needed, values.capacity() * 2));
}

/// Keeps boxes outside the hierarchy until the next commit, because the hierarchy must be rebuilt.
void keep_boxes_aside(NifSceneObject& scene, size_t more) {
  if (!scene.new_boxes.empty()) return make_room(scene.new_boxes, more);
  scene.new_boxes.reserve(scene.instances.size() + more);
  for (const Instance& instance : scene.instances)
    scene.new_boxes.push_back(instance.place == kNoBox ? empty_box() : scene.hierarchy.box(instance.place));
}

/// Prepares to add `count` instances of the asset: reserves room, so that nothing later can fail, and takes a
/// reference to the asset. Returns the index of its first object.
uint32_t prepare(NifSceneObject& scene, NifAssetObject* asset, size_t count) {
  if (asset->device.get() != scene.device.get())
    refuse_argument(std::string(asset->name) + ": belongs to another device than the scene");
  if (count > kMaxInstances - scene.instances.size())
    refuse_argument("a scene holds at most 2^31 - 1 instances");
  make_room(scene.instances, count);
  make_room(scene.settings, count);
  keep_boxes_aside(scene, count);

  const auto by_address = [](const HeldAsset& held, const NifAssetObject* wanted) {
    return std::less<const NifAssetObject*>()(held.asset.get(), wanted);
  };
  const auto at = std::lower_bound(scene.assets.begin(), scene.assets.end(), asset, by_address);
  if (at != scene.assets.end() && at->asset.get() == asset) return at->first_object;
  const size_t first = scene.objects.size();
  if (asset->view.objects.size() > kMaxPlacedObjects - first)
    refuse_argument("a scene holds at most 2^29 objects");
  make_room(scene.objects, asset->view.objects.size());
  scene.assets.insert(at, {Ref<NifAssetObject>(asset), uint32_t(first)});
  for (size_t i = 0; i < asset->view.objects.size(); ++i) {
    const format::ObjectView& view = asset->view.objects[i];
    if (view.unsupported) {  // no instance can name it
      scene.objects.emplace_back();
      continue;
    }
    const kernels::AnyField field = field_of(view);
    scene.objects.push_back({&view, asset->kernels[i].get(), kernels::calibration(field),
                             kernels::reach_scale(field), uint32_t(i),
                             hit_details(asset->view, uint32_t(i))});
  }
  return uint32_t(first);
}

/// An instance as queries see it, and its box.
struct Placed {
  Instance instance;
  kernels::WorldBox box;
};

/// Sets all members except object and place. Throws Failure if there can be no such instance.
Placed place(const NifSceneObject& scene, const kernels::ObjectBox& box, bool proven,
             const InstanceSettings& settings) {
  const Placement placement = placement_of(settings, scene.origin);
  for (const int a : {3, 7, 11})
    if (std::isfinite(settings.transform[size_t(a)]) && !std::isfinite(placement.to_world[size_t(a)]))
      refuse_argument("the instance is too far from the scene's origin for single precision");
  Placed placed{make_instance(placement), world_box(box, placement)};
  placed.instance.mask = settings.mask;
  placed.instance.unproven = !proven;
  return placed;
}
Placed place(const NifSceneObject& scene, const format::ObjectView& object,
             const InstanceSettings& settings) {
  return place(scene, object_box(field_of(object)), object.proven, settings);
}
Placed place(const NifSceneObject& scene, const PlacedObject& object, const InstanceSettings& settings) {
  if (object.bent == nullptr) return place(scene, *object.view, settings);
  return place(scene, kernels::object_box(*object.bent), object.view->proven, settings);
}

/// Call after prepare(); cannot fail. number: a free one, or the one after the last.
void put(NifSceneObject& scene, uint32_t number, uint32_t object, const InstanceSettings& settings,
         const Placed& placed) {
  if (number == scene.instances.size()) {
    scene.instances.emplace_back();
    scene.settings.emplace_back();
    scene.new_boxes.emplace_back();
  }
  scene.instances[number] = placed.instance;
  scene.instances[number].object = object & (kMaxPlacedObjects - 1);
  scene.instances[number].place = kNoBox;
  scene.settings[number] = settings;
  scene.new_boxes[number] = placed.box;
  ++scene.live;
  scene.committed = false;
}

/// Returns the first of the lowest `count` consecutive free numbers. Gaps that were too short are not
/// searched again until an instance is removed, so adding many instances looks at each number only once.
uint32_t free_numbers(NifSceneObject& scene, size_t count) {
  const auto end = uint32_t(scene.settings.size());
  uint32_t& first = scene.first_free;
  while (first < end && scene.settings[first].exists) ++first;
  if (count > scene.longest_gap) return end;
  uint32_t longest = 0;
  for (uint32_t at = first, begin = first; at < end; ++at) {
    if (scene.settings[at].exists) {
      begin = at + 1;
      continue;
    }
    longest = std::max(longest, at + 1 - begin);
    if (longest == count) return begin;
  }
  scene.longest_gap = longest;
  return end;  // the last number is never free
}

void check_instance(const NifSceneObject& scene, uint32_t instance) {
  if (instance >= scene.settings.size() || !scene.settings[instance].exists)
    refuse_argument("no instance " + std::to_string(instance) + "; the scene has " +
                    std::to_string(scene.live) +
                    (scene.live < scene.settings.size() ? ", and others were removed" : ""));
}

void set_box(NifSceneObject& scene, uint32_t instance, const kernels::WorldBox& box) {
  const uint32_t place = scene.instances[instance].place;
  if (!scene.new_boxes.empty())
    scene.new_boxes[instance] = box;
  else if (place != kNoBox)
    scene.hierarchy.set_box(place, box);
}

/// Gives an instance new settings: all or nothing.
void change(NifSceneObject& scene, uint32_t instance, const InstanceSettings& settings) {
  const Instance& before = scene.instances[instance];
  Placed placed = place(scene, scene.objects[before.object], settings);
  if (settings.awake() && before.place == kNoBox) keep_boxes_aside(scene, 0);
  placed.instance.object = before.object;
  placed.instance.place = before.place;
  scene.instances[instance] = placed.instance;
  scene.settings[instance] = settings;
  set_box(scene, instance, settings.awake() ? placed.box : empty_box());
  scene.committed = false;
}

Origin read_origin(const double* origin) {
  if (origin == nullptr) return {};
  for (int a = 0; a < 3; ++a)
    if (!std::isfinite(origin[a])) refuse_argument("the origin is not finite");
  return {origin[0], origin[1], origin[2]};
}

/// Recomputes all instances relative to the scene's new origin: all or nothing.
void move_instances(NifSceneObject& scene) {
  std::pmr::vector<Placed> placed(scene.device->memory());
  placed.reserve(scene.instances.size());
  for (size_t i = 0; i < scene.instances.size(); ++i) {
    const InstanceSettings& settings = scene.settings[i];
    if (!settings.exists) {
      placed.push_back({scene.instances[i], empty_box()});
      continue;
    }
    try {
      placed.push_back(place(scene, scene.objects[scene.instances[i].object], settings));
    } catch (const Failure& failure) {
      throw Failure(failure.code(), "instance " + std::to_string(i) + ": " + failure.what());
    }
  }
  for (uint32_t i = 0; i < placed.size(); ++i) {
    placed[i].instance.object = scene.instances[i].object;
    placed[i].instance.place = scene.instances[i].place;
    scene.instances[i] = placed[i].instance;
    set_box(scene, i, scene.settings[i].awake() ? placed[i].box : empty_box());
  }
  scene.moved = false;
}

/// Releases assets that no instance uses any more.
void drop_unused_assets(NifSceneObject& scene) {
  std::pmr::vector<bool> used(scene.objects.size(), false, scene.device->memory());
  for (size_t i = 0; i < scene.instances.size(); ++i)
    if (scene.settings[i].exists) used[asset_object(scene, i)] = true;
  std::pmr::vector<HeldAsset> kept(scene.device->memory());
  std::pmr::vector<PlacedObject> objects(scene.device->memory());
  std::pmr::vector<uint32_t> renumbered(scene.objects.size(), 0, scene.device->memory());
  scene.dropped.reserve(scene.dropped.size() + scene.assets.size());
  kept.reserve(scene.assets.size());
  objects.reserve(scene.objects.size());
  for (const HeldAsset& held : scene.assets) {
    const auto begin = held.first_object, end = begin + uint32_t(held.asset->view.objects.size());
    if (std::none_of(used.begin() + begin, used.begin() + end, [](bool is) { return is; })) continue;
    kept.push_back({held.asset, uint32_t(objects.size())});
    for (uint32_t i = begin; i < end; ++i) {
      renumbered[i] = uint32_t(objects.size());
      objects.push_back(scene.objects[i]);
    }
  }
  // Those of instances that bend come after those of assets.
  for (const BentInstance& bent : scene.bent) {
    renumbered[bent.object] = uint32_t(objects.size());
    objects.push_back(scene.objects[bent.object]);
  }
  // Nothing fails from here on.
  scene.has_removed = false;
  if (kept.size() == scene.assets.size()) return;
  for (BentInstance& bent : scene.bent) {
    bent.object = renumbered[bent.object];
    bent.source = renumbered[bent.source];
  }
  for (size_t i = 0; i < scene.instances.size(); ++i)
    scene.instances[i].object = renumbered[scene.instances[i].object] & (kMaxPlacedObjects - 1);
  size_t k = 0;
  for (HeldAsset& held : scene.assets) {
    if (k < kept.size() && kept[k].asset.get() == held.asset.get())
      ++k;
    else
      scene.dropped.push_back(std::move(held.asset));
  }
  scene.assets.swap(kept);
  scene.objects.swap(objects);
}

/// Returns the only instance that rays can meet, or kNoInstance if there are none or several.
uint32_t find_sole(const NifSceneObject& scene) {
  uint32_t sole = kernels::kNoInstance, awake = 0;
  for (uint32_t i = 0; i < scene.settings.size() && awake < 2; ++i)
    if (scene.settings[i].awake()) sole = i, ++awake;
  return awake == 1 ? sole : kernels::kNoInstance;
}

/// Takes the poses that come from memory of the GPU. Returns which one was refused, and why: that of the lowest instance.
std::optional<Failure> receive_poses([[maybe_unused]] NifSceneObject& scene) {
  std::optional<Failure> refused;
#ifndef NIF_WITHOUT_BENDING
  NifDeviceObject& device = *scene.device.get();
  uint32_t lowest = kernels::kNoInstance, others = 0;
  for (const BentInstance& bent : scene.bent) {
    if (bent.instance == kernels::kNoInstance || !bent.own->expected()) continue;
    try {
      bent.own->receive(device);
    } catch (const Failure& failure) {
      const std::string sentence = "instance " + std::to_string(bent.instance) + ": " + failure.what() +
                                   "; it keeps the vertices that it had";
      if (failure.code() != NIF_ERROR_DEVICE_LOST) device.log(NIF_LOG_WARNING, [&] { return sentence; });
      others += refused.has_value();
      if (bent.instance > lowest) continue;
      lowest = bent.instance;
      refused.emplace(failure.code(), sentence);
    }
  }
  if (others > 0)
    refused.emplace(refused->code(), refused->what() + (", and so do " + std::to_string(others)) + " more");
#endif
  return refused;
}

/// Refits the instances that have bent.
void commit_bent([[maybe_unused]] NifSceneObject& scene) {
#ifndef NIF_WITHOUT_BENDING
  refit_together(scene);
  for (const BentInstance& bent : scene.bent) {
    if (bent.instance == kernels::kNoInstance || !bent.own->refitted()) continue;
    scene.objects[bent.object].reach_scale = kernels::reach_scale(kernels::AnyField(bent.own->field()));
    change(scene, bent.instance, scene.settings[bent.instance]);
    bent.own->forget_refit();
  }
#endif
}

/// Does a commit, except for the GPU.
void commit_instances(NifSceneObject& scene) {
  auto* memory = scene.device->memory();
  scene.ready_on_gpu = false;
  commit_bent(scene);
  if (scene.moved) move_instances(scene);
  if (scene.has_removed) drop_unused_assets(scene);
  // Without instances there are no boxes aside either, whatever the hierarchy still has.
  if (!scene.new_boxes.empty() || scene.instances.empty() || !scene.hierarchy.refit()) {
    const size_t count = scene.instances.size();
    std::pmr::vector<uint32_t> places(count, memory);
    keep_boxes_aside(scene, 0);
    scene.instances.shrink_to_fit();
    scene.settings.shrink_to_fit();
    scene.objects.shrink_to_fit();
    scene.hierarchy.build(scene.new_boxes, places);
    for (size_t i = 0; i < count; ++i) scene.instances[i].place = places[i];
    std::pmr::vector<kernels::WorldBox>(memory).swap(scene.new_boxes);
  }
  scene.bounds = scene.hierarchy.bounds();
  scene.sole = find_sole(scene);
  scene.unproven = false;
  for (size_t i = 0; i < scene.instances.size(); ++i)
    scene.unproven = scene.unproven || (scene.instances[i].unproven && scene.settings[i].awake());
  scene.committed = true;
}

}  // namespace

NifSceneObject* new_scene(NifDeviceObject* device) {
  return create<NifSceneObject>(device->memory(), device);
}

void release(NifSceneObject* scene) {
  if (scene == nullptr || !scene->drop()) return;
  const Ref<NifDeviceObject> device = scene->device;
  destroy(device->memory(), scene);
}

Added add_instance(NifSceneObject& scene, NifAssetObject* asset, uint32_t object, const float* transform) {
  InstanceSettings settings;
  settings.transform = read_transform(transform);
  const Placed placed = place(scene, answerable(*asset, object), settings);
  const uint32_t first_object = prepare(scene, asset, 1), number = free_numbers(scene, 1);
  put(scene, number, first_object + object, settings, placed);
  return {number, 1};
}

Added add_asset(NifSceneObject& scene, NifAssetObject* asset, const float* transform) {
  const format::AssetView& view = asset->view;
  const Transform outer = read_transform(transform);
  std::pmr::vector<InstanceSettings> settings(scene.device->memory());
  std::pmr::vector<Placed> placed(scene.device->memory());
  std::pmr::vector<uint32_t> objects(scene.device->memory());
  const size_t count = view.placed_count();
  settings.reserve(count);
  placed.reserve(count);
  objects.reserve(count);
  view.for_each_placed([&](uint32_t object, const format::InstanceView* instance) {
    InstanceSettings& own = settings.emplace_back();
    Placement whole{outer, {}};
    if (instance) {
      whole = {instance->transform, instance->remainder};
      if (transform) whole = combine(outer, whole);
      own.mask = instance->mask;
      own.flags = instance->flags;
      own.user = instance->user;
    }
    own.transform = whole.to_world;
    own.remainder = whole.remainder;
    const format::ObjectView& placed_object = answerable(*asset, object);
    try {
      placed.push_back(place(scene, placed_object, own));
    } catch (const Failure& failure) {
      if (!instance) throw;
      throw Failure(failure.code(), std::string(asset->name) + ": instance " +
                                        std::to_string(settings.size() - 1) + " (" +
                                        std::string(instance->name) + "): " + failure.what());
    }
    if (!own.awake()) placed.back().box = empty_box();
    objects.push_back(object);
  });
  const uint32_t first_object = prepare(scene, asset, count);
  const uint32_t first = free_numbers(scene, count);
  for (uint32_t i = 0; i < count; ++i)
    put(scene, first + i, first_object + objects[i], settings[i], placed[i]);
  return {first, uint32_t(count)};
}

void remove_instance(NifSceneObject& scene, uint32_t instance) {
  check_instance(scene, instance);
  if (uint32_t& bent = scene.settings[instance].bent; bent != kNotBent) {
    scene.bent[bent].instance = kernels::kNoInstance;
    scene.instances[instance].object = scene.bent[bent].source & (kMaxPlacedObjects - 1);
    bent = kNotBent;
  }
  scene.settings[instance].exists = false;
  set_box(scene, instance, empty_box());
  scene.first_free = std::min(scene.first_free, instance);
  scene.longest_gap = kMaxInstances;
  while (!scene.settings.empty() && !scene.settings.back().exists) {
    scene.settings.pop_back();
    scene.instances.pop_back();
    if (!scene.new_boxes.empty()) scene.new_boxes.pop_back();
  }
  --scene.live;
  scene.has_removed = true;
  scene.committed = false;
}

void set_transforms(NifSceneObject& scene, uint64_t count, const uint32_t* instances, const float* transforms,
                    uint64_t stride) {
  const auto number = [&](uint64_t k) { return instances ? instances[k] : uint32_t(k); };
  const auto changed = [&](uint64_t k) {
    InstanceSettings settings = scene.settings[number(k)];
    settings.remainder = {};
    settings.transform = kIdentity;
    // Computed as an integer: a stride may be negative, in two's complement.
    if (transforms)
      std::memcpy(
          settings.transform.data(),
          reinterpret_cast<const void*>(reinterpret_cast<uintptr_t>(transforms) + uintptr_t(k * stride)),
          sizeof(settings.transform));
    return settings;
  };
  if (!instances && count > scene.settings.size()) check_instance(scene, uint32_t(scene.settings.size()));
  for (uint64_t k = 0; k < count; ++k) check_instance(scene, number(k));
  if (count > 1)  // checks all before it changes the first
    for (uint64_t k = 0; k < count; ++k) {
      try {
        place(scene, scene.objects[scene.instances[number(k)].object], changed(k));
      } catch (const Failure& failure) {
        throw Failure(failure.code(), "instance " + std::to_string(number(k)) + ": " + failure.what());
      }
    }
  for (uint64_t k = 0; k < count; ++k) change(scene, number(k), changed(k));
}

void set_origin(NifSceneObject& scene, uint32_t instance, const double* origin) {
  check_instance(scene, instance);
  InstanceSettings settings = scene.settings[instance];
  settings.origin = read_origin(origin);
  change(scene, instance, settings);
}

void set_scene_origin(NifSceneObject& scene, const double* origin) {
  scene.origin = read_origin(origin);
  scene.moved = true;
  scene.committed = false;
}

void set_mask(NifSceneObject& scene, uint32_t instance, uint32_t mask) {
  check_instance(scene, instance);
  InstanceSettings settings = scene.settings[instance];
  settings.mask = mask;
  change(scene, instance, settings);
}

void set_flags(NifSceneObject& scene, uint32_t instance, uint32_t flags) {
  check_instance(scene, instance);
  if (flags & ~uint32_t(NIF_INSTANCE_DISABLED))
    throw Failure(NIF_ERROR_NOT_AVAILABLE,
                  "instance flags " + std::to_string(flags) + " are more than this version has");
  InstanceSettings settings = scene.settings[instance];
  settings.flags = flags;
  change(scene, instance, settings);
}

void set_user(NifSceneObject& scene, uint32_t instance, uint64_t user) {
  check_instance(scene, instance);
  scene.settings[instance].user = user;
  scene.committed = false;
}

namespace {

/// The bent object of an instance, which is made at rest if it has none.
BentObject& bend(NifSceneObject& scene, uint32_t instance) {
  if (const uint32_t known = scene.settings[instance].bent; known != kNotBent) return *scene.bent[known].own;
  const uint32_t source = scene.instances[instance].object;
  NifAssetObject* asset = nullptr;
  for (const HeldAsset& held : scene.assets)
    if (source - held.first_object < held.asset->view.objects.size()) asset = held.asset.get();
  const uint32_t number = scene.objects[source].number;
  if (bending_vertices(asset->view, number) == 0)
    throw Failure(NIF_ERROR_INVALID_OPERATION,
                  "instance " + std::to_string(instance) + " cannot bend: its object '" +
                      std::string(scene.objects[source].view->name) +
                      (scene.objects[source].view->holes ? "' has holes" : "' was not baked with --deforms"));
  auto* memory = scene.device->memory();
  // Of a removed instance that is free again after a commit, or a new one.
  const auto is_free = [](const BentInstance& bent) { return !bent.own; };
  auto at = size_t(std::find_if(scene.bent.begin(), scene.bent.end(), is_free) - scene.bent.begin());
  const bool fresh = at == scene.bent.size();
  if (fresh) {
    if (scene.objects.size() >= kMaxPlacedObjects) refuse_argument("a scene holds at most 2^29 objects");
    make_room(scene.bent, 1);
    make_room(scene.objects, 1);
  }
  const BentObject* like = nullptr;
  for (size_t i = scene.bent.size(); i-- > 0 && like == nullptr;)
    if (scene.bent[i].source == source) like = scene.bent[i].own;
  BentObject* const own =
      create<BentObject>(memory, asset->bending(number), scene.device->configuration.kernels,
                         scene.device->gpu.has_value(), asset->copies, like, memory);
  // Nothing fails from here on.
  if (fresh) {
    scene.bent.push_back({nullptr, kernels::kNoInstance, uint32_t(scene.objects.size()), source});
    scene.objects.emplace_back();
  }
  BentInstance& bent = scene.bent[at];
  bent.own = own;
  bent.instance = instance;
  bent.source = source;
  PlacedObject& object = scene.objects[bent.object];
  object = scene.objects[source];
  object.kernel = own->kernel();
  object.bent = &own->field();
  object.reach_scale = kernels::reach_scale(kernels::AnyField(own->field()));
  scene.instances[instance].object = bent.object & (kMaxPlacedObjects - 1);
  scene.settings[instance].bent = uint32_t(at);
  return *own;
}

}  // namespace

void BentInstance::free(NifSceneObject& scene) {
  if (own == nullptr) return;
  if (own->on_gpu || own->fetched()) scene.device->gpu->free(*own);
  destroy(scene.device->memory(), std::exchange(own, nullptr));
}

namespace {

/// Calls change(bent object); if that fails, the instance is as it was.
template <class Change>
void change_bent(NifSceneObject& scene, uint32_t instance, const Change& change) {
  check_instance(scene, instance);
  const bool fresh = scene.settings[instance].bent == kNotBent;
  try {
    change(bend(scene, instance));
  } catch (...) {
    uint32_t& known = scene.settings[instance].bent;
    if (fresh && known != kNotBent) {
      BentInstance& bent = scene.bent[std::exchange(known, kNotBent)];
      scene.instances[instance].object = bent.source & (kMaxPlacedObjects - 1);
      scene.objects[bent.object] = {};
      bent.instance = kernels::kNoInstance;
      bent.free(scene);
    }
    throw;
  }
  scene.committed = false;
}

/// Refuses memory of a GPU, which the CPU would read.
void check_host_array(NifSceneObject& scene, const void* array, const char* name) {
  const NifDeviceObject& device = *scene.device.get();
  if (device.gpu) scene.device->gpu->check_host_array(device, array, name);
}

}  // namespace

void set_vertices(NifSceneObject& scene, uint32_t instance, const float* positions, uint64_t stride) {
  check_host_array(scene, positions, "positions");
  change_bent(scene, instance, [&](BentObject& bent) {
    if (positions != nullptr)
      bent.set_vertices(positions, stride);
    else
      bent.rest();
  });
}

void pose(NifSceneObject& scene, uint32_t instance, const NifPose& pose) {
  NifDeviceObject& device = *scene.device.get();
  const bool there = pose.memory == NIF_MEMORY_DEVICE;
  const auto refuse = [](const char* why) { throw Failure(NIF_ERROR_NOT_AVAILABLE, why); };
  if (!there && pose.memory != NIF_MEMORY_HOST)
    refuse_argument("pose: unknown memory kind " + std::to_string(pose.memory));
  if (pose.flags != 0) refuse("pose: flags is not 0, and this version has no flags");
  if (there && !device.gpu) refuse("pose: device memory needs a GPU backend; this device is a CPU");
  if (!there && pose.stream) refuse("pose: the CPU reads host memory, and has no streams");
  if (!there) {
    check_host_array(scene, pose.joints, "joints");
    check_host_array(scene, pose.weights, "weights");
    check_host_array(scene, pose.positions, "positions");
  }
  change_bent(scene, instance, [&](BentObject& bent) {
    if (there)
      bent.fetch(device, pose);
    else
      bent.pose(pose);
  });
}

NifInstanceInfo describe_instance(const NifSceneObject& scene, uint32_t instance) {
  check_instance(scene, instance);
  const InstanceSettings& settings = scene.settings[instance];
  const uint32_t object = asset_object(scene, instance);
  NifInstanceInfo info{};
  for (const HeldAsset& held : scene.assets)
    if (object - held.first_object < held.asset->view.objects.size())
      info.asset = reinterpret_cast<NifAsset>(held.asset->handle);
  info.object = scene.objects[object].number;
  info.mask = settings.mask;
  info.flags = settings.flags;
  info.user = settings.user;
  std::copy(settings.origin.begin(), settings.origin.end(), info.origin);
  std::copy(settings.transform.begin(), settings.transform.end(), info.transform);
  return info;
}

void commit(NifSceneObject& scene) {
  std::optional<Gpu>& gpu = scene.device->gpu;
  const std::optional<Failure> refused = receive_poses(scene);
  if (!scene.committed) commit_instances(scene);
  if (gpu && !scene.ready_on_gpu) {
    try {
      gpu->upload(scene);
    } catch (const std::exception& error) {
      scene.device->log(NIF_LOG_WARNING, [&] {
        return std::string("a scene could not be copied to the GPU: ") + error.what();
      });
      throw;
    }
  }
  scene.dropped.clear();
  for (BentInstance& bent : scene.bent)
    if (bent.own && bent.instance == kernels::kNoInstance) {
      scene.objects[bent.object] = {};
      bent.free(scene);
    }
  if (refused) throw *refused;
}

NifSceneInfo describe(const NifSceneObject& scene) {
  NifSceneInfo info{};
  info.instance_count = scene.live;
  info.instance_end = uint32_t(scene.settings.size());
  info.committed = scene.committed;
  std::copy_n(scene.bounds.min, 3, info.bounds_min);
  std::copy_n(scene.bounds.max, 3, info.bounds_max);
  std::copy(scene.origin.begin(), scene.origin.end(), info.origin);
  info.resident_bytes = sizeof(NifSceneObject) + scene.assets.capacity() * sizeof(HeldAsset) +
                        scene.objects.capacity() * sizeof(PlacedObject) +
                        scene.instances.capacity() * sizeof(Instance) +
                        scene.settings.capacity() * sizeof(InstanceSettings) +
                        scene.new_boxes.capacity() * sizeof(kernels::WorldBox) +
                        scene.hierarchy.resident_bytes() + scene.bent.capacity() * sizeof(BentInstance);
  for (const BentInstance& bent : scene.bent) info.resident_bytes += bent.own ? bent.own->bytes() : 0;
  return info;
}

}  // namespace nif::runtime
