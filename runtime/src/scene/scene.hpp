// A scene: instances of objects, the hierarchy over them, and the assets that the scene keeps alive.
#pragma once

#include <memory_resource>
#include <vector>

#include "scene/asset.hpp"
#include "scene/hierarchy.hpp"
#include "scene/instance.hpp"

namespace nif::runtime {

/// An asset that a scene uses.
struct HeldAsset {
  Ref<NifAssetObject> asset;
  uint32_t first_object;  ///< where its objects begin among the scene's
};

}  // namespace nif::runtime

struct NifSceneObject : nif::runtime::Object {
  explicit NifSceneObject(NifDeviceObject* owner)
      : device(owner),
        assets(owner->memory()),
        objects(owner->memory()),
        instances(owner->memory()),
        hierarchy(owner->memory()),
        new_boxes(owner->memory()) {}
  ~NifSceneObject() {
    if (on_gpu) device->gpu->free(*this);
  }

  nif::runtime::Ref<NifDeviceObject> device;
  std::pmr::vector<nif::runtime::HeldAsset> assets;  ///< each once, sorted by address
  std::pmr::vector<nif::runtime::PlacedObject> objects;
  std::pmr::vector<nif::runtime::Instance> instances;
  nif::runtime::Hierarchy hierarchy;
  /// [instance] its box, from the first instance added after a commit until the next commit; else empty, and
  /// the hierarchy has the boxes.
  std::pmr::vector<nif::kernels::WorldBox> new_boxes;
  bool committed = false;
  nif::runtime::GpuScene* on_gpu = nullptr;
  bool ready_on_gpu = false;  ///< what is there is what was committed
  nif::kernels::WorldBox bounds{{1, 1, 1}, {-1, -1, -1}};
};

namespace nif::runtime {

struct Added {
  uint32_t first, count;
};

NifSceneObject* new_scene(NifDeviceObject* device);
void release(NifSceneObject* scene);

/// Null transforms are the identity. All or nothing: where one throws, the scene is as before.
Added add_instance(NifSceneObject& scene, NifAssetObject* asset, uint32_t object, const float* transform);
Added add_asset(NifSceneObject& scene, NifAssetObject* asset, const float* transform);
void set_transform(NifSceneObject& scene, uint32_t instance, const float* transform);
void commit(NifSceneObject& scene);
NifSceneInfo describe(const NifSceneObject& scene);

}  // namespace nif::runtime
