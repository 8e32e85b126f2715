// A triangle mesh in an Embree scene of its own: what the ray oracle and the baseline to beat share.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "formats/mesh/scene.hpp"

struct RTCDeviceTy;
struct RTCSceneTy;

namespace nif::bake {

/// How Embree builds its BVH: `robust` is what labels rays, the others are what renderers use. `high` is the
/// standard form with spatial splits, slower to build.
enum class EmbreeBuild { robust, standard, compact, high };

/// Of the library that is loaded, "3.13.5".
std::string embree_version();

/// Immutable once made; any number of threads may ask it.
class EmbreeScene {
 public:
  /// Copies what it needs. Throws Error(out_of_memory) or Error(internal) with Embree's own message.
  EmbreeScene(std::span<const mesh::Float3> positions, std::span<const mesh::Triangle> triangles,
              EmbreeBuild build);
  EmbreeScene(const EmbreeScene&) = delete;
  EmbreeScene& operator=(const EmbreeScene&) = delete;

  RTCSceneTy* handle() const { return scene_.get(); }

  /// Bytes that Embree holds for the scene, by its own memory monitor: BVH and copied vertices and indices
  /// apart.
  struct Memory {
    int64_t bvh;
    int64_t buffers;
  };
  Memory memory() const { return {bytes_ - buffers_, buffers_}; }

 private:
  struct Release {
    void operator()(RTCDeviceTy* device) const;
    void operator()(RTCSceneTy* scene) const;
  };
  std::atomic<int64_t> bytes_{0};
  int64_t buffers_ = 0;
  std::string error_;
  // Last, so that they go first: on its way out Embree still reports what it frees.
  std::unique_ptr<RTCDeviceTy, Release> device_;
  std::unique_ptr<RTCSceneTy, Release> scene_;
};

}  // namespace nif::bake
