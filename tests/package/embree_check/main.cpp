// embree_check ASSET: what Embree answers through the sample's user geometry is what nifQuery answers, for
// every kind of rtcOccluded, without instances and with them; and what rtcIntersect finds is what
// nifIntersect finds.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <exception>
#include <limits>
#include <memory>
#include <random>
#include <vector>

#include "nif_geometry.hpp"

namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr unsigned kRays = 16 * 2000;
using Transform = nifkit::Transform;

struct Placement {
  uint32_t object;
  Transform transform;
};

std::mt19937 random_bits(1);
int between(int low, int high) { return low + int(random_bits() % unsigned(high - low + 1)); }

/// Rays about a box, in numbers of few bits: moved by an exact transform they are not rounded. Parallel ones
/// are coherent.
std::vector<NifRay> make_rays(const NifSceneInfo& box, bool parallel) {
  float size = 0;
  for (int a = 0; a < 3; ++a) size = std::max(size, box.bounds_max[a] - box.bounds_min[a]);
  const float step = std::exp2(std::ceil(std::log2(size)) - 8);
  const auto point = [&](int a) {
    const int low = int(std::floor(box.bounds_min[a] / step)),
              high = int(std::ceil(box.bounds_max[a] / step));
    const int margin = (high - low) / 4;
    return step * float(between(low - margin, high + margin));
  };
  std::vector<NifRay> rays(kRays);
  for (NifRay& ray : rays) {
    for (int a = 0; a < 3; ++a) {
      ray.origin[a] = point(a);
      ray.direction[a] = parallel ? step * float(40 * a + 60) : point(a) - ray.origin[a];
    }
    if (ray.direction[0] == 0 && ray.direction[1] == 0 && ray.direction[2] == 0) ray.direction[0] = step;
    ray.tmin = 0.125f * float(between(0, 3));
    ray.tmax = parallel || between(0, 3) == 0 ? kInfinity : 0.125f * float(between(2, 16));
  }
  return rays;
}

template <class Packet>
void put(Packet& packet, unsigned i, const NifRay& ray) {
  packet.org_x[i] = ray.origin[0], packet.org_y[i] = ray.origin[1], packet.org_z[i] = ray.origin[2];
  packet.dir_x[i] = ray.direction[0], packet.dir_y[i] = ray.direction[1], packet.dir_z[i] = ray.direction[2];
  packet.tnear[i] = ray.tmin, packet.tfar[i] = ray.tmax;
  packet.mask[i] = ~0u;
}

RTCRay single(const NifRay& ray) {
  RTCRay out{};
  out.org_x = ray.origin[0], out.org_y = ray.origin[1], out.org_z = ray.origin[2];
  out.dir_x = ray.direction[0], out.dir_y = ray.direction[1], out.dir_z = ray.direction[2];
  out.tnear = ray.tmin, out.tfar = ray.tmax;
  out.mask = ~0u;
  return out;
}

constexpr uint8_t kNotAsked = 2;

/// Answers in packets of N, with every seventh lane left out; those must stay as they were.
template <unsigned N, class Packet>
std::vector<uint8_t> ask_packets(RTCScene scene, const std::vector<NifRay>& rays,
                                 void (*occluded)(const int*, RTCScene, RTCIntersectContext*, Packet*)) {
  std::vector<uint8_t> visible(rays.size());
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  for (unsigned first = 0; first < rays.size(); first += N) {
    Packet packet{};
    alignas(64) int valid[N];
    for (unsigned i = 0; i < N; ++i) {
      put(packet, i, rays[first + i]);
      valid[i] = (first + i) % 7 == 0 ? 0 : -1;
    }
    occluded(valid, scene, &context, &packet);
    for (unsigned i = 0; i < N; ++i) {
      if (valid[i] == 0 && packet.tfar[i] == rays[first + i].tmax)
        visible[first + i] = kNotAsked;
      else
        visible[first + i] = packet.tfar[i] != -kInfinity;
    }
  }
  return visible;
}

std::vector<uint8_t> ask_singles(RTCScene scene, const std::vector<NifRay>& rays) {
  std::vector<uint8_t> visible;
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  for (const NifRay& ray : rays) {
    RTCRay asked = single(ray);
    rtcOccluded1(scene, &context, &asked);
    visible.push_back(asked.tfar != -kInfinity);
  }
  return visible;
}

