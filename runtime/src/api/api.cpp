// Implements the C interface: each function checks its arguments and makes the call, inside a wrapper that
// turns exceptions into codes.
#include <iterator>

#include "api/error.hpp"
#include "api/handles.hpp"
#include "api/structure.hpp"
#include "kernels/shader/shader_source.hpp"
#include "query/float_environment.hpp"
#include "query/validate.hpp"
#include "scene/shaders.hpp"

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

/// Returns the object behind a handle. Throws Failure if there is none.
template <class Handle>
auto& get(Handle handle) {
  using About = Handled<Handle>;
  require_argument(handle, About::kName);
  Object* object = find_object(About::kKind, reinterpret_cast<uintptr_t>(handle));
  if (!object)
    refuse_argument(std::string(About::kName) + " is not a valid handle: it was released, or never was one");
  return static_cast<typename About::Type&>(*object);
}

/// Makes a handle for a new object, and takes over its reference.
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
  job.device->pool.drop_handle(job);
}

template <class Handle>
void release_one(Handle handle) {
  using About = Handled<Handle>;
  if (Object* object = release_handle(About::kKind, reinterpret_cast<uintptr_t>(handle)))
    give_back(static_cast<typename About::Type&>(*object));
}

/// Reads and checks the rays and the outputs of a query.
Request read_query(const NifSceneObject& scene, const NifRays* rays, const NifAnswers* answers) {
  Request request;
  request.rays = read_structure(rays, "rays");
  request.answers = read_structure(answers, "answers");
  check_query(scene, request.rays, request.answers);
  return request;
}

/// The same for first hits.
Request read_hit_query(const NifSceneObject& scene, const NifRays* rays, const NifHits* hits) {
  Request request;
  request.rays = read_structure(rays, "rays");
  request.hits = read_structure(hits, "hits");
  check_hit_query(scene, request.rays, *request.hits);
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
                    {0, configuration.threads, 0, name_of(configuration.kernels.isa),
                     the_device.gpu ? the_device.gpu->description().backend : "cpu",
                     the_device.gpu ? the_device.gpu->description().name : ""},
                    "info");
  });
}

NifError nifGetBackendInfo(uint32_t index, NifBackendInfo* info) {
  return guarded([&] {
    static constexpr const char* kNames[] = {"cpu", "cuda", "hip"};
    if (index >= std::size(kNames)) refuse_argument("no backend has the number " + std::to_string(index));
    const char* reason = index == 0 ? "" : why_no_gpu(kNames[index]);
    write_structure(info, {0, kNames[index], *reason == 0, 0, reason}, "info");
  });
}

NifError nifGetGpuInfo(uint32_t gpu, NifGpuInfo* info) {
  return guarded([&] {
    require_argument(info, "info");
    write_structure(info, describe_gpu(gpu), "info");
  });
}

// ---- Assets

namespace {

NifAsset hand_out_asset(NifAssetObject* asset) {
  const NifAsset handle = hand_out<NifAsset>(asset);
  asset->handle = reinterpret_cast<uintptr_t>(handle);
  asset->device->log(NIF_LOG_INFO, [&] {
    return std::string(asset->name) + ": loaded, " + std::to_string(asset->view.objects.size()) +
           " objects, " + std::to_string(asset->file_bytes) + " bytes";
  });
  return handle;
}

}  // namespace

NifError nifLoadAssetFile(NifDevice device, const char* path, NifLoadMode mode, NifAsset* asset) {
  return guarded([&] {
    auto& the_device = get(device);
    require_argument(path, "path");
    require_argument(asset, "asset");
    const FloatEnvironment environment;
    *asset = hand_out_asset(load_file(&the_device, path, mode));
  });
}

NifError nifLoadAssetMemory(NifDevice device, const void* bytes, uint64_t size, NifLoadMode mode,
                            NifAsset* asset) {
  return guarded([&] {
    auto& the_device = get(device);
    require_argument(asset, "asset");
    const FloatEnvironment environment;
    *asset = hand_out_asset(load_memory(&the_device, bytes, size, mode));
  });
}

