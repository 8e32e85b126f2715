// The world that the sample renders: copies of a model on a floor, in two Embree scenes. The renderer's scene
// has the model's triangles; the shadow scene has the asset instead.
#pragma once

#include <memory>
#include <vector>

#include "nif_geometry.hpp"
#include "obj.hpp"

struct ReleaseScene {
  void operator()(RTCScene scene) const { rtcReleaseScene(scene); }
};
using Scene = std::unique_ptr<RTCSceneTy, ReleaseScene>;

class World {
 public:
  /// Throws nifkit::Error or std::runtime_error.
  World(RTCDevice embree, const nifkit::Device& device, const nifkit::Asset& asset, const Mesh& mesh);

  RTCScene own() const { return own_.get(); }
  RTCScene shadow() const { return shadow_.get(); }
  /// The asset's copies without Embree, to call nifQuery directly. It does not contain the floor.
  const nifkit::Scene& direct() const { return direct_; }

  const std::array<float, 3>& middle() const { return middle_; }
  float size() const { return size_; }  ///< the model's longest side
  float bias() const { return bias_; }  ///< how far from a surface its shadow rays start
  void throw_where_a_query_failed() const;

 private:
  void place(RTCDevice embree, RTCScene into, RTCScene what, const nifkit::Transform& transform);

  std::vector<std::unique_ptr<NifGeometry>> objects_;  // must outlive the scenes
  Scene model_;                                        // its triangles
  std::vector<Scene> assets_;                          // one for each object
  Scene own_, shadow_;
  nifkit::Scene direct_;
  std::array<float, 3> middle_;
  float size_, bias_ = 0;
};
