// Builds one scene of instances for both sides of `nif bench`: the runtime and Embree.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "bake/ground_truth/scene_truth.hpp"
#include "tools/common/measured_asset.hpp"
#include "tools/common/progress.hpp"
#include "tools/common/runtime_handles.hpp"

namespace nif::tools {

class BenchScene {
 public:
  /// Reads a scene for `nif render` with its meshes and assets. `asset` is the asset of a glTF, and empty for
  /// a scene file. Ground, lights and cameras are ignored, and each object must have an asset. Throws as
  /// render::read_scene() and MeasuredAsset do; Error(usage) if `asset` does not fit the scene;
  /// Error(malformed_scene) if an object has no asset, or no instance is left.
  BenchScene(const std::string& scene, const std::string& asset, const std::string& configuration,
             Progress& progress);

  /// The objects of all assets.
  const std::vector<const bake::Prepared*>& objects() const { return objects_; }
  const std::vector<bake::Placed>& instances() const { return instances_; }
  const std::vector<std::unique_ptr<MeasuredAsset>>& assets() const { return assets_; }
  uint64_t triangles() const;
  uint64_t placed_triangles() const;

  /// All instances in the runtime, on a device with `threads` threads. Instance i has number i.
  Scene scene(uint32_t threads) const;

 private:
  /// Position of an object among the assets.
  struct Source {
    size_t asset;
    uint32_t object;
  };

  std::string path_, configuration_;
  std::vector<std::unique_ptr<MeasuredAsset>> assets_;
  std::vector<const bake::Prepared*> objects_;
  std::vector<Source> sources_;  ///< [object]
  std::vector<bake::Placed> instances_;
};

}  // namespace nif::tools
