// Meshes that the tests of named ray sets bake, as fast as can be.
#pragma once

#include <atomic>

#include "bake/bake.hpp"
#include "bake/ground_truth/prepare.hpp"
#include "formats/nif/reader.hpp"
#include "formats/nif/writer.hpp"
#include "tests/support/real_meshes.hpp"

namespace nif::test {

/// Rays of each set.
inline size_t rays_of_set() { return segments_wanted(100'000); }

inline mesh::Scene scene_of(mesh::Mesh mesh) {
  mesh::Scene scene;
  scene.instances = {{"it", 0, mesh::kIdentity}};
  scene.meshes = {std::move(mesh)};
  return scene;
}

inline std::vector<std::byte> bake_quickly(const mesh::Scene& scene, std::string_view encoding) {
  bake::BakeOptions options;
  options.encoding = encoding;
  options.preset = bake::Preset::fast;
  options.effort = 0.1;
  options.evaluation_rays = 0;
  if (encoding == "segment") options.resolution = 32;
  if (encoding == "spherical") {
    options.preset = bake::Preset::paper;
    options.spherical.passes = 1;
  }
  const std::atomic<bool> cancel{false};
  return format::encode(bake::bake(scene, options, {}, cancel).asset);
}

struct Baked {
  mesh::Scene scene;
  std::vector<std::byte> file;
  format::AssetView view;

  Baked(mesh::Mesh mesh, std::string_view encoding)
      : scene(scene_of(std::move(mesh))),
        file(bake_quickly(scene, encoding)),
        view(format::read_asset(file, "test")) {}
};

}  // namespace nif::test
