// Triangles of leaves are geometries of their own, so that rays that meet wood call no filter.
#include "embree_trees.hpp"

#include <cmath>
#include <cstring>
#include <limits>
#include <stdexcept>

namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

template <class Work>
double seconds_of(const Work& work) {
  const double start = thread_seconds();
  work();
  return thread_seconds() - start;
}

/// Under an instance Embree leaves normals in the model's space. Trees are turned and scaled alike along all axes, so the
/// same matrix brings normals to the world.
void take_hit(const Trees& trees, float t, const Float3& n, unsigned instance, size_t i, Hits& hits) {
  hits.t[i] = instance == RTC_INVALID_GEOMETRY_ID ? kInfinity : t;
  if (instance == RTC_INVALID_GEOMETRY_ID) return;
  hits.placed[i] = instance;
  const Transform& m = trees.placed[instance].transform;
  Float3& normal = hits.normal[i];
  float square = 0;
  for (size_t row = 0; row < 3; ++row) {
    normal[row] = m[4 * row] * n[0] + m[4 * row + 1] * n[1] + m[4 * row + 2] * n[2];
    square += normal[row] * normal[row];
  }
  for (float& x : normal) x /= std::sqrt(square);
}

RTCRay ray_of(const NifRay& ray) {
  RTCRay r{};
  r.org_x = ray.origin[0], r.org_y = ray.origin[1], r.org_z = ray.origin[2];
  r.dir_x = ray.direction[0], r.dir_y = ray.direction[1], r.dir_z = ray.direction[2];
  r.tnear = ray.tmin, r.tfar = ray.tmax, r.mask = ~0u;
  return r;
}

class Single : public Tracer {
 public:
  Single(RTCScene scene, const Trees& trees) : scene_(scene), trees_(trees) {
    rtcInitIntersectContext(&context_);
  }

  double find_hits(std::span<const NifRay> rays, Hits& hits) override {
    std::vector<RTCRayHit> asked(rays.size());
    for (size_t i = 0; i < rays.size(); ++i) {
      asked[i].ray = ray_of(rays[i]);
      asked[i].hit.geomID = asked[i].hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
    }
    const double seconds = seconds_of([&] {
      for (RTCRayHit& ray : asked) rtcIntersect1(scene_, &context_, &ray);
    });
    hits.resize(rays.size());
    for (size_t i = 0; i < rays.size(); ++i) {
      const RTCHit& hit = asked[i].hit;
      take_hit(trees_, asked[i].ray.tfar, {hit.Ng_x, hit.Ng_y, hit.Ng_z}, hit.instID[0], i, hits);
    }
    return seconds;
  }

  double find_visible(std::span<const NifRay> rays, std::vector<uint8_t>& visible) override {
    std::vector<RTCRay> asked(rays.size());
    for (size_t i = 0; i < rays.size(); ++i) asked[i] = ray_of(rays[i]);
    const double seconds = seconds_of([&] {
      for (RTCRay& ray : asked) rtcOccluded1(scene_, &context_, &ray);
    });
    visible.resize(rays.size());
    for (size_t i = 0; i < rays.size(); ++i) visible[i] = asked[i].tfar >= 0;  // Embree sets it to -infinity
    return seconds;
  }

 private:
  RTCScene scene_;
  const Trees& trees_;
  RTCIntersectContext context_;
};

constexpr size_t kPacket = 16;

template <class Packet>
void put(const NifRay& ray, size_t k, Packet& p) {
  p.org_x[k] = ray.origin[0], p.org_y[k] = ray.origin[1], p.org_z[k] = ray.origin[2];
  p.dir_x[k] = ray.direction[0], p.dir_y[k] = ray.direction[1], p.dir_z[k] = ray.direction[2];
  p.tnear[k] = ray.tmin, p.tfar[k] = ray.tmax, p.mask[k] = ~0u;
}

class Packets : public Tracer {
 public:
  Packets(RTCScene scene, const Trees& trees) : scene_(scene), trees_(trees) {
    rtcInitIntersectContext(&context_);
  }

  double find_hits(std::span<const NifRay> rays, Hits& hits) override {
    std::vector<RTCRayHit16> asked((rays.size() + kPacket - 1) / kPacket);
    for (size_t i = 0; i < rays.size(); ++i) {
      RTCRayHit16& packet = asked[i / kPacket];
      put(rays[i], i % kPacket, packet.ray);
      packet.hit.geomID[i % kPacket] = packet.hit.instID[0][i % kPacket] = RTC_INVALID_GEOMETRY_ID;
    }
    const double seconds = seconds_of([&] {
      for (size_t p = 0; p < asked.size(); ++p) {
        const Valid valid(rays.size() - kPacket * p);
        rtcIntersect16(valid.lanes, scene_, &context_, &asked[p]);
      }
    });
    hits.resize(rays.size());
    for (size_t i = 0; i < rays.size(); ++i) {
      const RTCHit16& hit = asked[i / kPacket].hit;
      const size_t k = i % kPacket;
      take_hit(trees_, asked[i / kPacket].ray.tfar[k], {hit.Ng_x[k], hit.Ng_y[k], hit.Ng_z[k]},
               hit.instID[0][k], i, hits);
    }
    return seconds;
  }

  double find_visible(std::span<const NifRay> rays, std::vector<uint8_t>& visible) override {
    std::vector<RTCRay16> asked((rays.size() + kPacket - 1) / kPacket);
    for (size_t i = 0; i < rays.size(); ++i) put(rays[i], i % kPacket, asked[i / kPacket]);
    const double seconds = seconds_of([&] {
      for (size_t p = 0; p < asked.size(); ++p) {
        const Valid valid(rays.size() - kPacket * p);
        rtcOccluded16(valid.lanes, scene_, &context_, &asked[p]);
      }
    });
    visible.resize(rays.size());
    for (size_t i = 0; i < rays.size(); ++i) visible[i] = asked[i / kPacket].tfar[i % kPacket] >= 0;
    return seconds;
  }

