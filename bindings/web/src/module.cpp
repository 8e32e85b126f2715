// The interface for the package's JavaScript: nif.h without structures, 64-bit numbers and out parameters.
// Each call returns a NifError; other results are in `said`, where JavaScript reads them.
//
// Handles and pointers are trusted: they come only from the package's JavaScript, which checks its users'
// arguments.
#include <emscripten.h>
#include <nif/nif.h>

#include <cstdint>

namespace {

/// The numbers that a call returns, in the order of its comment. 64-bit numbers are exact up to 2^53.
double said[24];

class Saying {
 public:
  template <class T>
  Saying& operator<<(T value) {
    said[count_++] = static_cast<double>(value);
    return *this;
  }
  Saying& operator<<(const char* text) { return *this << reinterpret_cast<uintptr_t>(text); }
  template <size_t kCount>
  Saying& operator<<(const float (&values)[kCount]) {
    for (const float value : values) *this << value;
    return *this;
  }
  template <size_t kCount>
  Saying& operator<<(const double (&values)[kCount]) {
    for (const double value : values) *this << value;
    return *this;
  }
  template <class Object>
  Saying& handle(Object* object) {
    return *this << reinterpret_cast<uintptr_t>(object);
  }

 private:
  uint32_t count_ = 0;
};

template <class T>
T structure() {
  T value{};
  value.struct_size = sizeof(value);
  return value;
}

/// Rays as JavaScript lays them out (js/staging.js). A stride of 0: one for all rays.
struct Rays {
  uint32_t count;
  const float *origin, *direction;  ///< x, y and z in a row
  const float *tmin, *tmax;
  const uint32_t* mask;                                                             ///< may be null
  uint32_t origin_stride, direction_stride, tmin_stride, tmax_stride, mask_stride;  ///< bytes
};
struct Answers {
  uint8_t *visible, *visible_bits;
  float* probability;
  uint8_t* certain;
  int32_t* logit;
};
struct Hits {
  uint8_t* hit;
  float *t, *normal;
  uint32_t *instance, *object, *triangle;
  float *u, *v;
  uint8_t* certain;
  float *t_low, *t_high, *color;
  uint64_t* user;
};
/// Each list has room for all rays.
struct AnswersAndOpenRays {
  Answers answers;
  uint32_t* rays;
  float *tmin, *tmax;
  uint32_t* instance;
};

NifRays rays_of(const Rays& rays) {
  NifRays batch = structure<NifRays>();
  batch.count = rays.count;
  for (int axis = 0; axis < 3; ++axis) {
    batch.origin[axis] = rays.origin + axis;
    batch.direction[axis] = rays.direction + axis;
  }
  batch.origin_stride = rays.origin_stride;
  batch.direction_stride = rays.direction_stride;
  batch.tmin = rays.tmin;
  batch.tmin_stride = rays.tmin_stride;
  batch.tmax = rays.tmax;
  batch.tmax_stride = rays.tmax_stride;
  batch.mask = rays.mask;
  batch.mask_stride = rays.mask_stride;
  return batch;
}

NifAnswers answers_of(const Answers& wanted) {
  NifAnswers answers = structure<NifAnswers>();
  answers.visible = wanted.visible;
  answers.visible_bits = wanted.visible_bits;
  answers.probability = wanted.probability;
  answers.certain = wanted.certain;
  answers.logit = wanted.logit;
  return answers;
}

/// Calls the fallback that scene.js has set, which does not throw.
EM_JS(void, ask_fallback, (uint32_t count, const uint64_t* rays, uint8_t* visible),
      { Module['fallback'](count, rays, visible); });

}  // namespace

