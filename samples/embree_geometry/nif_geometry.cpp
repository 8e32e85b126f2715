#include "nif_geometry.hpp"

#include <algorithm>
#include <limits>
#include <stdexcept>

namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
// Rays per query. Embree asks for at most 16 at once, except for streams.
constexpr unsigned kBatch = 64;
constexpr nifkit::Transform kIdentity = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};

}  // namespace

NifGeometry::NifGeometry(RTCDevice embree, const nifkit::Device& device, const nifkit::Asset& asset,
                         uint32_t object)
    : scene_(device) {
  scene_.add(asset, object, kIdentity);
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

void NifGeometry::intersect(const RTCIntersectFunctionNArguments*) {}

void NifGeometry::occluded(const RTCOccludedFunctionNArguments* args) {
  auto& self = *static_cast<NifGeometry*>(args->geometryUserPtr);
  RTCRayN* rays = args->ray;
  const unsigned n = args->N;
  NifRay batch[kBatch];
  unsigned lane[kBatch];
  uint8_t visible[kBatch];
  unsigned count = 0;

  const auto ask = [&] {
    NifQuery query = nifQueryRays(batch, count);
    query.visible = visible;
    if (const NifError error = nifQuery(self.scene_.get(), &query); error != NIF_OK) {
      self.failure_ = error;
    } else {
      for (unsigned k = 0; k < count; ++k) {
        if (!visible[k]) RTCRayN_tfar(rays, n, lane[k]) = -kInfinity;
      }
    }
    count = 0;
  };
  for (unsigned i = 0; i < n; ++i) {
    if (!args->valid[i]) continue;
    batch[count] = {{RTCRayN_org_x(rays, n, i), RTCRayN_org_y(rays, n, i), RTCRayN_org_z(rays, n, i)},
                    RTCRayN_tnear(rays, n, i),
                    {RTCRayN_dir_x(rays, n, i), RTCRayN_dir_y(rays, n, i), RTCRayN_dir_z(rays, n, i)},
                    RTCRayN_tfar(rays, n, i)};
    lane[count] = i;
    if (++count == kBatch) ask();
  }
  if (count > 0) ask();
}
