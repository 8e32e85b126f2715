// Placed objects: their transforms and their boxes.
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

/// What a scene knows of an object, once for all its instances.
struct PlacedObject {
  const format::ObjectView* view;
  const kernels::ObjectKernel* kernel;  ///< answers it
  kernels::Calibration calibration;
  float reach_scale;  ///< kernels::reach_scale()
  uint32_t number;    ///< in its asset
  kernels::HitDetails details;
};

using Instance = kernels::PlacedInstance;
inline constexpr uint32_t kMaxPlacedObjects = 1u << 30;

/// What is added to a transform's translation, because floats are too coarse for that.
using Remainder = std::array<float, 3>;

/// A transform with a translation of up to 48 bits.
struct Placement {
  Transform to_world = kIdentity;
  Remainder remainder{};
};

/// All but object, place and mask. Throws Failure where the transform is not finite or has no inverse.
Instance make_instance(const Placement& placement);

/// A place in the world, or of the world, in double precision.
using Origin = std::array<double, 3>;

/// What the caller has set about an instance.
struct InstanceSettings {
  Transform transform = kIdentity;
  Remainder remainder{};  ///< of the translation, for instances of a file
  uint32_t mask = 0xffffffffu;
  Origin origin{};
  uint64_t user = 0;
  uint32_t flags = 0;
  bool exists = true;  ///< false: removed, and its number free

  /// Some ray can meet it.
  bool awake() const { return exists && !(flags & NIF_INSTANCE_DISABLED) && mask != 0; }
};

/// Where an instance is, seen from an origin: in double precision, if either has an origin.
Placement placement_of(const InstanceSettings& settings, const Origin& from);

/// first, then second; computed in double. It has a remainder only if `first` has one.
Placement combine(const Transform& second, const Placement& first);

/// The box of the box rule (kernels/reference/instance.hpp).
kernels::WorldBox world_box(const format::ObjectView& object, const Placement& placement);

inline void grow(kernels::WorldBox& box, const kernels::WorldBox& other) {
  for (int a = 0; a < 3; ++a) {
    box.min[a] = kernels::min_of(other.min[a], box.min[a]);
    box.max[a] = kernels::max_of(other.max[a], box.max[a]);
  }
}

/// Around nothing; min > max.
kernels::WorldBox empty_box();
/// Is it empty_box()?
inline bool is_empty(const kernels::WorldBox& box) { return box.min[0] > box.max[0]; }

}  // namespace nif::runtime