NifError nifLoadAssetReader(NifDevice device, const NifReader* reader, NifAsset* asset) {
  return guarded([&] {
    auto& the_device = get(device);
    require_argument(asset, "asset");
    const NifReader own = read_structure(reader, "reader");
    const FloatEnvironment environment;
    *asset = hand_out_asset(load_reader(&the_device, own));
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

NifError nifGetAssetInstanceInfo(NifAsset asset, uint32_t instance, NifAssetInstanceInfo* info) {
  return guarded([&] {
    auto& the_asset = get(asset);
    write_structure(info, describe_instance(the_asset, instance), "info");
  });
}

// ---- Shaders

NifError nifGetShaderTables(NifAsset asset, uint32_t object, uint32_t* words, uint64_t capacity,
                            uint64_t* count) {
  return guarded([&] {
    auto& the_asset = get(asset);
    require_argument(count, "count");
    const FloatEnvironment environment;
    *count = write_shader_tables(the_asset, object, words, capacity);
  });
}

const char* nifGetShaderSource(NifShaderLanguage language) {
  namespace shader = nif::kernels::shader;
  switch (language) {
    case NIF_SHADER_GLSL:
      return shader::kGlsl;
    case NIF_SHADER_WGSL:
      return shader::kWgsl;
    case NIF_SHADER_HLSL:
      return shader::kHlsl;
    case NIF_SHADER_METAL:
      return shader::kMetal;
    default:
      return nullptr;
  }
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

NifError nifRemoveInstance(NifScene scene, uint32_t instance) {
  return guarded([&] { remove_instance(get(scene), instance); });
}

NifError nifSetInstanceTransform(NifScene scene, uint32_t instance, const float* transform) {
  return guarded([&] {
    auto& the_scene = get(scene);
    const FloatEnvironment environment;
    set_transforms(the_scene, 1, &instance, transform, 0);
  });
}

NifError nifSetInstanceTransforms(NifScene scene, uint64_t count, const uint32_t* instances,
                                  const float* transforms, uint64_t stride) {
  return guarded([&] {
    auto& the_scene = get(scene);
    if (count > 0) require_argument(transforms, "transforms");
    const FloatEnvironment environment;
    set_transforms(the_scene, count, instances, transforms, stride);
  });
}

NifError nifSetInstanceOrigin(NifScene scene, uint32_t instance, const double* origin) {
  return guarded([&] {
    auto& the_scene = get(scene);
    const FloatEnvironment environment;
    set_origin(the_scene, instance, origin);
  });
}

NifError nifSetSceneOrigin(NifScene scene, const double* origin) {
  return guarded([&] { set_scene_origin(get(scene), origin); });
}

NifError nifSetInstanceMask(NifScene scene, uint32_t instance, uint32_t mask) {
  return guarded([&] {
    auto& the_scene = get(scene);
    const FloatEnvironment environment;
    set_mask(the_scene, instance, mask);
  });
}

NifError nifSetInstanceFlags(NifScene scene, uint32_t instance, uint32_t flags) {
  return guarded([&] {
    auto& the_scene = get(scene);
    const FloatEnvironment environment;
    set_flags(the_scene, instance, flags);
  });
}

NifError nifSetInstanceUser(NifScene scene, uint32_t instance, uint64_t user) {
  return guarded([&] { set_user(get(scene), instance, user); });
}

NifError nifSetInstanceVertices(NifScene scene, uint32_t instance, const float* positions, uint64_t stride) {
  return guarded([&] {
    auto& the_scene = get(scene);
    const FloatEnvironment environment;
    set_vertices(the_scene, instance, positions, stride);
  });
}

NifError nifPoseInstance(NifScene scene, uint32_t instance, const NifPose* new_pose) {
  return guarded([&] {
    auto& the_scene = get(scene);
    const NifPose own = read_structure(new_pose, "pose");
    const FloatEnvironment environment;
    pose(the_scene, instance, own);
  });
}

NifError nifGetInstanceInfo(NifScene scene, uint32_t instance, NifInstanceInfo* info) {
  return guarded([&] {
    NifInstanceInfo about = describe_instance(get(scene), instance);
    if (!find_object(Kind::asset, reinterpret_cast<uintptr_t>(about.asset))) about.asset = nullptr;
    write_structure(info, about, "info");
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

NifError nifGetSceneShaderTables(NifScene scene, uint32_t* words, uint64_t capacity, uint64_t* count) {
  return guarded([&] {
    auto& the_scene = get(scene);
    require_argument(count, "count");
    const FloatEnvironment environment;
    *count = write_scene_shader_tables(the_scene, words, capacity);
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

NifError nifQuery(NifScene scene, const NifRays* rays, const NifAnswers* answers) {
  return guarded([&] {
    auto& the_scene = get(scene);
    const Request request = read_query(the_scene, rays, answers);
    if (!answered_by_gpu(the_scene, request.rays)) {
      check_on_cpu(the_scene, request);
      answer(the_scene, request);
    } else if (request.rays.count != 0) {
      the_scene.device->gpu->query(the_scene, request.rays, request.answers);
    }
  });
}

NifError nifQueryRay(NifScene scene, const NifRay* ray, const NifAnswers* answers) {
  return guarded([&] {
    auto& the_scene = get(scene);
    require_argument(ray, "ray");
    const NifRays rays = nifMakeRays(ray, 1);
    answer(the_scene, read_query(the_scene, &rays, answers));
  });
}

NifError nifQueryWithFallback(NifScene scene, const NifRays* rays, const NifAnswers* answers,
                              float confidence, NifFallback fallback, void* user) {
  return guarded([&] {
    auto& the_scene = get(scene);
    require_argument(reinterpret_cast<const void*>(fallback), "fallback");
    if (!(confidence >= 0)) refuse_argument("confidence is negative or not a number");
    Request request = read_query(the_scene, rays, answers);
    request.fallback = fallback;
    request.fallback_user = user;
    request.confidence = confidence;
    if (request.rays.memory == NIF_MEMORY_DEVICE || request.rays.stream)
      throw Failure(NIF_ERROR_NOT_AVAILABLE,
                    "rays: a fallback runs on the CPU, so it needs host memory and no stream");
    check_on_cpu(the_scene, request);
    answer(the_scene, request);
  });
}

NifError nifQueryOpen(NifScene scene, const NifRays* rays, const NifAnswers* answers,
                      const NifOpenRays* open) {
  return guarded([&] {
    auto& the_scene = get(scene);
    Request request;
    request.rays = read_structure(rays, "rays");
    if (answers) request.answers = read_structure(answers, "answers");
    request.open = read_structure(open, "open");
    check_open_query(the_scene, request.rays, *request.open);
    if (request.rays.memory == NIF_MEMORY_DEVICE)
      return the_scene.device->gpu->query_open(the_scene, request.rays, request.answers, *request.open);
    check_on_cpu(the_scene, request);
    *request.open->count = 0;
    answer(the_scene, request);
  });
}

NifError nifIntersect(NifScene scene, const NifRays* rays, const NifHits* hits) {
  return guarded([&] {
    auto& the_scene = get(scene);
    const Request request = read_hit_query(the_scene, rays, hits);
    if (request.rays.memory == NIF_MEMORY_HOST) {
      check_on_cpu(the_scene, request);
      answer(the_scene, request);
    } else if (request.rays.count != 0) {
      the_scene.device->gpu->intersect(the_scene, request.rays, *request.hits);
    }
  });
}

NifError nifIntersectRay(NifScene scene, const NifRay* ray, const NifHits* hits) {
  return guarded([&] {
    auto& the_scene = get(scene);
    require_argument(ray, "ray");
    const NifRays rays = nifMakeRays(ray, 1);
    answer(the_scene, read_hit_query(the_scene, &rays, hits));
  });
}

NifError nifMeasureQuery(NifScene scene, const NifRays* rays, const NifAnswers* answers, NifMeasure measure,
                         uint32_t rounds, double* seconds) {
  return guarded([&] {
    auto& the_scene = get(scene);
    require_argument(seconds, "seconds");
    const Request request = read_query(the_scene, rays, answers);
    if (!the_scene.device->gpu)
      throw Failure(NIF_ERROR_NOT_AVAILABLE, "rays: only a GPU can be measured; this device is a CPU");
    if (request.rays.memory != NIF_MEMORY_HOST || request.rays.stream || request.rays.mask)
      refuse_argument("rays: measuring needs host memory, no stream and no masks");
    if (measure > NIF_MEASURE_SINGLE_BVH) refuse_argument("measure is not one of NifMeasure");
    if (request.rays.count == 0 || rounds == 0)
      refuse_argument("rays: there are no rays or no rounds to measure");
    if (!the_scene.ready_on_gpu)
      throw Failure(NIF_ERROR_INVALID_OPERATION, "the scene is not on the GPU, because its commit failed");
    the_scene.device->gpu->measure(the_scene, request.rays, request.answers, GpuMeasure(measure), rounds,
                                   seconds);
  });
}

// ---- Jobs

NifError nifQueryAsync(NifScene scene, const NifRays* rays, const NifAnswers* answers, NifJob* job) {
  return guarded([&] {
    auto& the_scene = get(scene);
    require_argument(job, "job");
    *job = reinterpret_cast<NifJob>(start_job(the_scene, read_query(the_scene, rays, answers)));
  });
}

NifError nifIntersectAsync(NifScene scene, const NifRays* rays, const NifHits* hits, NifJob* job) {
  return guarded([&] {
    auto& the_scene = get(scene);
    require_argument(job, "job");
    *job = reinterpret_cast<NifJob>(start_job(the_scene, read_hit_query(the_scene, rays, hits)));
  });
}

NifError nifWaitJob(NifJob job) {
  return guarded([&] {
    auto& the_job = get(job);
    if (the_job.on_gpu) the_job.device->gpu->wait(the_job);
    the_job.device->pool.finish(the_job, nullptr);
    if (the_job.cancelled)
      throw Failure(NIF_ERROR_CANCELLED, "the job was cancelled before all of its rays were answered");
  });
}

NifError nifCancelJob(NifJob job) {
  return guarded([&] {
    auto& the_job = get(job);
    if (!the_job.on_gpu) the_job.device->pool.cancel(the_job);
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
