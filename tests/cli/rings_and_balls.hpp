// A scene of instances for tests of `nif bench`.
#pragma once

#include <string>

#include "formats/mesh/gltf/gltf_writer.hpp"
#include "tests/support/test_shapes.hpp"

namespace nif::test {

/// Rings and balls in turn, as a GLB. All are turned, and some mirrored.
inline std::string rings_and_balls(const mesh::Mesh& ring, const mesh::Mesh& ball, uint32_t count) {
  mesh::Scene scene;
  scene.meshes = {ring, ball};
  for (uint32_t i = 0; i < count; ++i) {
    mesh::Instance instance;
    instance.name = "thing " + std::to_string(i);
    instance.mesh = i % 2;
    const float size = 0.7f + 0.1f * float(i % 6);
    instance.transform = {0, size, 0,    3 * float(i % 3), i % 3 ? size : -size, 0, 0, float(i % 2),
                          0, 0,    size, 2 * float(i / 3)};
    scene.instances.push_back(instance);
  }
  const std::vector<std::byte> bytes = mesh::encode_glb(scene);
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

}  // namespace nif::test
