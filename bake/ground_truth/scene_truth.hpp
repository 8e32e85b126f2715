// The ground truth of a whole scene: instances of prepared meshes.
#pragma once

#include <span>
#include <vector>

#include "bake/ground_truth/prepare.hpp"

namespace nif::bake {

class SceneTruth {
 public:
  /// There must be instances, and none may flatten its object. `objects` must outlive the result.
  SceneTruth(std::span<const Prepared* const> objects, std::span<const Placed> instances);

  /// Rays start off the surface of an instance by its object's bias, times the cube root of its scale.
  const RaySource& source() const { return source_; }

 private:
  EmbreeTruth embree_;
  InsideTest inside_;
  std::vector<float> biases_;
  RaySource source_;
};

/// The meshes of objects, for Embree scenes.
std::vector<EmbreeObject> embree_objects(std::span<const Prepared* const> objects);

/// Around all instances' boxes.
mesh::Box bounds_of(std::span<const Prepared* const> objects, std::span<const Placed> instances);

}  // namespace nif::bake