extern "C" {

EMSCRIPTEN_KEEPALIVE const double* web_said() { return said; }
EMSCRIPTEN_KEEPALIVE uint32_t web_version() { return nifGetVersion(); }
EMSCRIPTEN_KEEPALIVE const char* web_message() { return nifGetErrorMessage(); }
EMSCRIPTEN_KEEPALIVE const char* web_error_name(int code) { return nifGetErrorName(NifError(code)); }

/// handle, isa
EMSCRIPTEN_KEEPALIVE int web_new_device() {
  NifDevice device = nullptr;
  if (const NifError error = nifNewDevice("queries=1", nullptr, &device)) return error;
  NifDeviceInfo info = structure<NifDeviceInfo>();
  if (const NifError error = nifGetDeviceInfo(device, &info)) return error;
  Saying().handle(device) << info.isa;
  return NIF_OK;
}
EMSCRIPTEN_KEEPALIVE void web_release_device(NifDevice device) { nifReleaseDevice(device); }

/// handle
EMSCRIPTEN_KEEPALIVE int web_load_asset(NifDevice device, const void* bytes, uint32_t size) {
  NifAsset asset = nullptr;
  const NifError error = nifLoadAssetMemory(device, bytes, size, NIF_LOAD_COPY, &asset);
  Saying().handle(asset);
  return error;
}
EMSCRIPTEN_KEEPALIVE void web_release_asset(NifAsset asset) { nifReleaseAsset(asset); }

/// objects, instances, networks, version of the format, bytes of the file, bytes in memory, metadata, its
/// bytes, whether it places nothing, revisions of arithmetic and prover, whether it proves
EMSCRIPTEN_KEEPALIVE int web_asset_info(NifAsset asset) {
  NifAssetInfo info = structure<NifAssetInfo>();
  const NifError error = nifGetAssetInfo(asset, &info);
  Saying() << info.object_count << info.instance_count << info.network_count << info.format_version
           << info.file_bytes << info.resident_bytes << info.metadata << info.metadata_bytes
           << info.places_nothing << info.arithmetic << info.prover << info.proves;
  return error;
}

/// name, encoding, network, 6 bounds, bias, triangles, bytes in memory, whether it proves, source triangles,
/// colours, level, error, why it is unsupported
EMSCRIPTEN_KEEPALIVE int web_object_info(NifAsset asset, uint32_t object) {
  NifObjectInfo info = structure<NifObjectInfo>();
  const NifError error = nifGetObjectInfo(asset, object, &info);
  Saying() << info.name << int(info.encoding) << info.network << info.bounds_min << info.bounds_max
           << info.bias << info.triangles << info.resident_bytes << info.proves << info.source_triangles
           << info.colors << info.level << info.error << info.unsupported;
  return error;
}

/// name, object, 12 of the transform, parent, mask, flags, user
EMSCRIPTEN_KEEPALIVE int web_asset_instance_info(NifAsset asset, uint32_t instance) {
  NifAssetInstanceInfo info = structure<NifAssetInstanceInfo>();
  const NifError error = nifGetAssetInstanceInfo(asset, instance, &info);
  Saying() << info.name << info.object << info.transform << info.parent << info.mask << info.flags
           << uint32_t(info.user) << uint32_t(info.user >> 32);
  return error;
}

/// handle
EMSCRIPTEN_KEEPALIVE int web_new_scene(NifDevice device) {
  NifScene scene = nullptr;
  const NifError error = nifNewScene(device, &scene);
  Saying().handle(scene);
  return error;
}
EMSCRIPTEN_KEEPALIVE void web_release_scene(NifScene scene) { nifReleaseScene(scene); }

/// number
EMSCRIPTEN_KEEPALIVE int web_add_instance(NifScene scene, NifAsset asset, uint32_t object,
                                          const float* transform) {
  uint32_t instance = 0;
  const NifError error = nifAddInstance(scene, asset, object, transform, &instance);
  Saying() << instance;
  return error;
}
/// number of the first, how many
EMSCRIPTEN_KEEPALIVE int web_add_asset(NifScene scene, NifAsset asset, const float* transform) {
  uint32_t first = 0, count = 0;
  const NifError error = nifAddAsset(scene, asset, transform, &first, &count);
  Saying() << first << count;
  return error;
}
EMSCRIPTEN_KEEPALIVE int web_remove_instance(NifScene scene, uint32_t instance) {
  return nifRemoveInstance(scene, instance);
}
EMSCRIPTEN_KEEPALIVE int web_set_transform(NifScene scene, uint32_t instance, const float* transform) {
  return nifSetInstanceTransform(scene, instance, transform);
}
/// instances may be null
EMSCRIPTEN_KEEPALIVE int web_set_transforms(NifScene scene, uint32_t count, const uint32_t* instances,
                                            const float* transforms) {
  return nifSetInstanceTransforms(scene, count, instances, transforms, 12 * sizeof(float));
}
EMSCRIPTEN_KEEPALIVE int web_set_instance_origin(NifScene scene, uint32_t instance, double x, double y,
                                                 double z) {
  const double origin[3] = {x, y, z};
  return nifSetInstanceOrigin(scene, instance, origin);
}
EMSCRIPTEN_KEEPALIVE int web_set_origin(NifScene scene, double x, double y, double z) {
  const double origin[3] = {x, y, z};
  return nifSetSceneOrigin(scene, origin);
}
EMSCRIPTEN_KEEPALIVE int web_set_mask(NifScene scene, uint32_t instance, uint32_t mask) {
  return nifSetInstanceMask(scene, instance, mask);
}
EMSCRIPTEN_KEEPALIVE int web_set_flags(NifScene scene, uint32_t instance, uint32_t flags) {
  return nifSetInstanceFlags(scene, instance, flags);
}
EMSCRIPTEN_KEEPALIVE int web_set_user(NifScene scene, uint32_t instance, uint32_t low, uint32_t high) {
  return nifSetInstanceUser(scene, instance, uint64_t{high} << 32 | low);
}
/// object, mask, flags, low and high half of the user value, 3 of the origin, 12 of the transform
EMSCRIPTEN_KEEPALIVE int web_instance_info(NifScene scene, uint32_t instance) {
  NifInstanceInfo info = structure<NifInstanceInfo>();
  const NifError error = nifGetInstanceInfo(scene, instance, &info);
  Saying() << info.object << info.mask << info.flags << uint32_t(info.user) << uint32_t(info.user >> 32)
           << info.origin << info.transform;
  return error;
}
EMSCRIPTEN_KEEPALIVE int web_commit(NifScene scene) { return nifCommitScene(scene); }

/// instances, committed, 6 bounds, bytes in memory, end of their numbers, 3 of the origin
EMSCRIPTEN_KEEPALIVE int web_scene_info(NifScene scene) {
  NifSceneInfo info = structure<NifSceneInfo>();
  const NifError error = nifGetSceneInfo(scene, &info);
  Saying() << info.instance_count << info.committed << info.bounds_min << info.bounds_max
           << info.resident_bytes << info.instance_end << info.origin;
  return error;
}

EMSCRIPTEN_KEEPALIVE int web_query(NifScene scene, const Rays* rays, const Answers* wanted) {
  const NifRays batch = rays_of(*rays);
  const NifAnswers answers = answers_of(*wanted);
  return nifQuery(scene, &batch, &answers);
}

EMSCRIPTEN_KEEPALIVE int web_query_with_fallback(NifScene scene, const Rays* rays, const Answers* wanted,
                                                 float confidence) {
  const NifRays batch = rays_of(*rays);
  const NifAnswers answers = answers_of(*wanted);
  const NifFallback fallback = [](void*, uint64_t count, const uint64_t* numbers, uint8_t* visible) {
    ask_fallback(uint32_t(count), numbers, visible);
  };
  return nifQueryWithFallback(scene, &batch, &answers, confidence, fallback, nullptr);
}

/// how many rays are open
EMSCRIPTEN_KEEPALIVE int web_query_open(NifScene scene, const Rays* rays, const AnswersAndOpenRays* wanted) {
  const NifRays batch = rays_of(*rays);
  const NifAnswers answers = answers_of(wanted->answers);
  uint32_t count = 0;
  NifOpenRays open = structure<NifOpenRays>();
  open.capacity = rays->count;
  open.rays = wanted->rays;
  open.tmin = wanted->tmin;
  open.tmax = wanted->tmax;
  open.instance = wanted->instance;
  open.count = &count;
  const NifError error = nifQueryOpen(scene, &batch, &answers, &open);
  Saying() << count;
  return error;
}

EMSCRIPTEN_KEEPALIVE int web_intersect(NifScene scene, const Rays* rays, const Hits* wanted) {
  const NifRays batch = rays_of(*rays);
  NifHits hits = structure<NifHits>();
  hits.hit = wanted->hit;
  hits.t = wanted->t;
  hits.normal = wanted->normal;
  hits.instance = wanted->instance;
  hits.object = wanted->object;
  hits.triangle = wanted->triangle;
  hits.u = wanted->u;
  hits.v = wanted->v;
  hits.certain = wanted->certain;
  hits.t_low = wanted->t_low;
  hits.t_high = wanted->t_high;
  hits.color = wanted->color;
  hits.user = wanted->user;
  return nifIntersect(scene, &batch, &hits);
}

}  // extern "C"
