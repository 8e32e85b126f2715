// Places objects in a scene: an instance's transform, its box, and its settings.
#pragma once

#include <array>

#include "formats/nif/reader.hpp"
#include "kernels/reference/hit_details.hpp"
#include "kernels/reference/object_kernel.hpp"
#include "kernels/reference/scene_field.hpp"
#include "nif/nif.h"

namespace nif::runtime {

using Transform = std::array<float, 12>;  ///< row-major 3x4
inline constexpr Transform kIdentity{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};

/// What a scene stores about an object, once for all its instances.
struct PlacedObject {
  const format::ObjectView* view;
  const kernels::ObjectKernel* kernel;  ///< answers its queries
  kernels::Calibration calibration;
  float reach_scale;  ///< kernels::reach_scale()
  uint32_t number;    ///< the object's number in its asset
  kernels::HitDetails details;
  /// Of an instance that bends: its triangles, which `view` has at rest. Null for others.
  const kernels::TrianglesField* bent = nullptr;
};

using Instance = kernels::PlacedInstance;
inline constexpr uint32_t kMaxPlacedObjects = 1u << 29;

/// The part of a translation that its floats cannot hold.
using Remainder = std::array<float, 3>;

/// A transform with a translation of up to 48 bits.
struct Placement {
  Transform to_world = kIdentity;
  Remainder remainder{};
};

/// Sets all members except object, unproven, place and mask. Throws Failure if the transform is not finite or has no
/// inverse.
Instance make_instance(const Placement& placement);

/// The origin of an instance or of the scene, in double precision.
using Origin = std::array<double, 3>;

inline constexpr uint32_t kNotBent = 0xffffffffu;

/// An instance's settings, as the caller made them.
struct InstanceSettings {
  Transform transform = kIdentity;
  Remainder remainder{};  ///< of the translation, for instances from a file
  uint32_t mask = 0xffffffffu;
  Origin origin{};
  uint64_t user = 0;
  uint32_t flags = 0;
  uint32_t bent = kNotBent;  ///< index into NifSceneObject::bent
  bool exists = true;        ///< false: removed, so its number is free

  /// Can any ray meet it?
  bool awake() const { return exists && !(flags & NIF_INSTANCE_DISABLED) && mask != 0; }
};

/// The instance's placement relative to an origin: computed in double precision if either origin is set.
Placement placement_of(const InstanceSettings& settings, const Origin& from);

/// `first`, then `second`; computed in double precision. The result has a remainder only if `first` has one.
Placement combine(const Transform& second, const Placement& first);

/// The world box that the box rule demands (kernels/reference/instance.hpp).
kernels::WorldBox world_box(const kernels::ObjectBox& object, const Placement& placement);

inline void grow(kernels::WorldBox& box, const kernels::WorldBox& other) {
  for (int a = 0; a < 3; ++a) {
    box.min[a] = kernels::min_of(other.min[a], box.min[a]);
    box.max[a] = kernels::max_of(other.max[a], box.max[a]);
  }
}

/// A box around nothing: min > max.
kernels::WorldBox empty_box();
/// Is it empty_box()?
inline bool is_empty(const kernels::WorldBox& box) { return box.min[0] > box.max[0]; }

}  // namespace nif::runtime
