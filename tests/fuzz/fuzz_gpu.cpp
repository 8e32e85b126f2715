// Any bytes given to the runtime as an asset, and what is accepted put on an emulated GPU: packed, uploaded
// and asked by the GPU's own kernels, with the answers of the reference, bit by bit.
#include <nif/nif.h>

#include <algorithm>
#include <iterator>
#include <memory>
#include <vector>

#include "formats/nif/crc32c.hpp"
#include "formats/nif/reader.hpp"
#include "runtime/src/gpu/module.hpp"
#include "tests/fuzz/fuzz.hpp"
#include "tests/fuzz/object_rays.hpp"
#include "tests/gpu/emulator/machine.hpp"

// The module is linked in, so that it is instrumented like the rest.
extern "C" const nif::runtime::GpuModule* nif_gpu_module(void);
extern "C" nif::test::EmulatedMachine* nif_emulated_machine(void);

namespace {

using nif::test::must;
using namespace nif::runtime;
namespace kernels = nif::kernels;

constexpr uint32_t kRays = 40, kMostObjects = 3;

/// GPU memory, allocated by the emulator so that the sanitizer knows its bounds.
class OnGpu {
 public:
  OnGpu(uint32_t gpu, const void* from, size_t bytes)
      : memory_(nif_emulated_machine()->allocate(gpu, bytes)) {
    if (from) std::memcpy(memory_, from, bytes);
  }
  ~OnGpu() { nif_emulated_machine()->free(memory_); }
  OnGpu(const OnGpu&) = delete;
  OnGpu& operator=(const OnGpu&) = delete;
  template <class T>
  T* as() const {
    return static_cast<T*>(memory_);
  }

 private:
  void* memory_;
};

void must_succeed(NifError error, const GpuMessage& message) {
  if (error == NIF_OK) return;
  std::fprintf(stderr, "%s\n", message.text);
  must(false);
}

/// An object on one emulated GPU, with one untransformed instance.
class Gpu {
 public:
  Gpu(const kernels::AnyField& field, const kernels::HitDetails& details, uint32_t gpu, GpuWay way)
      : module_(*nif_gpu_module()), gpu_(gpu) {
    const GpuSettings settings{way, 0};
    must_succeed(module_.open_device(gpu, &settings, &device_, &message_), message_);
    uint64_t bytes = 0;
    must_succeed(module_.upload_asset(device_, &field, &details, 1, &asset_, &bytes, &message_), message_);
    kernels::PlacedInstance instance{};
    instance.identity = 1;
    instance.mask = 0xffffffffu;
    const GpuPlacedObject placed{asset_, 0, 0};
    const GpuSceneView scene{nullptr, &instance, nullptr, &placed, 0, 1, 1, 0};
    must_succeed(module_.upload_scene(device_, &scene, &scene_, &message_), message_);
  }
  ~Gpu() {
    module_.free_scene(device_, scene_);
    module_.free_asset(device_, asset_);
    module_.close_device(device_);
    must(nif_emulated_machine()->allocations == 0);
  }
  Gpu(const Gpu&) = delete;
  Gpu& operator=(const Gpu&) = delete;

  void compare_answers(const kernels::AnyField& field, const std::vector<NifRay>& rays) {
    std::vector<int32_t> logit(rays.size());
    std::vector<uint8_t> certain(rays.size());
    NifRays query = nifMakeRays(rays.data(), rays.size());
    NifAnswers outputs{};
    outputs.struct_size = sizeof(outputs);
    outputs.logit = logit.data();
    outputs.certain = certain.data();
    must_succeed(module_.query(device_, scene_, &query, &outputs, &message_), message_);
    // If planes contradict triangles, kernels may differ in which of them they use.
    if (std::holds_alternative<kernels::ExactField>(field)) return;
    for (size_t i = 0; i < rays.size(); ++i) {
      const kernels::Answer answer = kernels::query(field, nif::test::segment_of(rays[i]));
      must(logit[i] == answer.logit && certain[i] == uint8_t(answer.certain));
    }
  }

  /// Queries in GPU memory: first hits and open rays.
  void ask_for_more(const std::vector<NifRay>& rays) {
    const size_t count = rays.size();
    const OnGpu on_gpu(gpu_, rays.data(), count * sizeof(NifRay));
    NifRays query = nifMakeRays(on_gpu.as<NifRay>(), count);
    query.memory = NIF_MEMORY_DEVICE;
    query.stream = nif_emulated_machine()->make_stream(gpu_);
    const OnGpu hit(gpu_, nullptr, count), t(gpu_, nullptr, 4 * count), normal(gpu_, nullptr, 12 * count),
        triangle(gpu_, nullptr, 4 * count), color(gpu_, nullptr, 12 * count);
    NifHits hits{};
    hits.struct_size = sizeof(hits);
    hits.hit = hit.as<uint8_t>();
    hits.t = t.as<float>();
    hits.normal = normal.as<float>();
    hits.triangle = triangle.as<uint32_t>();
    hits.color = color.as<float>();
    must_succeed(module_.intersect(device_, scene_, &query, &hits, &message_), message_);
    const OnGpu list(gpu_, nullptr, 4 * count), open_count(gpu_, nullptr, 4);
    NifAnswers no_answers{};
    no_answers.struct_size = sizeof(no_answers);
    NifOpenRays open{};
    open.struct_size = sizeof(open);
    open.capacity = count;
    open.rays = list.as<uint32_t>();
    open.count = open_count.as<uint32_t>();
    must_succeed(module_.query_open(device_, scene_, &query, &no_answers, &open, &message_), message_);
    nif_emulated_machine()->wait_stream(query.stream);
    nif_emulated_machine()->free_stream(query.stream);
    must(*open.count <= count);
    for (uint32_t i = 0; i < *open.count; ++i) must(open.rays[i] < count);
    for (size_t i = 0; i < count; ++i) must(hits.hit[i] <= 1);
    for (size_t i = 0; i < 3 * count; ++i) must(hits.color[i] >= 0 && hits.color[i] <= 1);
  }

 private:
  const GpuModule& module_;
  uint32_t gpu_;
  GpuDevice* device_ = nullptr;
  GpuAsset* asset_ = nullptr;
  GpuScene* scene_ = nullptr;
  GpuMessage message_;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const auto bytes = std::as_bytes(std::span(data, size));
  std::vector<std::byte> file(bytes.begin(), bytes.end());
  try {
    const nif::format::AssetView view = nif::format::read_asset(file, "input");
    const uint32_t chance = nif::format::crc32c(file);
    for (uint32_t o = 0; o < std::min<size_t>(view.objects.size(), kMostObjects); ++o) {
      const nif::format::ObjectView& object = view.objects[o];
      if (object.unsupported) continue;
      const kernels::AnyField field = nif::format::field_of(object);
      const std::vector<NifRay> rays = nif::test::rays_about(object, kRays);
      // The kinds of matrix instructions and the one kernel take turns.
      const uint32_t turn = (chance + o) % 8;
      const uint32_t kinds = uint32_t(std::size(nif::test::kMatrixKinds));
      Gpu gpu(field, nif::format::hit_details(view, o), turn < kinds ? turn : turn - 2,
              turn < kinds ? GpuWay::pipeline : GpuWay::one_kernel);
      gpu.compare_answers(field, rays);
      gpu.ask_for_more(rays);
    }
  } catch (const nif::Error& error) {
    nif::test::must_refuse_well(error, "input");
  }
  return 0;
}
