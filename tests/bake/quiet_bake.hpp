// Bakes a few meshes without output, and returns the result.
#pragma once

#include <atomic>
#include <vector>

#include "bake/bake.hpp"
#include "formats/base/status.hpp"

namespace nif::test {

/// One untransformed instance of each mesh.
inline mesh::Scene scene_of(const std::vector<mesh::Mesh>& meshes) {
  mesh::Scene scene;
  for (const mesh::Mesh& mesh : meshes) {
    scene.instances.push_back({mesh.name, uint32_t(scene.meshes.size()), mesh::kIdentity});
    scene.meshes.push_back(mesh);
  }
  return scene;
}

/// Options of a bake that takes a moment.
inline bake::BakeOptions small_field(double effort) {
  bake::BakeOptions options;
  options.encoding = "segment";
  options.preset = bake::Preset::fast;
  options.resolution = 24;
  options.effort = effort;
  options.evaluation_rays = 20'000;
  return options;
}

inline bake::BakeResult bake_quietly(const mesh::Scene& scene, const bake::BakeOptions& options) {
  const std::atomic<bool> cancel{false};
  return bake::bake(scene, options, {}, cancel);
}

/// The result of a bake that may be refused.
inline Status status_of(const mesh::Scene& scene, const bake::BakeOptions& options) {
  try {
    bake_quietly(scene, options);
  } catch (const Error& error) {
    return error.status();
  }
  return Status::ok;
}

}  // namespace nif::test