std::vector<uint8_t> ask_stream(RTCScene scene, const std::vector<NifRay>& rays,
                                RTCIntersectContextFlags flags) {
  std::vector<RTCRay> asked;
  for (const NifRay& ray : rays) asked.push_back(single(ray));
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = flags;
  rtcOccluded1M(scene, &context, asked.data(), unsigned(asked.size()), sizeof(RTCRay));
  std::vector<uint8_t> visible;
  for (const RTCRay& ray : asked) visible.push_back(ray.tfar != -kInfinity);
  return visible;
}

/// First hits, as t; infinite where there is none.
std::vector<float> find_singles(RTCScene scene, const std::vector<NifRay>& rays) {
  std::vector<float> t;
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  for (const NifRay& ray : rays) {
    RTCRayHit asked{};
    asked.ray = single(ray);
    asked.hit.geomID = asked.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
    rtcIntersect1(scene, &context, &asked);
    t.push_back(asked.hit.geomID == RTC_INVALID_GEOMETRY_ID ? kInfinity : asked.ray.tfar);
  }
  return t;
}

std::vector<float> find_packets(RTCScene scene, const std::vector<NifRay>& rays) {
  std::vector<float> t;
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  for (size_t first = 0; first < rays.size(); first += 8) {
    RTCRayHit8 packet{};
    alignas(32) int valid[8];
    for (unsigned i = 0; i < 8; ++i) {
      put(packet.ray, i, rays[first + i]);
      packet.hit.geomID[i] = packet.hit.instID[0][i] = RTC_INVALID_GEOMETRY_ID;
      valid[i] = -1;
    }
    rtcIntersect8(valid, scene, &context, &packet);
    for (unsigned i = 0; i < 8; ++i)
      t.push_back(packet.hit.geomID[i] == RTC_INVALID_GEOMETRY_ID ? kInfinity : packet.ray.tfar[i]);
  }
  return t;
}

/// Rotations by quarter turns and mirrors, scales that are powers of 2, few-bit translations: nothing is
/// rounded.
Transform exact_transform() {
  int axes[3] = {0, 1, 2};
  std::shuffle(axes, axes + 3, random_bits);
  Transform t{};
  for (int row = 0; row < 3; ++row) {
    t[size_t(4 * row + axes[row])] = (between(0, 1) ? 1.0f : -1.0f) * std::exp2(float(between(-1, 1)));
    t[size_t(4 * row + 3)] = float(between(-12, 12)) / 4;
  }
  return t;
}

Transform any_transform() {
  Transform t = exact_transform();
  for (size_t i = 0; i < 12; ++i) t[i] += 0.001f * float(between(-300, 300));
  return t;
}

struct Check {
  RTCDevice embree = nullptr;
  nifkit::Device device;
  nifkit::Asset asset;
  std::vector<std::unique_ptr<NifGeometry>> geometries;
  bool failed = false;

  /// One line a call; `allowed` is the share of rays whose answers may differ. Rays of no length, tmin ==
  /// tmax, are left to Embree in streams: it may drop them before it asks about them.
  void compare(const char* what, RTCScene scene, const std::vector<Placement>& placements, double allowed) {
    nifkit::Scene nif(device);
    for (const Placement& placement : placements)
      nif.add_instance(asset, placement.object, placement.transform);
    nif.commit();
    std::vector<NifRay> rays;
    std::vector<uint8_t> expected;
    const auto draw = [&](bool parallel) {
      rays = make_rays(nif.info(), parallel);
      expected.resize(rays.size());
      nif.query(nifkit::Rays(rays), nifkit::Answers().visible(expected));
      const auto blocked = std::count(expected.begin(), expected.end(), 0);
      std::printf("%s: %zu %srays, %td blocked\n", what, rays.size(), parallel ? "parallel " : "", blocked);
      if (blocked < 200 || blocked > std::ptrdiff_t(rays.size()) - 200) {
        std::puts("  too few of one answer to tell anything");
        failed = true;
      }
    };
    enum class Call { one, packet, stream };
    const auto see = [&](const char* call, const std::vector<uint8_t>& got, Call kind) {
      size_t wrong = 0;
      for (size_t i = 0; i < rays.size(); ++i) {
        if (kind == Call::stream && rays[i].tmin == rays[i].tmax) continue;
        wrong += kind == Call::packet && i % 7 == 0 ? got[i] != kNotAsked : got[i] != expected[i];
      }
      const bool fine = double(wrong) <= allowed * double(rays.size());
      std::printf("  %-22s %6zu differ%s\n", call, wrong, fine ? "" : "  FAILED");
      failed |= !fine;
    };
    draw(false);
    see("rtcOccluded1", ask_singles(scene, rays), Call::one);
    see("rtcOccluded4", ask_packets<4, RTCRay4>(scene, rays, rtcOccluded4), Call::packet);
    see("rtcOccluded8", ask_packets<8, RTCRay8>(scene, rays, rtcOccluded8), Call::packet);
    see("rtcOccluded16", ask_packets<16, RTCRay16>(scene, rays, rtcOccluded16), Call::packet);
    see("rtcOccluded1M", ask_stream(scene, rays, RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT), Call::stream);
    // Embree asks about an object only up to the nearest hit so far. What a network then says of where it is
    // met may differ; whether something is met does not.
    std::vector<float> t(rays.size());
    nif.intersect(nifkit::Rays(rays), nifkit::Hits().t(t));
    const auto see_hits = [&](const char* call, const std::vector<float>& got) {
      size_t wrong = 0, met = 0, same = 0;
      for (size_t i = 0; i < rays.size(); ++i) {
        // Among instances, Embree's packets drop rays of no length.
        if (rays[i].tmin == rays[i].tmax) continue;
        wrong += std::isfinite(got[i]) != std::isfinite(t[i]);
        met += std::isfinite(t[i]);
        same += std::isfinite(t[i]) && std::abs(got[i] - t[i]) <= 1e-4f * std::abs(t[i]);
      }
      const bool fine = double(wrong) <= allowed * double(rays.size()) && 4 * same > 3 * met;
      std::printf("  %-22s %6zu differ, %zu of %zu hits at the same t%s\n", call, wrong, same, met,
                  fine ? "" : "  FAILED");
      failed |= !fine;
    };
    see_hits("rtcIntersect1", find_singles(scene, rays));
    see_hits("rtcIntersect8", find_packets(scene, rays));
    // Embree 3.13 never returns from this call for rays that are not coherent, among instances of whatever.
    draw(true);
    see("rtcOccluded1M coherent", ask_stream(scene, rays, RTC_INTERSECT_CONTEXT_FLAG_COHERENT), Call::stream);
  }

