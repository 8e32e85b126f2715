// Builds two Embree scenes from the same instances: one of all triangles, which rays are traced in, and one
// of closed components alone, which tells whether a point is inside.
#include "bake/ground_truth/scene_truth.hpp"

#include <algorithm>
#include <cmath>

#include "formats/mesh/transform.hpp"

namespace nif::bake {
namespace {

InsideTest inside_test(std::span<const Prepared* const> objects, std::span<const Placed> instances) {
  std::vector<std::vector<mesh::Triangle>> closed;
  std::vector<EmbreeObject> parts;
  for (const Prepared* object : objects) {
    std::vector<mesh::Triangle>& triangles = closed.emplace_back(object->closed.members.size());
    for (size_t t = 0; t < triangles.size(); ++t) triangles[t] = object->closed.triangle(object->surface, t);
    parts.emplace_back(object->surface.positions, triangles);
  }
  return InsideTest(parts, instances);
}

std::vector<float> biases_of(std::span<const Prepared* const> objects, std::span<const Placed> instances) {
  std::vector<float> biases;
  for (const Placed& placed : instances)
    biases.push_back(float(double(objects[placed.object]->bias) *
                           std::cbrt(std::abs(mesh::determinant(placed.transform)))));
  return biases;
}

}  // namespace

std::vector<EmbreeObject> embree_objects(std::span<const Prepared* const> objects) {
  std::vector<EmbreeObject> out;
  for (const Prepared* object : objects) out.push_back(object->surface);
  return out;
}

mesh::Box bounds_of(std::span<const Prepared* const> objects, std::span<const Placed> instances) {
  const auto box_of = [&](const Placed& placed) {
    return mesh::bounds(objects[placed.object]->box, placed.transform);
  };
  mesh::Box box = box_of(instances.front());
  for (const Placed& placed : instances) box.add(box_of(placed));
  return box;
}

SceneTruth::SceneTruth(std::span<const Prepared* const> objects, std::span<const Placed> instances)
    : embree_(embree_objects(objects), instances),
      inside_(inside_test(objects, instances)),
      biases_(biases_of(objects, instances)),
      source_{
          embree_, inside_, bounds_of(objects, instances), *std::max_element(biases_.begin(), biases_.end()),
          false,   biases_} {
  source_.has_volume = has_free_volume(inside_, source_.box, source_.bias);
}

}  // namespace nif::bake
