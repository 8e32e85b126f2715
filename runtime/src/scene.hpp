// A scene: instances of objects, and the assets that they keep alive.
#pragma once

#include <memory_resource>
#include <vector>

#include "asset.hpp"
#include "instance.hpp"

struct NifSceneObject : nif::runtime::Object {
  explicit NifSceneObject(NifDeviceObject* owner)
      : device(owner), assets(owner->memory()), instances(owner->memory()) {}

  nif::runtime::Ref<NifDeviceObject> device;
  std::pmr::vector<nif::runtime::Ref<NifAssetObject>> assets;  ///< each once, sorted by address
  std::pmr::vector<nif::runtime::Instance> instances;
  bool committed = false;
  nif::runtime::Box bounds{{1, 1, 1}, {-1, -1, -1}};
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