  void flat() {
    RTCScene scene = rtcNewScene(embree);
    std::vector<Placement> placements;
    for (uint32_t object = 0; object < geometries.size(); ++object) {
      rtcAttachGeometry(scene, geometries[object]->handle());
      placements.push_back({object, {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}});
    }
    rtcCommitScene(scene);
    compare("objects in one scene", scene, placements, 0);
    rtcReleaseScene(scene);
  }

  void instanced(const char* what, Transform (*transform)(), double allowed) {
    std::vector<RTCScene> objects;
    for (const auto& geometry : geometries) {
      objects.push_back(rtcNewScene(embree));
      rtcAttachGeometry(objects.back(), geometry->handle());
      rtcCommitScene(objects.back());
    }
    RTCScene scene = rtcNewScene(embree);
    std::vector<Placement> placements;
    for (uint32_t i = 0; i < 12; ++i) {
      placements.push_back({uint32_t(i % geometries.size()), transform()});
      RTCGeometry instance = rtcNewGeometry(embree, RTC_GEOMETRY_TYPE_INSTANCE);
      rtcSetGeometryInstancedScene(instance, objects[placements.back().object]);
      rtcSetGeometryTransform(instance, 0, RTC_FORMAT_FLOAT3X4_ROW_MAJOR, placements.back().transform.data());
      rtcCommitGeometry(instance);
      rtcAttachGeometry(scene, instance);
      rtcReleaseGeometry(instance);
    }
    rtcCommitScene(scene);
    compare(what, scene, placements, allowed);
    rtcReleaseScene(scene);
    for (RTCScene object : objects) rtcReleaseScene(object);
  }
};

}  // namespace

int main(int argc, char** argv) try {
  if (argc != 2) return 2;
  Check check;
  check.embree = rtcNewDevice("threads=1");
  check.asset = nifkit::Asset::load(check.device, argv[1]);
  for (uint32_t object = 0; object < check.asset.info().object_count; ++object) {
    check.geometries.push_back(
        std::make_unique<NifGeometry>(check.embree, check.device, check.asset, object));
  }
  check.flat();
  check.instanced("instances, transforms without rounding", exact_transform, 0);
  // The two round transformed rays differently, which moves answers at the very edge.
  check.instanced("instances, any transforms", any_transform, 0.002);
  for (const auto& geometry : check.geometries) check.failed |= geometry->failure() != NIF_OK;
  if (const RTCError error = rtcGetDeviceError(check.embree); error != RTC_ERROR_NONE) {
    std::printf("Embree: error %d\n", int(error));
    check.failed = true;
  }
  check.geometries.clear();
  rtcReleaseDevice(check.embree);
  return check.failed ? 1 : 0;
} catch (const std::exception& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
