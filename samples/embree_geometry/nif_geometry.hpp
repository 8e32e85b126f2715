// An asset's object as an Embree 3 user geometry, for the scene that a renderer casts its shadow rays into:
//
//   NifGeometry dragon(embree, device, asset, 0);
//   rtcAttachGeometry(shadow_scene, dragon.handle());   // or into a scene that is instanced
//   rtcOccluded1(shadow_scene, &context, &ray);         // ... 4, 8, 16, 1M: all of them
//
// An asset knows whether a ray is blocked, but not where: rays of rtcIntersect pass through it. Primary rays
// stay with the renderer's own geometry.
#pragma once

#include <embree3/rtcore.h>

#include <atomic>
#include <nif/nif.hpp>

class NifGeometry {
 public:
  /// Throws nifkit::Error or, where Embree fails, std::runtime_error. The geometry is committed.
  NifGeometry(RTCDevice embree, const nifkit::Device& device, const nifkit::Asset& asset, uint32_t object);
  /// No scene with this geometry may be used any more.
  ~NifGeometry();
  NifGeometry(const NifGeometry&) = delete;
  NifGeometry& operator=(const NifGeometry&) = delete;

  RTCGeometry handle() const { return geometry_; }
  /// NIF_OK, or why a query failed; its rays were left visible. Embree's callbacks cannot say so.
  NifError failure() const { return failure_; }

 private:
  static void bounds(const RTCBoundsFunctionArguments* args);
  static void intersect(const RTCIntersectFunctionNArguments* args);
  static void occluded(const RTCOccludedFunctionNArguments* args);

  nifkit::Scene scene_;  // the object alone, untransformed: Embree hands over rays in the object's space
  RTCGeometry geometry_ = nullptr;
  std::atomic<NifError> failure_ = NIF_OK;
};
