// Forwards calls to the GPU module, turns its codes and messages into Failure, and remembers the loss of a
// GPU. An asset is uploaded once, with the first scene that uses it.
#include "gpu/gpu.hpp"

#include <algorithm>
#include <string>
#include <string_view>

#include "api/error.hpp"
#include "gpu/load_module.hpp"
#include "query/job.hpp"
#include "scene/scene.hpp"

namespace nif::runtime {
namespace {

/// Copies the text, truncated to the message's size.
void set_text(GpuMessage& message, std::string_view text) {
  message.text[text.copy(message.text, sizeof(message.text) - 1)] = 0;
}

}  // namespace

void Gpu::lose(const NifDeviceObject& device, const GpuMessage& message) {
  if (!lost_.exchange(true)) device.log(NIF_LOG_WARNING, [&] { return message.text; });
}

void Gpu::check(const NifDeviceObject& device, NifError code, const GpuMessage& message) {
  if (code == NIF_OK) return;
  if (code == NIF_ERROR_DEVICE_LOST) lose(device, message);
  throw Failure(code, message.text);
}

Gpu::Gpu(std::string_view module, std::string_view backend, std::optional<uint32_t> number,
         const GpuSettings& settings)
    : module_(load_gpu_module(module)) {
  GpuMessage message;
  const auto check = [&](NifError code) {
    if (code != NIF_OK) throw Failure(code, message.text);
  };
  const auto fits = [&] { return backend == "gpu" || backend == description_.backend; };
  uint32_t gpu = number.value_or(0);
  check(module_.describe_gpu(gpu, &description_, &message));
  if (!number && !fits()) {
    const uint32_t count = module_.count_gpus(&message);
    do {
      if (++gpu >= count)
        throw Failure(NIF_ERROR_NOT_AVAILABLE, "there is no GPU of " + std::string(backend));
      check(module_.describe_gpu(gpu, &description_, &message));
    } while (!fits());
  }
  if (!fits())
    throw Failure(NIF_ERROR_NOT_AVAILABLE, "GPU " + std::to_string(gpu) + " (" + description_.name +
                                               ") is one of " + description_.backend + ", not of " +
                                               std::string(backend));
  check(module_.open_device(gpu, &settings, &device_, &message));
}

void Gpu::upload(NifAssetObject& asset) {
  const std::lock_guard lock(uploads_);  // scenes that share the asset may be committed concurrently
  if (asset.on_gpu) return;
  std::pmr::vector<kernels::AnyField> objects(asset.device->memory());
  std::pmr::vector<kernels::HitDetails> details(asset.device->memory());
  for (uint32_t i = 0; i < asset.view.objects.size(); ++i) {
    const format::ObjectView& object = asset.view.objects[i];
    objects.push_back(object.unsupported ? kernels::AnyField(kernels::TrianglesField()) : field_of(object));
    details.push_back(hit_details(asset.view, i));
  }
  GpuMessage message;
  uint64_t bytes = 0;
  const NifError code = module_.upload_asset(device_, objects.data(), details.data(),
                                             uint32_t(objects.size()), &asset.on_gpu, &bytes, &message);
  asset.gpu_bytes = bytes;
  if (code != NIF_OK) set_text(message, std::string(asset.name) + ": " + message.text);
  check(*asset.device.get(), code, message);
}

void Gpu::upload(NifSceneObject& scene) {
  scene.ready_on_gpu = false;
  for (const HeldAsset& held : scene.assets) upload(*held.asset.get());
  auto* memory = scene.device->memory();
  std::pmr::vector<GpuPlacedObject> objects(scene.objects.size(), memory);
  for (const HeldAsset& held : scene.assets)
    for (uint32_t i = 0; i < held.asset->view.objects.size(); ++i)
      objects[held.first_object + i] = {held.asset->on_gpu, i, i};
  // Queries that are under way may read what bent instances had until now.
  struct Bent {
    Gpu& gpu;
    std::pmr::vector<GpuAsset*> old;
    ~Bent() {
      for (GpuAsset* one : old) gpu.module_.free_asset(gpu.device_, one);
    }
  } bent{*this, std::pmr::vector<GpuAsset*>(memory)};
  bent.old.reserve(scene.bent.size());
  for (const BentInstance& one : scene.bent) {
    if (one.instance == kernels::kNoInstance) continue;  // no instance names it
    const PlacedObject& object = scene.objects[one.object];
    if (one.own->current_on_gpu) {
      objects[one.object] = {one.own->on_gpu, 0, object.number};
      continue;
    }
    const kernels::AnyField field(*object.bent);
    GpuMessage message;
    GpuAsset* moved = nullptr;
    uint64_t bytes = 0;
    check(*scene.device.get(),
          module_.upload_asset(device_, &field, &object.details, 1, &moved, &bytes, &message), message);
    if (one.own->on_gpu) bent.old.push_back(one.own->on_gpu);
    one.own->on_gpu = moved;
    one.own->current_on_gpu = true;
    objects[one.object] = {moved, 0, object.number};
  }
  const std::span<const Node> nodes = scene.hierarchy.nodes();
  std::pmr::vector<uint64_t> users(memory);
  const auto has_user = [](const InstanceSettings& settings) { return settings.user != 0; };
  if (std::any_of(scene.settings.begin(), scene.settings.end(), has_user))
    for (const InstanceSettings& settings : scene.settings) users.push_back(settings.user);
  const GpuSceneView view{nodes.data(),
                          scene.instances.data(),
                          users.empty() ? nullptr : users.data(),
                          objects.data(),
                          nodes.size(),
                          scene.instances.size(),
                          objects.size(),
                          scene.sole,
                          scene.unproven};
  GpuMessage message;
  check(*scene.device.get(), module_.upload_scene(device_, &view, &scene.on_gpu, &message), message);
  scene.ready_on_gpu = true;
}

void Gpu::free(NifAssetObject& asset) noexcept { module_.free_asset(device_, asset.on_gpu); }
void Gpu::free(BentObject& bent) noexcept {
  module_.free_asset(device_, bent.on_gpu);
  module_.free_fetch(device_, bent.fetched());
}
void Gpu::free(NifSceneObject& scene) noexcept { module_.free_scene(device_, scene.on_gpu); }

void Gpu::query(NifSceneObject& scene, const NifRays& rays, const NifAnswers& answers) {
  GpuMessage message;
  check(*scene.device.get(), module_.query(device_, scene.on_gpu, &rays, &answers, &message), message);
}

void Gpu::query_open(NifSceneObject& scene, const NifRays& rays, const NifAnswers& answers,
                     const NifOpenRays& open) {
  GpuMessage message;
  check(*scene.device.get(), module_.query_open(device_, scene.on_gpu, &rays, &answers, &open, &message),
        message);
}

void Gpu::intersect(NifSceneObject& scene, const NifRays& rays, const NifHits& hits) {
  GpuMessage message;
  check(*scene.device.get(), module_.intersect(device_, scene.on_gpu, &rays, &hits, &message), message);
}

void Gpu::check_host_query(const NifDeviceObject& device, const Request& request) {
  if (lost_) return;
  GpuMessage message;
  const NifError code = module_.check_host_query(device_, &request.rays, &request.answers,
                                                 request.open ? &*request.open : nullptr,
                                                 request.hits ? &*request.hits : nullptr, &message);
  if (code == NIF_ERROR_DEVICE_LOST) lose(device, message);
  // The CPU needs no working GPU.
  if (code == NIF_ERROR_WRONG_POINTER) throw Failure(code, message.text);
}

void Gpu::check_host_array(const NifDeviceObject& device, const void* array, const char* name) {
  if (lost_) return;
  GpuMessage message;
  const NifError code = module_.check_host_array(device_, array, name, &message);
  if (code == NIF_ERROR_DEVICE_LOST) lose(device, message);
  if (code == NIF_ERROR_WRONG_POINTER) throw Failure(code, message.text);
}

void Gpu::fetch(const NifDeviceObject& device, std::span<const FetchedArray> arrays, void* stream,
                GpuFetch*& fetch) {
  GpuMessage message;
  check(device,
        module_.fetch_arrays(device_, arrays.data(), uint32_t(arrays.size()), stream, &fetch, &message),
        message);
}

const unsigned char* Gpu::wait(const NifDeviceObject& device, GpuFetch& fetch) {
  GpuMessage message;
  const unsigned char* bytes = nullptr;
  check(device, module_.wait_fetch(device_, &fetch, &bytes, &message), message);
  return bytes;
}

static_assert(uint32_t(GpuMeasure::single_bvh) == NIF_MEASURE_SINGLE_BVH &&
              kMeasuredStages == NIF_MEASURED_STAGES);

void Gpu::measure(NifSceneObject& scene, const NifRays& rays, const NifAnswers& answers, GpuMeasure measure,
                  uint32_t rounds, double* seconds) {
  GpuMessage message;
  check(*scene.device.get(),
        module_.measure_query(device_, scene.on_gpu, &rays, &answers, measure, rounds, seconds, &message),
        message);
}

void Gpu::start(NifSceneObject& scene, const Request& request, NifJobObject& job) {
  GpuMessage message;
  check(*scene.device.get(),
        module_.start_query(device_, scene.on_gpu, &request.rays, &request.answers,
                            request.hits ? &*request.hits : nullptr, &job.on_gpu, &message),
        message);
}

void Gpu::wait(NifJobObject& job) {
  GpuMessage message;
  const NifError code = module_.wait_job(device_, job.on_gpu, &message);
  job.done = job.batches;  // done even after an error: nothing is left to wait for
  check(*job.device, code, message);
}

void Gpu::poll(NifJobObject& job) {
  GpuMessage message;
  uint32_t done = 0;
  const NifError code = module_.is_job_done(device_, job.on_gpu, &done, &message);
  if (done || code != NIF_OK) job.done = job.batches;
  check(*job.device, code, message);
}

void Gpu::let_go(NifJobObject& job) noexcept {
  job.done = job.batches;
  module_.free_job(device_, job.on_gpu);
  job.on_gpu = nullptr;
}

const char* why_no_gpu(std::string_view backend) {
  static thread_local GpuMessage why;
  try {
    const GpuModule& module = load_gpu_module("");
    const uint32_t count = module.count_gpus(&why);
    if (count == 0) return why.text;
    set_text(why, "there is no GPU of " + std::string(backend));
    GpuDescription gpu;
    GpuMessage message;
    for (uint32_t i = 0; i < count; ++i) {
      const NifError code = module.describe_gpu(i, &gpu, &message);
      if (code == NIF_OK && backend != gpu.backend) continue;
      why = code == NIF_OK ? gpu.trouble : message;
      if (why.text[0] == 0) return "";
    }
  } catch (const std::exception& error) {
    set_text(why, error.what());
  }
  return why.text;
}

NifGpuInfo describe_gpu(uint32_t gpu) {
  static thread_local GpuDescription about;
  const GpuModule& module = load_gpu_module("");
  GpuMessage message;
  const uint32_t count = module.count_gpus(&message);
  if (count == 0) throw Failure(NIF_ERROR_NOT_AVAILABLE, message.text);
  if (gpu >= count)
    refuse_argument("there is no GPU " + std::to_string(gpu) + " of " + std::to_string(count));
  if (const NifError code = module.describe_gpu(gpu, &about, &message); code != NIF_OK)
    throw Failure(code, message.text);
  NifGpuInfo info{};
  info.name = about.name;
  info.target = about.target;
  info.driver = about.driver;
  info.backend = about.backend;
  info.memory_bytes = about.memory;
  info.available = about.trouble.text[0] == 0;
  info.reason = about.trouble.text;
  info.pci_domain = about.place.pci_domain;
  info.pci_bus = about.place.pci_bus;
  info.pci_device = about.place.pci_device;
  std::copy_n(about.place.uuid, sizeof(info.uuid), info.uuid);
  std::copy_n(about.place.luid, sizeof(info.luid), info.luid);
  info.has_luid = about.place.has_luid;
  return info;
}

}  // namespace nif::runtime
