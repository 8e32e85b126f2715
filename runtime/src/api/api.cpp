// The C interface: checks of arguments, then the call, under one wrapper that turns exceptions into codes.
#include <cstddef>

#include "api/error.hpp"
#include "api/handles.hpp"
#include "api/structure.hpp"
#include "query/float_environment.hpp"
#include "query/query.hpp"

using namespace nif::runtime;

namespace {

template <class Handle>
struct Handled;
template <>
struct Handled<NifDevice> {
  using Type = NifDeviceObject;
  static constexpr Kind kKind = Kind::device;
  static constexpr const char* kName = "device";
};
template <>
struct Handled<NifAsset> {
  using Type = NifAssetObject;
  static constexpr Kind kKind = Kind::asset;
  static constexpr const char* kName = "asset";
};
template <>
struct Handled<NifScene> {
  using Type = NifSceneObject;
  static constexpr Kind kKind = Kind::scene;
  static constexpr const char* kName = "scene";
};
template <>
struct Handled<NifJob> {
  using Type = NifJobObject;
  static constexpr Kind kKind = Kind::job;
  static constexpr const char* kName = "job";
};

/// What a handle stands for. Throws Failure where that is nothing.
template <class Handle>
auto& get(Handle handle) {
  using About = Handled<Handle>;
  require_argument(handle, About::kName);
  Object* object = find_object(About::kKind, reinterpret_cast<uintptr_t>(handle));
  if (!object)
    refuse_argument(std::string(About::kName) + " is not a valid handle: it was released, or never was one");
  return static_cast<typename About::Type&>(*object);
}

/// A handle for a new object, whose reference it takes over.
template <class Handle>
Handle hand_out(typename Handled<Handle>::Type* object) {
  try {
    return reinterpret_cast<Handle>(make_handle(Handled<Handle>::kKind, object));
  } catch (...) {
    release(object);
    throw;
  }
}

template <class Handle>
void retain(Handle handle) {
  retain_handle(Handled<Handle>::kKind, reinterpret_cast<uintptr_t>(handle));
}

void give_back(NifDeviceObject& device) { release(&device); }
void give_back(NifAssetObject& asset) { release(&asset); }
void give_back(NifSceneObject& scene) { release(&scene); }
void give_back(NifJobObject& job) {
  if (job.on_gpu) job.device->gpu->let_go(job);
  job.device->crew.drop_handle(job);
}

template <class Handle>
void release_one(Handle handle) {
  using About = Handled<Handle>;
  if (Object* object = release_handle(About::kKind, reinterpret_cast<uintptr_t>(handle)))
    give_back(static_cast<typename About::Type&>(*object));
}

/// What is reserved must be 0, so that it can mean something one day.
NifQuery read_query(const NifQuery* from) {
  const NifQuery query = read_structure(from, "query");
  if (query.reserved != 0) refuse_argument("query: reserved must be 0");
  return query;
}

/// Checked: a query whose first hits are asked for.
Request read_hit_request(const NifSceneObject& scene, const NifQuery* query, const NifHits* hits) {
  Request request;
  request.query = read_query(query);
  request.hits = read_structure(hits, "hits", offsetof(NifHits, color));
  check_hit_query(scene, request.query, *request.hits);
  return request;
}

}  // namespace

