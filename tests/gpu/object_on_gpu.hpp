// One object on an emulated GPU, without a file, a scene or the runtime: for tests of the kernels, by the
// GPU module's own table of functions.
#pragma once

#include <gtest/gtest.h>

#include <stdexcept>
#include <vector>

#include "formats/nif/reader.hpp"
#include "runtime/src/gpu/module.hpp"
#include "tests/gpu/emulator/machine.hpp"

namespace nif::test {

/// A way in which a GPU can answer, with its precision.
struct EmulatedWay {
  MatrixKind kind = MatrixKind::wmma;
  runtime::GpuWay way = runtime::GpuWay::pipeline;
  bool half = false;

  std::string name() const {
    return (way == runtime::GpuWay::one_kernel ? "one_kernel_" : "pipeline_") + std::string(name_of(kind));
  }
};
/// The pipeline by each kind of matrix instruction, and the one kernel in waves of 32 and of 64.
inline std::vector<EmulatedWay> all_ways() {
  std::vector<EmulatedWay> ways;
  for (const MatrixKind kind : kMatrixKinds) ways.push_back({kind});
  ways.push_back({MatrixKind::dot32, runtime::GpuWay::one_kernel});
  ways.push_back({MatrixKind::dot64, runtime::GpuWay::one_kernel});
  return ways;
}

/// Of rays: [count] each.
struct ObjectAnswers {
  std::vector<int32_t> logit;
  std::vector<uint8_t> certain;
};

/// Several threads may query it at the same time.
class ObjectOnGpu {
 public:
  ObjectOnGpu(const kernels::AnyField& object, const EmulatedWay& way) : module_(load()) {
    runtime::GpuMessage message;
    const auto check = [&](NifError error) {
      if (error != NIF_OK) throw std::runtime_error(message.text);
    };
    const runtime::GpuSettings settings{way.way, way.half};
    check(module_.open_device(uint32_t(way.kind), &settings, &device_, &message));
    uint64_t bytes = 0;
    check(module_.upload_asset(device_, &object, nullptr, 1, &asset_, &bytes, &message));
    kernels::PlacedInstance instance{};
    instance.identity = 1;
    instance.mask = 0xffffffffu;
    const runtime::GpuPlacedObject placed{asset_, 0, 0};
    const runtime::GpuSceneView scene{nullptr, &instance, nullptr, &placed, 0, 1, 1, 0};
    check(module_.upload_scene(device_, &scene, &scene_, &message));
  }
  ~ObjectOnGpu() {
    module_.free_scene(device_, scene_);
    module_.free_asset(device_, asset_);
    module_.close_device(device_);
  }
  ObjectOnGpu(const ObjectOnGpu&) = delete;
  ObjectOnGpu& operator=(const ObjectOnGpu&) = delete;

  ObjectAnswers ask(std::span<const kernels::Segment> segments) const {
    constexpr int32_t kUnanswered = 0x55555555;
    ObjectAnswers answers{std::vector<int32_t>(segments.size(), kUnanswered),
                          std::vector<uint8_t>(segments.size(), 2)};
    if (segments.empty()) return answers;
    const kernels::Segment& first = segments[0];
    NifRays query{};
    query.struct_size = sizeof(query);
    query.count = segments.size();
    for (int a = 0; a < 3; ++a) {
      query.origin[a] = &first.origin[a];
      query.direction[a] = &first.direction[a];
    }
    query.tmin = &first.tmin;
    query.tmax = &first.tmax;
    query.origin_stride = query.direction_stride = query.tmin_stride = query.tmax_stride =
        sizeof(kernels::Segment);
    NifAnswers outputs{};
    outputs.struct_size = sizeof(outputs);
    outputs.logit = answers.logit.data();
    outputs.certain = answers.certain.data();
    runtime::GpuMessage message;
    if (module_.query(device_, scene_, &query, &outputs, &message) != NIF_OK)
      throw std::runtime_error(message.text);
    return answers;
  }

 private:
  static const runtime::GpuModule& load() {
    void* library = dlopen(NIF_EMULATED_MODULE, RTLD_NOW | RTLD_LOCAL);
    if (!library) throw std::runtime_error(dlerror());
    using Entry = const runtime::GpuModule* (*)();
    return *reinterpret_cast<Entry>(dlsym(library, runtime::kGpuModuleSymbol))();
  }

  const runtime::GpuModule& module_;
  runtime::GpuDevice* device_ = nullptr;
  runtime::GpuAsset* asset_ = nullptr;
  runtime::GpuScene* scene_ = nullptr;
};

}  // namespace nif::test
