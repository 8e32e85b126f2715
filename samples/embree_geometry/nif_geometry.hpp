// An asset's object as an Embree 3 user geometry, for the scene that a renderer casts its shadow rays into:
//
//   NifGeometry dragon(embree, device, asset, 0);
//   rtcAttachGeometry(shadow_scene, dragon.handle());   // or into a scene that is instanced
//   rtcOccluded1(shadow_scene, &context, &ray);         // ... 4, 8, 16, 1M: all of them
//
//   rtcIntersect1(shadow_scene, &context, &ray_hit);     // first hits, too
//
// Hits of objects without triangles are off by a part of a voxel, and their primID is
// RTC_INVALID_GEOMETRY_ID. Ng faces the ray and has length 1, in object space as Embree has it.
#pragma once

#include <embree3/rtcore.h>

#include <atomic>
#include <nif/nif.hpp>

class NifGeometry {
 public:
  /// Commits the geometry. Throws nifkit::Error or, if Embree fails, std::runtime_error.
  NifGeometry(RTCDevice embree, const nifkit::Device& device, const nifkit::Asset& asset, uint32_t object);
  /// After this, no scene with this geometry may be used.
  ~NifGeometry();
  NifGeometry(const NifGeometry&) = delete;
  NifGeometry& operator=(const NifGeometry&) = delete;

  RTCGeometry handle() const { return geometry_; }
  /// NIF_OK, or why a query failed. Its rays were left visible, because Embree's callbacks cannot report
  /// errors.
  NifError failure() const { return failure_; }

 private:
  static void bounds(const RTCBoundsFunctionArguments* args);
  static void intersect(const RTCIntersectFunctionNArguments* args);
  static void occluded(const RTCOccludedFunctionNArguments* args);

  nifkit::Scene scene_;  // only the object, untransformed: Embree passes rays in object space
  RTCGeometry geometry_ = nullptr;
  std::atomic<NifError> failure_ = NIF_OK;
};
