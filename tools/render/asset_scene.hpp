// The assets of a scene in the runtime: shadow rays and first hits, without a triangle.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "formats/mesh/scene.hpp"
#include "kernels/reference/ray.hpp"
#include "tools/common/runtime_handles.hpp"
#include "tools/render/scene.hpp"
#include "tools/render/surface_point.hpp"

namespace nif::render {

using kernels::Segment;

/// Once committed it is immutable, and any number of threads may ask it. Answers do not depend on the number
/// of threads.
class AssetScene {
 public:
  /// `configuration` is the runtime's, of a device. Throws Error(usage) where it makes no sense.
  explicit AssetScene(const std::string& configuration);

  /// Loads the asset of an object, which has one, and adds its instances. Throws as the loading of assets.
  /// Returns what its baker wrote, which lives as long as this, and the objects in it.
  struct Added {
    std::string_view metadata;
    std::vector<NifObjectInfo> objects;
  };
  Added add(const ObjectDescription& object);
  void commit();

  bool empty() const { return assets_.empty(); }
  /// Of all assets, each as often as it was added; 0 where there is none.
  uint64_t asset_bytes() const { return asset_bytes_; }
  uint64_t resident_bytes() const { return resident_bytes_; }

  /// Why first hits of this scene make no picture: names an object whose encoding does not know where it is
  /// met. None: they do.
  const std::optional<std::string>& no_first_hits() const { return no_first_hits_; }

  /// What the assets say of each ray; the arrays are as those of NifAnswers, and may be null.
  struct Answers {
    uint8_t* visible;
    float* probability;
    uint8_t* certain;
  };
  void ask(std::span<const Segment> rays, const Answers& answers) const;

  /// Where each ray first meets an asset; `hits` is as long as `rays`, whose directions have unit length.
  void intersect(std::span<const Segment> rays, std::span<std::optional<SurfacePoint>> hits) const;

 private:
  tools::Device runtime_;
  std::vector<tools::Asset> assets_;
  tools::Scene scene_;
  std::vector<SurfaceKind> kinds_;  // by the scene's instance
  std::optional<std::string> no_first_hits_;
  uint64_t asset_bytes_ = 0, resident_bytes_ = 0;
};

}  // namespace nif::render
