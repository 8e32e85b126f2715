// Forwards calls to the module and turns its codes and messages into Failure; once a card is lost, that
// is noted. An asset is uploaded once, with the first scene that has it.
#include "gpu/gpu.hpp"

#include <string>
#include <string_view>

#include "api/error.hpp"
#include "gpu/load_module.hpp"
#include "scene/scene.hpp"

namespace nif::runtime {
namespace {

/// As much of it as there is room for.
void set_text(GpuMessage& message, std::string_view text) {
  message.text[text.copy(message.text, sizeof(message.text) - 1)] = 0;
}

}  // namespace

void Gpu::check(NifError code, const GpuMessage& message) {
  if (code == NIF_OK) return;
  if (code == NIF_ERROR_DEVICE_LOST) lost_ = true;
  throw Failure(code, message.text);
}

Gpu::Gpu(std::string_view module, uint32_t card, const GpuSettings& settings)
    : module_(load_gpu_module(module)) {
  GpuMessage message;
  check(module_.describe_card(card, &card_, &message), message);
  check(module_.open_device(card, &settings, &device_, &message), message);
}

void Gpu::upload(NifAssetObject& asset) {
  const std::lock_guard lock(uploads_);  // scenes that share the asset may be committed at the same time
  if (asset.on_gpu) return;
  std::pmr::vector<kernels::AnyField> objects(asset.device->memory());
  std::pmr::vector<kernels::HitDetails> details(asset.device->memory());
  for (uint32_t i = 0; i < asset.view.objects.size(); ++i) {
    objects.push_back(field_of(asset.view.objects[i]));
    details.push_back(hit_details(asset.view, i));
  }
  GpuMessage message;
  uint64_t bytes = 0;
  const NifError code = module_.upload_asset(device_, objects.data(), details.data(),
                                             uint32_t(objects.size()), &asset.on_gpu, &bytes, &message);
  asset.gpu_bytes = bytes;
  if (code != NIF_OK) set_text(message, std::string(asset.name) + ": " + message.text);
  check(code, message);
}

void Gpu::upload(NifSceneObject& scene) {
  scene.ready_on_gpu = false;
  for (const HeldAsset& held : scene.assets) upload(*held.asset.get());
  auto* memory = scene.device->memory();
  std::pmr::vector<GpuPlacedObject> objects(scene.objects.size(), memory);
  for (const HeldAsset& held : scene.assets)
    for (uint32_t i = 0; i < held.asset->view.objects.size(); ++i)
      objects[held.first_object + i] = {held.asset->on_gpu, i};
  const std::span<const Node> nodes = scene.hierarchy.nodes();
  const GpuSceneView view{nodes.data(), scene.instances.data(), objects.data(),
                          nodes.size(), scene.instances.size(), objects.size()};
  GpuMessage message;
  check(module_.upload_scene(device_, &view, &scene.on_gpu, &message), message);
  scene.ready_on_gpu = true;
}

void Gpu::free(NifAssetObject& asset) noexcept { module_.free_asset(device_, asset.on_gpu); }
void Gpu::free(NifSceneObject& scene) noexcept { module_.free_scene(device_, scene.on_gpu); }

void Gpu::query(NifSceneObject& scene, const NifQuery& query) {
  GpuMessage message;
  check(module_.query(device_, scene.on_gpu, &query, &message), message);
}

void Gpu::query_open(NifSceneObject& scene, const NifQuery& query, const NifOpenRays& open) {
  GpuMessage message;
  check(module_.query_open(device_, scene.on_gpu, &query, &open, &message), message);
}

void Gpu::intersect(NifSceneObject& scene, const NifQuery& query, const NifHits& hits) {
  GpuMessage message;
  check(module_.intersect(device_, scene.on_gpu, &query, &hits, &message), message);
}

static_assert(uint32_t(GpuMeasure::single_bvh) == NIF_MEASURE_SINGLE_BVH &&
              kMeasuredStages == NIF_MEASURED_STAGES);

void Gpu::measure(NifSceneObject& scene, const NifQuery& query, GpuMeasure measure, uint32_t rounds,
                  double* seconds) {
  GpuMessage message;
  check(module_.measure_query(device_, scene.on_gpu, &query, measure, rounds, seconds, &message), message);
}

void Gpu::start(NifSceneObject& scene, const NifQuery& query, const NifHits* hits, NifJobObject& job) {
  GpuMessage message;
  check(module_.start_query(device_, scene.on_gpu, &query, hits, &job.on_gpu, &message), message);
}

void Gpu::wait(NifJobObject& job) {
  GpuMessage message;
  const NifError code = module_.wait_job(device_, job.on_gpu, &message);
  job.done = job.batches;  // there is nothing more to wait for, whatever it came to
  check(code, message);
}

void Gpu::poll(NifJobObject& job) {
  GpuMessage message;
  uint32_t done = 0;
  const NifError code = module_.is_job_done(device_, job.on_gpu, &done, &message);
  if (done || code != NIF_OK) job.done = job.batches;
  check(code, message);
}

void Gpu::let_go(NifJobObject& job) noexcept {
  job.done = job.batches;
  module_.free_job(device_, job.on_gpu);
  job.on_gpu = nullptr;
}

const char* why_no_gpu() {
  static thread_local GpuMessage why;
  try {
    const GpuModule& module = load_gpu_module("");
    const uint32_t count = module.count_cards(&why);
    if (count == 0) return why.text;
    GpuCard card;
    GpuMessage message;
    for (uint32_t i = 0; i < count; ++i) {
      const NifError code = module.describe_card(i, &card, &message);
      why = code == NIF_OK ? card.trouble : message;
      if (why.text[0] == 0) return "";
    }
  } catch (const std::exception& error) {
    set_text(why, error.what());
  }
  return why.text;
}

NifCardInfo describe_card(uint32_t card) {
  static thread_local GpuCard about;
  const GpuModule& module = load_gpu_module("");
  GpuMessage message;
  const uint32_t count = module.count_cards(&message);
  if (count == 0) throw Failure(NIF_ERROR_NOT_AVAILABLE, message.text);
  if (card >= count)
    refuse_argument("there is no card " + std::to_string(card) + " of " + std::to_string(count));
  if (const NifError code = module.describe_card(card, &about, &message); code != NIF_OK)
    throw Failure(code, message.text);
  return {0, about.name,        about.target, about.driver, about.memory, about.trouble.text[0] == 0,
          0, about.trouble.text};
}

}  // namespace nif::runtime
