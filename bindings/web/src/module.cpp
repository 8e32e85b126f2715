// What the JavaScript of this package calls: nif.h without structures, 64-bit numbers and out parameters.
// Each call returns a code of NifError; what else it says lies in `said`, where JavaScript reads it.
//
// Handles and pointers are trusted: they come from the package's JavaScript alone, which checks what its
// users give.
#include <emscripten.h>
#include <nif/nif.h>

#include <cstdint>

namespace {

/// Numbers that a call returns, in the order that its comment names. 64-bit ones are exact up to 2^53.
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

/// Rays as JavaScript lays them out; the offsets of its members are in js/layout.js. A stride of 0: one for
/// all rays.
struct Rays {
  uint32_t count;
  const float *origin, *direction, *tmin,
      *tmax;  ///< of the first two: x, y and z in a row; the others may be null
  uint32_t origin_stride, direction_stride, tmin_stride, tmax_stride;  ///< bytes
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
};

NifQuery query_of(const Rays& rays) {
  NifQuery query = structure<NifQuery>();
  query.count = rays.count;
  for (int axis = 0; axis < 3; ++axis) {
    query.origin[axis] = rays.origin + axis;
    query.direction[axis] = rays.direction + axis;
  }
  query.origin_stride = rays.origin_stride;
  query.direction_stride = rays.direction_stride;
  query.tmin = rays.tmin;
  query.tmin_stride = rays.tmin_stride;
  query.tmax = rays.tmax;
  query.tmax_stride = rays.tmax_stride;
  return query;
}

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
  const NifError error = nifLoadAssetMemory(device, bytes, size, NIF_MEMORY_COPY, &asset);
  Saying().handle(asset);
  return error;
}
EMSCRIPTEN_KEEPALIVE void web_release_asset(NifAsset asset) { nifReleaseAsset(asset); }

/// objects, instances, networks, version of the format, bytes of the file, bytes in memory, metadata, its
/// bytes, whether it places nothing
EMSCRIPTEN_KEEPALIVE int web_asset_info(NifAsset asset) {
  NifAssetInfo info = structure<NifAssetInfo>();
  const NifError error = nifGetAssetInfo(asset, &info);
  Saying() << info.object_count << info.instance_count << info.network_count << info.format_version
           << info.file_bytes << info.resident_bytes << info.metadata << info.metadata_bytes
           << info.places_nothing;
  return error;
}

/// name, encoding, network, 6 bounds, bias, triangles, bytes in memory, whether it proves, source triangles,
/// colours
EMSCRIPTEN_KEEPALIVE int web_object_info(NifAsset asset, uint32_t object) {
  NifObjectInfo info = structure<NifObjectInfo>();
  const NifError error = nifGetObjectInfo(asset, object, &info);
  Saying() << info.name << int(info.encoding) << info.network << info.bounds_min << info.bounds_max
           << info.bias << info.triangles << info.resident_bytes << info.proves << info.source_triangles
           << info.colors;
  return error;
}

/// name, object, 12 of the transform
EMSCRIPTEN_KEEPALIVE int web_instance_info(NifAsset asset, uint32_t instance) {
  NifInstanceInfo info = structure<NifInstanceInfo>();
  const NifError error = nifGetInstanceInfo(asset, instance, &info);
  Saying() << info.name << info.object << info.transform;
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
EMSCRIPTEN_KEEPALIVE int web_set_transform(NifScene scene, uint32_t instance, const float* transform) {
  return nifSetInstanceTransform(scene, instance, transform);
}
EMSCRIPTEN_KEEPALIVE int web_commit(NifScene scene) { return nifCommitScene(scene); }

/// instances, committed, 6 bounds, bytes in memory
EMSCRIPTEN_KEEPALIVE int web_scene_info(NifScene scene) {
  NifSceneInfo info = structure<NifSceneInfo>();
  const NifError error = nifGetSceneInfo(scene, &info);
  Saying() << info.instance_count << info.committed << info.bounds_min << info.bounds_max
           << info.resident_bytes;
  return error;
}

EMSCRIPTEN_KEEPALIVE int web_query(NifScene scene, const Rays* rays, const Answers* answers) {
  NifQuery query = query_of(*rays);
  query.visible = answers->visible;
  query.visible_bits = answers->visible_bits;
  query.probability = answers->probability;
  query.certain = answers->certain;
  query.logit = answers->logit;
  return nifQuery(scene, &query);
}

EMSCRIPTEN_KEEPALIVE int web_intersect(NifScene scene, const Rays* rays, const Hits* wanted) {
  const NifQuery query = query_of(*rays);
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
  return nifIntersect(scene, &query, &hits);
}

}  // extern "C"
