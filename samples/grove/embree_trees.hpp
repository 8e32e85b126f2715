// The forest in Embree: a BVH for each tree, instances of them, and a filter function that looks up the picture of leaves.
#pragma once

#include <embree3/rtcore.h>

#include <atomic>
#include <memory>

#include "tracer.hpp"

class EmbreeTrees {
 public:
  /// Throws std::runtime_error. `trees` must stay. With `compact`, Embree builds smaller and slower BVHs.
  EmbreeTrees(const Trees& trees, bool compact);

  /// By Embree's own count: BVHs, vertices, texture coordinates, indices, and instances.
  int64_t bytes() const { return bytes_; }
  int64_t bytes_of_models() const { return bytes_of_models_; }  // without the instances
  int64_t bytes_of_masks() const;                               // besides, in the program

  /// One ray at a time, or packets of 16.
  std::unique_ptr<Tracer> single() const;
  std::unique_ptr<Tracer> packets() const;

 private:
  struct Release {
    void operator()(RTCDevice device) const { rtcReleaseDevice(device); }
    void operator()(RTCScene scene) const { rtcReleaseScene(scene); }
    void operator()(RTCGeometry geometry) const { rtcReleaseGeometry(geometry); }
  };
  using Scene = std::unique_ptr<RTCSceneTy, Release>;
  using Geometry = std::unique_ptr<RTCGeometryTy, Release>;
  /// What the filter function of a part needs.
  struct Leaves {
    const Mask* mask;
    const std::array<float, 2>* places;  // Embree's buffer of texture coordinates
    const std::array<uint32_t, 3>* triangles;
  };

  Geometry make_part(const Part& part);
  Scene new_scene() const;
  static bool count_bytes(void* self, ssize_t bytes, bool after);
  static void let_light_through(const RTCFilterFunctionNArguments* args);

  const Trees& trees_;
  bool compact_;
  std::atomic<int64_t> bytes_ = 0;
  int64_t bytes_of_models_ = 0;
  std::unique_ptr<RTCDeviceTy, Release> device_;
  std::vector<std::unique_ptr<Leaves>> leaves_;
  std::vector<Scene> models_;
  Scene scene_;
};
