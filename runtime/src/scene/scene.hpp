// A scene: instances of objects, the hierarchy over them, and the assets that the scene keeps alive.
#pragma once

#include <memory_resource>
#include <vector>

#include "kernels/reference/scene_hit.hpp"
#include "scene/asset.hpp"
#include "scene/bending.hpp"
#include "scene/hierarchy.hpp"
#include "scene/instance.hpp"

namespace nif::runtime {

/// An asset that a scene uses.
struct HeldAsset {
  Ref<NifAssetObject> asset;
  uint32_t first_object;  ///< index of its first object among the scene's
};

/// An instance that bends.
struct BentInstance {
  BentObject* own = nullptr;  ///< in the device's memory; null: the entry is free
  uint32_t instance;          ///< kNoInstance: it was removed
  uint32_t object;            ///< its own index among the scene's objects
  uint32_t source;            ///< that of the object of its asset

  void free(NifSceneObject& scene);
};

}  // namespace nif::runtime

struct NifSceneObject : nif::runtime::Object {
  explicit NifSceneObject(NifDeviceObject* owner)
      : device(owner),
        assets(owner->memory()),
        dropped(owner->memory()),
        objects(owner->memory()),
        instances(owner->memory()),
        settings(owner->memory()),
        hierarchy(owner->memory()),
        new_boxes(owner->memory()),
        bent(owner->memory()) {}
  ~NifSceneObject() {
    if (on_gpu) device->gpu->free(*this);
    for (nif::runtime::BentInstance& one : bent) one.free(*this);
  }

  nif::runtime::Ref<NifDeviceObject> device;
  std::pmr::vector<nif::runtime::HeldAsset> assets;  ///< each asset once, sorted by address
  /// Assets that no instance uses any more, but that the scene on the GPU may still read.
  std::pmr::vector<nif::runtime::Ref<NifAssetObject>> dropped;
  std::pmr::vector<nif::runtime::PlacedObject> objects;
  std::pmr::vector<nif::runtime::Instance> instances;         ///< as queries see them
  std::pmr::vector<nif::runtime::InstanceSettings> settings;  ///< [as instances]
  uint32_t live = 0;                                          ///< instances that exist
  uint32_t longest_gap = 0;                                   ///< most consecutive free numbers
  uint32_t first_free = 0;                                    ///< no number below it is free
  nif::runtime::Hierarchy hierarchy;
  /// [instance] its box, after a change to which the hierarchy cannot be refitted, until the next commit.
  /// Otherwise empty: the hierarchy has the boxes.
  std::pmr::vector<nif::kernels::WorldBox> new_boxes;
  std::pmr::vector<nif::runtime::BentInstance> bent;
  nif::runtime::Origin origin{};
  bool moved = false;        ///< the origin has changed since the last commit
  bool has_removed = false;  ///< an instance was removed since the last commit
  bool committed = false;
  /// The only instance that rays can meet, at the last commit; kNoInstance: none or several.
  uint32_t sole = nif::kernels::kNoInstance;
  /// Rays can meet an instance whose file proves nothing, at the last commit. Then no ray is certain to miss
  /// everything, because objects of such files may be larger than their boxes.
  bool unproven = false;
  nif::runtime::GpuScene* on_gpu = nullptr;
  bool ready_on_gpu = false;  ///< the GPU has the committed scene
  nif::kernels::WorldBox bounds{{1, 1, 1}, {-1, -1, -1}};
};

namespace nif::runtime {

struct Added {
  uint32_t first, count;
};

NifSceneObject* new_scene(NifDeviceObject* device);
void release(NifSceneObject* scene);

/// Null transforms are the identity. All or nothing: if a call throws, the scene is as before.
Added add_instance(NifSceneObject& scene, NifAssetObject* asset, uint32_t object, const float* transform);
Added add_asset(NifSceneObject& scene, NifAssetObject* asset, const float* transform);
void remove_instance(NifSceneObject& scene, uint32_t instance);
/// instances: null for 0 .. count - 1. transforms: null for the identity, for all.
void set_transforms(NifSceneObject& scene, uint64_t count, const uint32_t* instances, const float* transforms,
                    uint64_t stride);
/// Null origins are 0 0 0.
void set_origin(NifSceneObject& scene, uint32_t instance, const double* origin);
void set_scene_origin(NifSceneObject& scene, const double* origin);
void set_mask(NifSceneObject& scene, uint32_t instance, uint32_t mask);
void set_flags(NifSceneObject& scene, uint32_t instance, uint32_t flags);
void set_user(NifSceneObject& scene, uint32_t instance, uint64_t user);
/// Null positions: at rest.
void set_vertices(NifSceneObject& scene, uint32_t instance, const float* positions, uint64_t stride);
void pose(NifSceneObject& scene, uint32_t instance, const NifPose& pose);
/// Index among the scene's objects of the object of an instance's asset, whether or not the instance bends.
uint32_t asset_object(const NifSceneObject& scene, size_t instance);
NifInstanceInfo describe_instance(const NifSceneObject& scene, uint32_t instance);
void commit(NifSceneObject& scene);
NifSceneInfo describe(const NifSceneObject& scene);

}  // namespace nif::runtime
