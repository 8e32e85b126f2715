// Holds the assets of a scene in the runtime, for shadow rays and first hits without triangles.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "formats/mesh/mesh_scene.hpp"
#include "formats/mesh/poser.hpp"
#include "kernels/reference/ray.hpp"
#include "tools/common/runtime_handles.hpp"
#include "tools/render/picture_scene.hpp"
#include "tools/render/surface_point.hpp"

namespace nif::render {

using kernels::Segment;

/// Immutable once committed; any number of threads may query it. Answers do not depend on the number of
/// threads.
class AssetScene {
 public:
  /// `configuration` is that of the runtime's device. Throws Error(usage) if it makes no sense.
  explicit AssetScene(const std::string& configuration);

  /// Loads the asset of an object, which must have one, and adds its instances. Throws as loading an asset
  /// does. Returns the metadata of its baker, valid as long as this, and the objects in it.
  struct Added {
    std::string_view metadata;
    std::vector<NifObjectInfo> objects;
    uint32_t first;  ///< of its instances
  };
  Added add(const ObjectDescription& object);
  /// Poses instances that were added together, one after the other.
  void pose(const Added& added, std::span<const mesh::PosedInstance> instances, const mesh::Transform& outer);
  void commit();

  bool empty() const { return assets_.empty(); }
  /// Sums over all assets, each counted as often as it was added; 0 if there is none.
  uint64_t asset_bytes() const { return asset_bytes_; }
  uint64_t resident_bytes() const { return resident_bytes_; }

  /// Why first hits of this scene cannot make a picture: names an object whose encoding does not report where
  /// it is hit. Empty if they can.
  const std::optional<std::string>& no_first_hits() const { return no_first_hits_; }

  /// The assets' answers to each ray; the arrays are like those of NifAnswers, and may be null.
  struct Answers {
    uint8_t* visible;
    float* probability;
    uint8_t* certain;
  };
  void ask(std::span<const Segment> rays, const Answers& answers) const;

  /// The first hit of each ray with an asset; `hits` has the size of `rays`, whose directions have unit
  /// length.
  void intersect(std::span<const Segment> rays, std::span<std::optional<SurfacePoint>> hits) const;

 private:
  tools::Device runtime_;
  std::vector<tools::Asset> assets_;
  tools::Scene scene_;
  std::vector<SurfaceKind> kinds_;  // by instance of the scene
  std::optional<std::string> no_first_hits_;
  uint64_t asset_bytes_ = 0, resident_bytes_ = 0;
};

}  // namespace nif::render
