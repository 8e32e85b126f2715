// Building scenes and committing them.
#include "scene/scene.hpp"

#include <algorithm>
#include <limits>

#include "api/error.hpp"

namespace nif::runtime {
namespace {

Transform read_transform(const float* transform) {
  if (transform == nullptr) return kIdentity;
  Transform result;
  std::copy_n(transform, 12, result.begin());
  return result;
}

/// Room for more, in steps that keep adding cheap.
template <class T>
void make_room(std::pmr::vector<T>& values, size_t more) {
  const size_t needed = values.size() + more;
  if (needed > values.capacity()) values.reserve(std::max(needed, values.capacity() * 2));
}

/// What is needed to add `count` instances of the asset: room, so that nothing later can fail, and a
/// reference to it. Returns the index of its first object.
uint32_t prepare(NifSceneObject& scene, NifAssetObject* asset, size_t count) {
  if (asset->device.get() != scene.device.get())
    refuse_argument(std::string(asset->name) + ": belongs to another device than the scene");
  if (count > kMaxInstances - scene.instances.size())
    refuse_argument("a scene holds at most 2^31 - 1 instances");
  make_room(scene.instances, count);
  if (scene.new_boxes.empty()) {
    scene.new_boxes.reserve(scene.instances.size() + count);
    for (const Instance& instance : scene.instances)
      scene.new_boxes.push_back(scene.hierarchy.box(instance.place));
  }
  make_room(scene.new_boxes, count);

  const auto by_address = [](const HeldAsset& held, const NifAssetObject* wanted) {
    return std::less<const NifAssetObject*>()(held.asset.get(), wanted);
  };
  const auto at = std::lower_bound(scene.assets.begin(), scene.assets.end(), asset, by_address);
  if (at != scene.assets.end() && at->asset.get() == asset) return at->first_object;
  const size_t first = scene.objects.size();
  if (asset->view.objects.size() > kMaxPlacedObjects - first)
    refuse_argument("a scene holds at most 2^30 objects");
  make_room(scene.objects, asset->view.objects.size());
  scene.assets.insert(at, {Ref<NifAssetObject>(asset), uint32_t(first)});
  for (size_t i = 0; i < asset->view.objects.size(); ++i) {
    const format::ObjectView& view = asset->view.objects[i];
    const kernels::AnyField field = field_of(view);
    scene.objects.push_back({&view, asset->kernels[i].get(), kernels::calibration(field),
                             kernels::reach_scale(field), uint32_t(i),
                             hit_details(asset->view, uint32_t(i))});
  }
  return uint32_t(first);
}

/// After prepare(); cannot fail.
void append(NifSceneObject& scene, Instance instance, uint32_t object, const kernels::WorldBox& box) {
  instance.object = object & (kMaxPlacedObjects - 1);
  scene.instances.push_back(instance);
  scene.new_boxes.push_back(box);
  scene.committed = false;
}

/// All of a commit but the GPU's part.
void commit_instances(NifSceneObject& scene) {
  auto* memory = scene.device->memory();
  scene.ready_on_gpu = false;
  if (!scene.new_boxes.empty() || !scene.hierarchy.refit()) {
    const size_t count = scene.instances.size();
    std::pmr::vector<kernels::WorldBox> boxes(memory);
    std::pmr::vector<uint32_t> places(count, memory);
    if (scene.new_boxes.empty()) {
      boxes.reserve(count);
      for (const Instance& instance : scene.instances) boxes.push_back(scene.hierarchy.box(instance.place));
    }
    scene.instances.shrink_to_fit();
    scene.objects.shrink_to_fit();
    scene.hierarchy.build(scene.new_boxes.empty() ? boxes : scene.new_boxes, places);
    for (size_t i = 0; i < count; ++i) scene.instances[i].place = places[i];
    std::pmr::vector<kernels::WorldBox>(memory).swap(scene.new_boxes);
  }
  scene.bounds = scene.hierarchy.bounds();
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
  const format::ObjectView& view = object_of(*asset, object);
  const Placement to_world{read_transform(transform), {}};
  const Instance instance = make_instance(to_world);
  const kernels::WorldBox box = world_box(view, to_world);
  append(scene, instance, prepare(scene, asset, 1) + object, box);
  return {uint32_t(scene.instances.size() - 1), 1};
}

Added add_asset(NifSceneObject& scene, NifAssetObject* asset, const float* transform) {
  const format::AssetView& view = asset->view;
  const Transform outer = read_transform(transform);
  std::pmr::vector<Instance> added(scene.device->memory());
  std::pmr::vector<kernels::WorldBox> boxes(scene.device->memory());
  const size_t count = view.placed_count();
  added.reserve(count);
  boxes.reserve(count);
  for (size_t i = 0; i < view.instances.size(); ++i) {
    const format::InstanceView& placed = view.instances[i];
    const Placement own{placed.transform, placed.remainder};
    const Placement whole = transform ? combine(outer, own) : own;
    try {
      added.push_back(make_instance(whole));
    } catch (const Failure& failure) {
      throw Failure(failure.code(), std::string(asset->name) + ": instance " + std::to_string(i) + " (" +
                                        std::string(placed.name) + "): " + failure.what());
    }
    boxes.push_back(world_box(view.objects[placed.object], whole));
  }
  if (view.instances.empty())
    for (size_t i = 0; i < count; ++i) {
      added.push_back(make_instance({outer, {}}));
      boxes.push_back(world_box(view.objects[i], {outer, {}}));
    }
  const uint32_t first_object = prepare(scene, asset, count);
  const auto first = uint32_t(scene.instances.size());
  for (size_t i = 0; i < count; ++i)
    append(scene, added[i], first_object + (view.instances.empty() ? uint32_t(i) : view.instances[i].object),
           boxes[i]);
  return {first, uint32_t(count)};
}

void set_transform(NifSceneObject& scene, uint32_t instance, const float* transform) {
  if (instance >= scene.instances.size())
    refuse_argument("no instance " + std::to_string(instance) + "; the scene has " +
                    std::to_string(scene.instances.size()));
  const Placement to_world{read_transform(transform), {}};
  Instance& changed = scene.instances[instance];
  Instance moved = make_instance(to_world);
  moved.object = changed.object;
  moved.place = changed.place;
  changed = moved;
  const kernels::WorldBox box = world_box(*scene.objects[moved.object].view, to_world);
  if (scene.new_boxes.empty())
    scene.hierarchy.set_box(moved.place, box);
  else
    scene.new_boxes[instance] = box;
  scene.committed = false;
}

void commit(NifSceneObject& scene) {
  std::optional<Gpu>& gpu = scene.device->gpu;
  if (!scene.committed) commit_instances(scene);
  if (gpu && !scene.ready_on_gpu) gpu->upload(scene);
}

NifSceneInfo describe(const NifSceneObject& scene) {
  NifSceneInfo info{};
  info.instance_count = uint32_t(scene.instances.size());
  info.committed = scene.committed;
  std::copy_n(scene.bounds.min, 3, info.bounds_min);
  std::copy_n(scene.bounds.max, 3, info.bounds_max);
  info.resident_bytes =
      sizeof(NifSceneObject) + scene.assets.capacity() * sizeof(HeldAsset) +
      scene.objects.capacity() * sizeof(PlacedObject) + scene.instances.capacity() * sizeof(Instance) +
      scene.new_boxes.capacity() * sizeof(kernels::WorldBox) + scene.hierarchy.resident_bytes();
  return info;
}

}  // namespace nif::runtime
