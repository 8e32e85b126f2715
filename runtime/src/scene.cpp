// Building scenes. In this version a committed scene is a plain list: queries ask every instance.
#include "scene.hpp"

#include <algorithm>
#include <limits>

#include "error.hpp"

namespace nif::runtime {
namespace {

Transform read_transform(const float* transform) {
  if (transform == nullptr) return kIdentity;
  Transform result;
  std::copy_n(transform, 12, result.begin());
  return result;
}

/// Room for `count` more instances of the asset, and a reference to it, so that nothing later can fail.
void prepare(NifSceneObject& scene, NifAssetObject* asset, size_t count) {
  if (asset->device.get() != scene.device.get())
    refuse_argument(std::string(asset->name) + ": loaded on another device than the scene's");
  if (count > std::numeric_limits<uint32_t>::max() - scene.instances.size())
    refuse_argument("a scene holds at most 2^32 - 1 instances");
  const size_t needed = scene.instances.size() + count;
  if (needed > scene.instances.capacity())
    scene.instances.reserve(std::max(needed, scene.instances.capacity() * 2));
  const auto by_address = [](const Ref<NifAssetObject>& held, const NifAssetObject* wanted) {
    return std::less<const NifAssetObject*>()(held.get(), wanted);
  };
  const auto at = std::lower_bound(scene.assets.begin(), scene.assets.end(), asset, by_address);
  if (at == scene.assets.end() || at->get() != asset) scene.assets.insert(at, Ref<NifAssetObject>(asset));
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
  const Instance instance =
      make_instance(object_of(*asset, object), *asset->kernels[object], read_transform(transform));
  prepare(scene, asset, 1);
  scene.instances.push_back(instance);
  scene.committed = false;
  return {uint32_t(scene.instances.size() - 1), 1};
}

Added add_asset(NifSceneObject& scene, NifAssetObject* asset, const float* transform) {
  const format::AssetView& view = asset->view;
  const Transform outer = read_transform(transform);
  std::pmr::vector<Instance> added(scene.device->memory());
  added.reserve(view.instances.empty() ? view.objects.size() : view.instances.size());
  for (size_t i = 0; i < view.instances.size(); ++i) {
    const format::InstanceView& placed = view.instances[i];
    const Transform whole = transform ? combine(outer, placed.transform) : placed.transform;
    try {
      added.push_back(make_instance(view.objects[placed.object], *asset->kernels[placed.object], whole));
    } catch (const Failure& failure) {
      throw Failure(failure.code(), std::string(asset->name) + ": instance " + std::to_string(i) + " (" +
                                        std::string(placed.name) + "): " + failure.what());
    }
  }
  if (view.instances.empty())
    for (size_t i = 0; i < view.objects.size(); ++i)
      added.push_back(make_instance(view.objects[i], *asset->kernels[i], outer));
  prepare(scene, asset, added.size());
  const auto first = uint32_t(scene.instances.size());
  scene.instances.insert(scene.instances.end(), added.begin(), added.end());
  scene.committed = false;
  return {first, uint32_t(added.size())};
}

void set_transform(NifSceneObject& scene, uint32_t instance, const float* transform) {
  if (instance >= scene.instances.size())
    refuse_argument("there is no instance " + std::to_string(instance) + "; the scene has " +
                    std::to_string(scene.instances.size()));
  Instance& changed = scene.instances[instance];
  changed = make_instance(*changed.object, *changed.kernel, read_transform(transform));
  scene.committed = false;
}

void commit(NifSceneObject& scene) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  Box all{{kInfinity, kInfinity, kInfinity}, {-kInfinity, -kInfinity, -kInfinity}};
  for (const Instance& instance : scene.instances) {
    const Box box = world_bounds(instance);
    for (int a = 0; a < 3; ++a) {
      all.min[a] = std::min(all.min[a], box.min[a]);
      all.max[a] = std::max(all.max[a], box.max[a]);
    }
  }
  scene.bounds = all;
  scene.committed = true;
}

NifSceneInfo describe(const NifSceneObject& scene) {
  NifSceneInfo info{};
  info.instance_count = uint32_t(scene.instances.size());
  info.committed = scene.committed;
  std::copy_n(scene.bounds.min, 3, info.bounds_min);
  std::copy_n(scene.bounds.max, 3, info.bounds_max);
  info.resident_bytes = sizeof(NifSceneObject) + scene.instances.capacity() * sizeof(Instance) +
                        scene.assets.capacity() * sizeof(scene.assets[0]);
  return info;
}

}  // namespace nif::runtime
