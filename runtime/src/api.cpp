// The C interface: checks of arguments, then the call, under one wrapper that turns exceptions into codes.
#include "error.hpp"
#include "float_environment.hpp"
#include "query.hpp"
#include "structure.hpp"

using namespace nif::runtime;

extern "C" {

uint32_t nifGetVersion(void) { return NIF_VERSION; }

// ---- Device

NifError nifNewDevice(const char* config, const NifDeviceCallbacks* callbacks, NifDevice* device) {
  return guarded([&] {
    require_argument(device, "device");
    *device = new_device(config, callbacks);
  });
}

void nifRetainDevice(NifDevice device) {
  if (device) device->retain();
}

void nifReleaseDevice(NifDevice device) { release(device); }

NifError nifGetDeviceInfo(NifDevice device, NifDeviceInfo* info) {
  return guarded([&] {
    require_argument(device, "device");
    const Configuration& configuration = device->configuration;
    write_structure(info, {0, configuration.threads, 0, name_of(configuration.isa), configuration.backend},
                    "info");
  });
}

NifError nifGetBackendInfo(uint32_t index, NifBackendInfo* info) {
  return guarded([&] {
    const NifBackendInfo known[] = {{0, "cpu", 1, 0, ""}, {0, "hip", 0, 0, why_no_hip()}};
    if (index >= std::size(known)) refuse_argument("there is no backend " + std::to_string(index));
    write_structure(info, known[index], "info");
  });
}

// ---- Assets

NifError nifLoadAssetFile(NifDevice device, const char* path, NifLoadMode mode, NifAsset* asset) {
  return guarded([&] {
    require_argument(device, "device");
    require_argument(path, "path");
    require_argument(asset, "asset");
    const FloatEnvironment environment;
    *asset = load_file(device, path, mode);
  });
}

NifError nifLoadAssetMemory(NifDevice device, const void* bytes, uint64_t size, NifMemoryMode mode,
                            NifAsset* asset) {
  return guarded([&] {
    require_argument(device, "device");
    require_argument(asset, "asset");
    const FloatEnvironment environment;
    *asset = load_memory(device, bytes, size, mode);
  });
}

void nifRetainAsset(NifAsset asset) {
  if (asset) asset->retain();
}

void nifReleaseAsset(NifAsset asset) { release(asset); }

NifError nifGetAssetInfo(NifAsset asset, NifAssetInfo* info) {
  return guarded([&] {
    require_argument(asset, "asset");
    write_structure(info, describe(*asset), "info");
  });
}

NifError nifGetObjectInfo(NifAsset asset, uint32_t object, NifObjectInfo* info) {
  return guarded([&] {
    require_argument(asset, "asset");
    write_structure(info, describe_object(*asset, object), "info");
  });
}

NifError nifGetInstanceInfo(NifAsset asset, uint32_t instance, NifInstanceInfo* info) {
  return guarded([&] {
    require_argument(asset, "asset");
    write_structure(info, describe_instance(*asset, instance), "info");
  });
}

// ---- Scenes

NifError nifNewScene(NifDevice device, NifScene* scene) {
  return guarded([&] {
    require_argument(device, "device");
    require_argument(scene, "scene");
    *scene = new_scene(device);
  });
}

void nifRetainScene(NifScene scene) {
  if (scene) scene->retain();
}

void nifReleaseScene(NifScene scene) { release(scene); }

NifError nifAddInstance(NifScene scene, NifAsset asset, uint32_t object, const float* transform,
                        uint32_t* instance) {
  return guarded([&] {
    require_argument(scene, "scene");
    require_argument(asset, "asset");
    const FloatEnvironment environment;
    const Added added = add_instance(*scene, asset, object, transform);
    if (instance) *instance = added.first;
  });
}

NifError nifAddAsset(NifScene scene, NifAsset asset, const float* transform, uint32_t* first,
                     uint32_t* count) {
  return guarded([&] {
    require_argument(scene, "scene");
    require_argument(asset, "asset");
    const FloatEnvironment environment;
    const Added added = add_asset(*scene, asset, transform);
    if (first) *first = added.first;
    if (count) *count = added.count;
  });
}

NifError nifSetInstanceTransform(NifScene scene, uint32_t instance, const float* transform) {
  return guarded([&] {
    require_argument(scene, "scene");
    const FloatEnvironment environment;
    set_transform(*scene, instance, transform);
  });
}

NifError nifCommitScene(NifScene scene) {
  return guarded([&] {
    require_argument(scene, "scene");
    const FloatEnvironment environment;
    commit(*scene);
  });
}

NifError nifGetSceneInfo(NifScene scene, NifSceneInfo* info) {
  return guarded([&] {
    require_argument(scene, "scene");
    write_structure(info, describe(*scene), "info");
  });
}

// ---- Queries

NifError nifGetQueryScratchBytes(NifScene scene, uint64_t count, uint64_t* bytes) {
  return guarded([&] {
    require_argument(scene, "scene");
    require_argument(bytes, "bytes");
    *bytes = scratch_bytes(count);
  });
}

NifError nifQuery(NifScene scene, const NifQuery* query) {
  return guarded([&] {
    require_argument(scene, "scene");
    Request request;
    request.query = read_structure(query, "query");
    check_query(*scene, request.query);
    answer(*scene, request);
  });
}

NifError nifQueryRay(NifScene scene, const NifRay* ray, uint8_t* visible) {
  return guarded([&] {
    require_argument(scene, "scene");
    require_argument(ray, "ray");
    require_argument(visible, "visible");
    Request request;
    request.query = nifQueryRays(ray, 1);
    request.query.visible = visible;
    check_query(*scene, request.query);
    answer(*scene, request);
  });
}

NifError nifQueryWithFallback(NifScene scene, const NifQuery* query, float confidence, NifFallback fallback,
                              void* user) {
  return guarded([&] {
    require_argument(scene, "scene");
    require_argument(reinterpret_cast<const void*>(fallback), "fallback");
    if (!(confidence >= 0)) refuse_argument("confidence is negative or not a number");
    Request request;
    request.query = read_structure(query, "query");
    request.fallback = fallback;
    request.fallback_user = user;
    request.confidence = confidence;
    check_query(*scene, request.query);
    answer(*scene, request);
  });
}

// ---- Jobs

NifError nifQueryAsync(NifScene scene, const NifQuery* query, NifJob* job) {
  return guarded([&] {
    require_argument(scene, "scene");
    require_argument(job, "job");
    Request request;
    request.query = read_structure(query, "query");
    check_query(*scene, request.query);
    *job = start_job(*scene, request);
  });
}

NifError nifWaitJob(NifJob job) {
  return guarded([&] {
    require_argument(job, "job");
    job->device->crew.finish(*job, nullptr);
  });
}

NifError nifIsJobDone(NifJob job, uint32_t* done) {
  return guarded([&] {
    require_argument(job, "job");
    require_argument(done, "done");
    *done = job->is_done();
  });
}

void nifRetainJob(NifJob job) {
  if (job) job->device->crew.add_handle(*job);
}

void nifReleaseJob(NifJob job) {
  if (job) job->device->crew.drop_handle(*job);
}

}  // extern "C"