 private:
  struct Valid {
    explicit Valid(size_t count) {
      for (size_t k = 0; k < kPacket; ++k) lanes[k] = k < count ? -1 : 0;
    }
    alignas(64) int lanes[kPacket];
  };

  RTCScene scene_;
  const Trees& trees_;
  RTCIntersectContext context_;
};

template <class Element>
Element* fill(RTCGeometry geometry, RTCBufferType type, RTCFormat format,
              const std::vector<Element>& values) {
  void* buffer = rtcSetNewGeometryBuffer(geometry, type, 0, format, sizeof(Element), values.size());
  if (buffer == nullptr) throw std::runtime_error("Embree has no memory for the trees");
  std::memcpy(buffer, values.data(), values.size() * sizeof(Element));
  return static_cast<Element*>(buffer);
}

}  // namespace

EmbreeTrees::EmbreeTrees(const Trees& trees, bool compact)
    : trees_(trees), compact_(compact), device_(rtcNewDevice("threads=1")) {
  if (!device_) throw std::runtime_error("Embree created no device");
  rtcSetDeviceMemoryMonitorFunction(device_.get(), count_bytes, this);
  for (const Model& model : trees.models) {
    models_.push_back(new_scene());
    for (const Part& part : model.parts) rtcAttachGeometry(models_.back().get(), make_part(part).get());
    rtcCommitScene(models_.back().get());
  }
  bytes_of_models_ = bytes_;
  scene_ = new_scene();
  for (const Placed& placed : trees.placed) {
    const Geometry instance(rtcNewGeometry(device_.get(), RTC_GEOMETRY_TYPE_INSTANCE));
    rtcSetGeometryInstancedScene(instance.get(), models_[placed.model].get());
    rtcSetGeometryTransform(instance.get(), 0, RTC_FORMAT_FLOAT3X4_ROW_MAJOR, placed.transform.data());
    rtcCommitGeometry(instance.get());
    rtcAttachGeometry(scene_.get(), instance.get());  // gives them numbers from 0 on
  }
  rtcCommitScene(scene_.get());
  if (const RTCError error = rtcGetDeviceError(device_.get()); error != RTC_ERROR_NONE)
    throw std::runtime_error("Embree: error " + std::to_string(int(error)));
}

EmbreeTrees::Scene EmbreeTrees::new_scene() const {
  Scene scene(rtcNewScene(device_.get()));
  if (!scene) throw std::runtime_error("Embree created no scene");
  if (compact_) rtcSetSceneFlags(scene.get(), RTC_SCENE_FLAG_COMPACT);
  return scene;
}

EmbreeTrees::Geometry EmbreeTrees::make_part(const Part& part) {
  Geometry geometry(rtcNewGeometry(device_.get(), RTC_GEOMETRY_TYPE_TRIANGLE));
  fill(geometry.get(), RTC_BUFFER_TYPE_VERTEX, RTC_FORMAT_FLOAT3, part.positions);
  const auto* triangles = fill(geometry.get(), RTC_BUFFER_TYPE_INDEX, RTC_FORMAT_UINT3, part.triangles);
  if (part.mask >= 0) {
    rtcSetGeometryVertexAttributeCount(geometry.get(), 1);
    const auto* places =
        fill(geometry.get(), RTC_BUFFER_TYPE_VERTEX_ATTRIBUTE, RTC_FORMAT_FLOAT2, part.places);
    leaves_.push_back(std::make_unique<Leaves>(Leaves{&trees_.masks[size_t(part.mask)], places, triangles}));
    rtcSetGeometryUserData(geometry.get(), leaves_.back().get());
    rtcSetGeometryIntersectFilterFunction(geometry.get(), let_light_through);
    rtcSetGeometryOccludedFilterFunction(geometry.get(), let_light_through);
  }
  rtcCommitGeometry(geometry.get());
  return geometry;
}

void EmbreeTrees::let_light_through(const RTCFilterFunctionNArguments* args) {
  const Leaves& leaves = *static_cast<const Leaves*>(args->geometryUserPtr);
  for (unsigned i = 0; i < args->N; ++i) {
    if (args->valid[i] != -1) continue;
    const float u = RTCHitN_u(args->hit, args->N, i), v = RTCHitN_v(args->hit, args->N, i);
    const auto& [a, b, c] = leaves.triangles[RTCHitN_primID(args->hit, args->N, i)];
    const auto at = [&](size_t axis) {
      return (1 - u - v) * leaves.places[a][axis] + u * leaves.places[b][axis] + v * leaves.places[c][axis];
    };
    if (!leaves.mask->blocks(at(0), at(1))) args->valid[i] = 0;
  }
}

bool EmbreeTrees::count_bytes(void* self, ssize_t bytes, bool) {
  static_cast<EmbreeTrees*>(self)->bytes_ += bytes;
  return true;
}

int64_t EmbreeTrees::bytes_of_masks() const {
  int64_t sum = 0;
  for (const Mask& mask : trees_.masks) sum += int64_t(mask.bits.size());
  return sum;
}

std::unique_ptr<Tracer> EmbreeTrees::single() const { return std::make_unique<Single>(scene_.get(), trees_); }
std::unique_ptr<Tracer> EmbreeTrees::packets() const {
  return std::make_unique<Packets>(scene_.get(), trees_);
}