extern "C" {

uint32_t nifGetVersion(void) { return NIF_VERSION; }

// ---- Device

NifError nifNewDevice(const char* config, const NifDeviceCallbacks* callbacks, NifDevice* device) {
  return guarded([&] {
    require_argument(device, "device");
    *device = hand_out<NifDevice>(new_device(config, callbacks));
  });
}

void nifRetainDevice(NifDevice device) { retain(device); }
void nifReleaseDevice(NifDevice device) { release_one(device); }

NifError nifGetDeviceInfo(NifDevice device, NifDeviceInfo* info) {
  return guarded([&] {
    auto& the_device = get(device);
    const Configuration& configuration = the_device.configuration;
    write_structure(info,
                    {0, configuration.threads, 0, name_of(configuration.kernels.isa), configuration.backend,
                     the_device.gpu ? the_device.gpu->card_name() : ""},
                    "info");
  });
}

NifError nifGetBackendInfo(uint32_t index, NifBackendInfo* info) {
  return guarded([&] {
    if (index > 1) refuse_argument("no backend has the number " + std::to_string(index));
    const char* reason = index == 1 ? why_no_gpu() : "";
    write_structure(info, {0, index == 1 ? "hip" : "cpu", *reason == 0, 0, reason}, "info");
  });
}

NifError nifGetCardInfo(uint32_t card, NifCardInfo* info) {
  return guarded([&] {
    require_argument(info, "info");
    write_structure(info, describe_card(card), "info");
  });
}

// ---- Assets

NifError nifLoadAssetFile(NifDevice device, const char* path, NifLoadMode mode, NifAsset* asset) {
  return guarded([&] {
    auto& the_device = get(device);
    require_argument(path, "path");
    require_argument(asset, "asset");
    const FloatEnvironment environment;
    *asset = hand_out<NifAsset>(load_file(&the_device, path, mode));
  });
}

NifError nifLoadAssetMemory(NifDevice device, const void* bytes, uint64_t size, NifMemoryMode mode,
                            NifAsset* asset) {
  return guarded([&] {
    auto& the_device = get(device);
    require_argument(asset, "asset");
    const FloatEnvironment environment;
    *asset = hand_out<NifAsset>(load_memory(&the_device, bytes, size, mode));
  });
}

void nifRetainAsset(NifAsset asset) { retain(asset); }
void nifReleaseAsset(NifAsset asset) { release_one(asset); }

NifError nifGetAssetInfo(NifAsset asset, NifAssetInfo* info) {
  return guarded([&] {
    auto& the_asset = get(asset);
    write_structure(info, describe(the_asset), "info");
  });
}

NifError nifGetPartInfo(NifAsset asset, uint32_t part, NifPartInfo* info) {
  return guarded([&] {
    auto& the_asset = get(asset);
    write_structure(info, describe_part(the_asset, part), "info");
  });
}

NifError nifGetObjectInfo(NifAsset asset, uint32_t object, NifObjectInfo* info) {
  return guarded([&] {
    auto& the_asset = get(asset);
    write_structure(info, describe_object(the_asset, object), "info");
  });
}

NifError nifGetInstanceInfo(NifAsset asset, uint32_t instance, NifInstanceInfo* info) {
  return guarded([&] {
    auto& the_asset = get(asset);
    write_structure(info, describe_instance(the_asset, instance), "info");
  });
}

// ---- Scenes

NifError nifNewScene(NifDevice device, NifScene* scene) {
  return guarded([&] {
    auto& the_device = get(device);
    require_argument(scene, "scene");
    *scene = hand_out<NifScene>(new_scene(&the_device));
  });
}

void nifRetainScene(NifScene scene) { retain(scene); }
void nifReleaseScene(NifScene scene) { release_one(scene); }

NifError nifAddInstance(NifScene scene, NifAsset asset, uint32_t object, const float* transform,
                        uint32_t* instance) {
  return guarded([&] {
    auto& the_scene = get(scene);
    auto& the_asset = get(asset);
    const FloatEnvironment environment;
    const Added added = add_instance(the_scene, &the_asset, object, transform);
    if (instance) *instance = added.first;
  });
}

NifError nifAddAsset(NifScene scene, NifAsset asset, const float* transform, uint32_t* first,
                     uint32_t* count) {
  return guarded([&] {
    auto& the_scene = get(scene);
    auto& the_asset = get(asset);
    const FloatEnvironment environment;
    const Added added = add_asset(the_scene, &the_asset, transform);
    if (first) *first = added.first;
    if (count) *count = added.count;
  });
}

NifError nifSetInstanceTransform(NifScene scene, uint32_t instance, const float* transform) {
  return guarded([&] {
    auto& the_scene = get(scene);
    const FloatEnvironment environment;
    set_transform(the_scene, instance, transform);
  });
}

NifError nifCommitScene(NifScene scene) {
  return guarded([&] {
    auto& the_scene = get(scene);
    const FloatEnvironment environment;
    commit(the_scene);
  });
}

NifError nifGetSceneInfo(NifScene scene, NifSceneInfo* info) {
  return guarded([&] {
    auto& the_scene = get(scene);
    write_structure(info, describe(the_scene), "info");
  });
}

// ---- Queries

NifError nifGetQueryScratchBytes(NifScene scene, uint64_t count, uint64_t* bytes) {
  return guarded([&] {
    get(scene);
    require_argument(bytes, "bytes");
    *bytes = scratch_bytes(count);
  });
}

NifError nifQuery(NifScene scene, const NifQuery* query) {
  return guarded([&] {
    auto& the_scene = get(scene);
    Request request;
    request.query = read_query(query);
    check_query(the_scene, request.query);
    if (!answered_by_gpu(the_scene, request.query)) {
      check_scratch(request.query);
      answer(the_scene, request);
    } else if (request.query.count != 0) {
      the_scene.device->gpu->query(the_scene, request.query);
    }
  });
}

NifError nifQueryRay(NifScene scene, const NifRay* ray, uint8_t* visible) {
  return guarded([&] {
    auto& the_scene = get(scene);
    require_argument(ray, "ray");
    require_argument(visible, "visible");
    Request request;
    request.query = nifQueryRays(ray, 1);
    request.query.visible = visible;
    check_query(the_scene, request.query);
    answer(the_scene, request);
  });
}

NifError nifQueryWithFallback(NifScene scene, const NifQuery* query, float confidence, NifFallback fallback,
                              void* user) {
  return guarded([&] {
    auto& the_scene = get(scene);
    require_argument(reinterpret_cast<const void*>(fallback), "fallback");
    if (!(confidence >= 0)) refuse_argument("confidence is negative or not a number");
    Request request;
    request.query = read_query(query);
    request.fallback = fallback;
    request.fallback_user = user;
    request.confidence = confidence;
    check_query(the_scene, request.query);
    if (request.query.memory == NIF_DEVICE || request.query.stream)
      throw Failure(NIF_ERROR_NOT_AVAILABLE,
                    "query: a fallback runs on the CPU, so it needs host memory and no stream");
    check_scratch(request.query);
    answer(the_scene, request);
  });
}

NifError nifQueryOpen(NifScene scene, const NifQuery* query, const NifOpenRays* open) {
  return guarded([&] {
    auto& the_scene = get(scene);
    Request request;
    request.query = read_query(query);
    request.open = read_structure(open, "open");
    check_open_query(the_scene, request.query, *request.open);
    if (request.query.memory == NIF_DEVICE)
      return the_scene.device->gpu->query_open(the_scene, request.query, *request.open);
    check_scratch(request.query);
    *request.open->count = 0;
    answer(the_scene, request);
  });
}

NifError nifIntersect(NifScene scene, const NifQuery* query, const NifHits* hits) {
  return guarded([&] {
    auto& the_scene = get(scene);
    const Request request = read_hit_request(the_scene, query, hits);
    if (request.query.memory == NIF_HOST) {
      check_scratch(request.query);
      answer(the_scene, request);
    } else if (request.query.count != 0) {
      the_scene.device->gpu->intersect(the_scene, request.query, *request.hits);
    }
  });
}

NifError nifMeasureQuery(NifScene scene, const NifQuery* query, NifMeasure measure, uint32_t rounds,
                         double* seconds) {
  return guarded([&] {
    auto& the_scene = get(scene);
    require_argument(seconds, "seconds");
    const NifQuery asked = read_query(query);
    check_query(the_scene, asked);
    if (!the_scene.device->gpu)
      throw Failure(NIF_ERROR_NOT_AVAILABLE, "query: only a GPU can be measured; this device is a CPU");
    if (asked.memory != NIF_HOST || asked.stream)
      refuse_argument("query: measuring needs host memory and no stream");
    if (measure > NIF_MEASURE_SINGLE_BVH) refuse_argument("measure is not one of NifMeasure");
    if (asked.count == 0 || rounds == 0) refuse_argument("query: there are no rays or no rounds to measure");
    if (!the_scene.ready_on_gpu)
      throw Failure(NIF_ERROR_INVALID_OPERATION, "the scene is not on the GPU, because its commit failed");
    the_scene.device->gpu->measure(the_scene, asked, GpuMeasure(measure), rounds, seconds);
  });
}

// ---- Jobs

NifError nifQueryAsync(NifScene scene, const NifQuery* query, NifJob* job) {
  return guarded([&] {
    auto& the_scene = get(scene);
    require_argument(job, "job");
    Request request;
    request.query = read_query(query);
    check_query(the_scene, request.query);
    *job = reinterpret_cast<NifJob>(start_job(the_scene, request));
  });
}

NifError nifIntersectAsync(NifScene scene, const NifQuery* query, const NifHits* hits, NifJob* job) {
  return guarded([&] {
    auto& the_scene = get(scene);
    require_argument(job, "job");
    *job = reinterpret_cast<NifJob>(start_job(the_scene, read_hit_request(the_scene, query, hits)));
  });
}

NifError nifWaitJob(NifJob job) {
  return guarded([&] {
    auto& the_job = get(job);
    if (the_job.on_gpu) the_job.device->gpu->wait(the_job);
    the_job.device->crew.finish(the_job, nullptr);
  });
}

NifError nifIsJobDone(NifJob job, uint32_t* done) {
  return guarded([&] {
    auto& the_job = get(job);
    require_argument(done, "done");
    if (the_job.on_gpu) the_job.device->gpu->poll(the_job);
    *done = the_job.is_done();
  });
}

void nifRetainJob(NifJob job) { retain(job); }
void nifReleaseJob(NifJob job) { release_one(job); }

}  // extern "C"
