// Embree passes packets with inactive lanes to its callbacks. The valid rays are gathered into batches, each
// batch is one query, and the answers are written back to their lanes.
#include "nif_geometry.hpp"

#include <algorithm>
#include <limits>
#include <stdexcept>

namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
// Rays per query. Embree passes at most 16 at once, except for streams.
constexpr unsigned kBatch = 64;

/// Passes on the valid rays of a packet, with their lanes, some at a time.
template <class Ask>
void in_batches(RTCRayN* rays, unsigned n, const int* valid, const Ask& ask) {
  NifRay batch[kBatch];
  unsigned lane[kBatch];
  unsigned count = 0;
  for (unsigned i = 0; i < n; ++i) {
    if (!valid[i]) continue;
    batch[count] = {{RTCRayN_org_x(rays, n, i), RTCRayN_org_y(rays, n, i), RTCRayN_org_z(rays, n, i)},
                    RTCRayN_tnear(rays, n, i),
                    {RTCRayN_dir_x(rays, n, i), RTCRayN_dir_y(rays, n, i), RTCRayN_dir_z(rays, n, i)},
                    RTCRayN_tfar(rays, n, i)};
    lane[count] = i;
    if (++count == kBatch) ask(batch, lane, count), count = 0;
  }
  if (count > 0) ask(batch, lane, count);
}

}  // namespace

NifGeometry::NifGeometry(RTCDevice embree, const nifkit::Device& device, const nifkit::Asset& asset,
                         uint32_t object)
    : scene_(device) {
  scene_.add_instance(asset, object);
  scene_.commit();
  geometry_ = rtcNewGeometry(embree, RTC_GEOMETRY_TYPE_USER);
  if (geometry_ == nullptr) throw std::runtime_error("Embree created no geometry");
  rtcSetGeometryUserPrimitiveCount(geometry_, 1);
  rtcSetGeometryUserData(geometry_, this);
  rtcSetGeometryBoundsFunction(geometry_, bounds, nullptr);
  rtcSetGeometryIntersectFunction(geometry_, intersect);
  rtcSetGeometryOccludedFunction(geometry_, occluded);
  rtcCommitGeometry(geometry_);
}

NifGeometry::~NifGeometry() { rtcReleaseGeometry(geometry_); }

void NifGeometry::bounds(const RTCBoundsFunctionArguments* args) {
  // The bounds of the scene, not of the mesh: the object's grid may block rays slightly outside of the mesh's
  // bounds.
  auto info = nifkit::sized<NifSceneInfo>();
  nifGetSceneInfo(static_cast<const NifGeometry*>(args->geometryUserPtr)->scene_.get(), &info);
  const float* low = info.bounds_min;
  const float* high = info.bounds_max;
  // Slightly larger, because Embree's box test rounds.
  const float hair = 0x1p-12f * std::max({high[0] - low[0], high[1] - low[1], high[2] - low[2]});
  RTCBounds& box = *args->bounds_o;
  box.lower_x = low[0] - hair, box.lower_y = low[1] - hair, box.lower_z = low[2] - hair;
  box.upper_x = high[0] + hair, box.upper_y = high[1] + hair, box.upper_z = high[2] + hair;
}

void NifGeometry::intersect(const RTCIntersectFunctionNArguments* args) {
  auto& self = *static_cast<NifGeometry*>(args->geometryUserPtr);
  const unsigned n = args->N;
  RTCRayN* rays = RTCRayHitN_RayN(args->rayhit, n);
  RTCHitN* found = RTCRayHitN_HitN(args->rayhit, n);
  uint8_t hit[kBatch];
  float t[kBatch], normal[kBatch][3], u[kBatch], v[kBatch];
  uint32_t triangle[kBatch];
  auto hits = nifkit::sized<NifHits>();
  hits.hit = hit, hits.t = t, hits.normal = normal[0], hits.triangle = triangle, hits.u = u, hits.v = v;
  in_batches(rays, n, args->valid, [&](const NifRay* batch, const unsigned* lane, unsigned count) {
    const NifRays asked = nifMakeRays(batch, count);
    if (const NifError error = nifIntersect(self.scene_.get(), &asked, &hits); error != NIF_OK) {
      self.failure_ = error;
      return;
    }
    for (unsigned k = 0; k < count; ++k) {
      if (!hit[k]) continue;
      const unsigned i = lane[k];
      RTCRayN_tfar(rays, n, i) = t[k];
      RTCHitN_Ng_x(found, n, i) = normal[k][0];
      RTCHitN_Ng_y(found, n, i) = normal[k][1];
      RTCHitN_Ng_z(found, n, i) = normal[k][2];
      RTCHitN_u(found, n, i) = u[k];
      RTCHitN_v(found, n, i) = v[k];
      RTCHitN_primID(found, n, i) = triangle[k];
      RTCHitN_geomID(found, n, i) = args->geomID;
      for (unsigned level = 0; level < RTC_MAX_INSTANCE_LEVEL_COUNT; ++level)
        RTCHitN_instID(found, n, i, level) = args->context->instID[level];
    }
  });
}

void NifGeometry::occluded(const RTCOccludedFunctionNArguments* args) {
  auto& self = *static_cast<NifGeometry*>(args->geometryUserPtr);
  const unsigned n = args->N;
  uint8_t visible[kBatch];
  auto answers = nifkit::sized<NifAnswers>();
  answers.visible = visible;
  in_batches(args->ray, n, args->valid, [&](const NifRay* batch, const unsigned* lane, unsigned count) {
    const NifRays asked = nifMakeRays(batch, count);
    if (const NifError error = nifQuery(self.scene_.get(), &asked, &answers); error != NIF_OK) {
      self.failure_ = error;
      return;
    }
    for (unsigned k = 0; k < count; ++k)
      if (!visible[k]) RTCRayN_tfar(args->ray, n, lane[k]) = -kInfinity;
  });
}
