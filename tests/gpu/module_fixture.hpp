// The fixture of the GPU module's tests: the runtime with an emulated GPU, and the CPU to compare with.
#pragma once

#include <gtest/gtest.h>
#include <nif/nif.hpp>

#include <cstring>
#include <memory>

#include "tests/gpu/emulator/machine.hpp"
#include "tests/runtime/runtime_fixture.hpp"
#include "tests/support/plain_scene.hpp"

namespace nif::test {

/// The CPU and one of the emulated GPUs, each with the same asset.
class GpuModuleTest : public testing::Test {
 protected:
  void SetUp() override {
    EmulatedMachine& machine = this->machine();
    machine.no_driver = machine.driver_too_old = machine.no_image = machine.no_place = machine.lost = false;
    machine.gpus = uint32_t(std::size(kMatrixKinds));
    machine.processors = 3;
    machine.seconds_of_one_kernel = 0;
    machine.fail_allocation = machine.fail_launch = machine.fail_asking = machine.fail_record = 0;
    machine.most_rays = 1u << 20;
    machine.order = 0;
  }
  /// Has a device freed everything that it allocated?
  void TearDown() override {
    machine().seconds_of_one_kernel = 0;
    EXPECT_EQ(machine().allocations, 0u);
    EXPECT_EQ(machine().events, 0u);
    EXPECT_EQ(machine().streams, 0u);
  }

  static EmulatedMachine& machine() { return emulated_machine(NIF_EMULATED_MODULE); }
  static std::string config(uint32_t gpu = 0) {
    return std::string("isa=scalar,backend=gpu,module=" NIF_EMULATED_MODULE ",device=") + std::to_string(gpu);
  }
};

/// GPU memory with a copy of some host memory.
class GpuArray {
 public:
  GpuArray(EmulatedMachine& machine, uint32_t gpu, const void* from, size_t bytes)
      : machine_(machine), memory_(static_cast<char*>(machine.allocate(gpu, bytes + 1))) {
    if (from) std::memcpy(memory_, from, bytes);
  }
  GpuArray(GpuArray&& other) noexcept
      : machine_(other.machine_), memory_(std::exchange(other.memory_, nullptr)) {}
  ~GpuArray() {
    if (memory_) machine_.free(memory_);
  }
  template <class T>
  T* as() const {
    return reinterpret_cast<T*>(memory_);
  }

 private:
  EmulatedMachine& machine_;
  char* memory_;
};

/// Outputs in GPU memory, at odd addresses.
class GpuAnswerArrays {
 public:
  GpuAnswerArrays(EmulatedMachine& machine, uint32_t gpu, size_t count)
      : count_(count),
        visible_(machine, gpu, nullptr, count),
        bits_(machine, gpu, nullptr, count / 8 + 1),
        certain_(machine, gpu, nullptr, count),
        probability_(machine, gpu, nullptr, 4 * count),
        logit_(machine, gpu, nullptr, 4 * count) {}
  NifAnswers outputs() const {
    auto outputs = nifkit::sized<NifAnswers>();
    outputs.visible = visible_.as<uint8_t>() + 1;
    outputs.visible_bits = bits_.as<uint8_t>() + 1;
    outputs.certain = certain_.as<uint8_t>() + 1;
    outputs.probability = reinterpret_cast<float*>(probability_.as<char>() + 1);
    outputs.logit = reinterpret_cast<int32_t*>(logit_.as<char>() + 1);
    return outputs;
  }
  /// Has nothing been written yet?
  bool untouched() const {
    for (size_t i = 0; i < count_; ++i)
      if (visible_.as<uint8_t>()[i + 1] != 0xa5 || certain_.as<uint8_t>()[i + 1] != 0xa5) return false;
    return true;
  }
  Answers get() const {
    Answers answers(count_);
    std::memcpy(answers.visible.data(), visible_.as<uint8_t>() + 1, count_);
    std::memcpy(answers.bits.data(), bits_.as<uint8_t>() + 1, answers.bits.size());
    std::memcpy(answers.certain.data(), certain_.as<uint8_t>() + 1, count_);
    std::memcpy(answers.probability.data(), probability_.as<char>() + 1, 4 * count_);
    std::memcpy(answers.logit.data(), logit_.as<char>() + 1, 4 * count_);
    return answers;
  }

 private:
  size_t count_;
  GpuArray visible_, bits_, certain_, probability_, logit_;
};

/// A query for rays in GPU memory.
class GpuQuery {
 public:
  GpuQuery(EmulatedMachine& machine, uint32_t gpu, const std::vector<NifRay>& rays)
      : rays_(machine, gpu, rays.data(), rays.size() * sizeof(NifRay)),
        answers(machine, gpu, rays.size()),
        query(nifMakeRays(rays_.as<NifRay>(), rays.size())),
        outputs(answers.outputs()) {
    query.memory = NIF_MEMORY_DEVICE;
  }

 private:
  GpuArray rays_;

 public:
  GpuAnswerArrays answers;
  NifRays query;
  NifAnswers outputs;
};

/// All bits are equal, except the last ones of probabilities that are neither 0 nor 1.
inline void expect_same(const Answers& got, const Answers& expected) {
  EXPECT_EQ(got.visible, expected.visible);
  EXPECT_EQ(got.bits, expected.bits);
  EXPECT_EQ(got.certain, expected.certain);
  EXPECT_EQ(got.logit, expected.logit);
  ASSERT_EQ(got.probability.size(), expected.probability.size());
  for (size_t i = 0; i < got.probability.size(); ++i) {
    const float p = got.probability[i], q = expected.probability[i];
    if (q == 0 || q == 1)
      ASSERT_NEAR(p, q, q == 0 ? 0 : 6e-8) << i;
    else
      ASSERT_NEAR(p / q, 1, 3e-7) << i;
  }
}

/// Only visibility, which other kernels and loops answer than all outputs.
inline void query_visible(NifScene scene, const std::vector<NifRay>& rays, std::vector<uint8_t>& visible) {
  nifkit::check(
      nifQuery(scene, &nifkit::Rays(rays).get(), &nifkit::Answers().visible(visible).get(rays.size())));
}
inline void query_visible_bits(NifScene scene, const std::vector<NifRay>& rays, std::vector<uint8_t>& bits) {
  nifkit::check(
      nifQuery(scene, &nifkit::Rays(rays).get(), &nifkit::Answers().visible_bits(bits).get(rays.size())));
}
/// What is visible, of a ray alone.
inline uint8_t query_alone(NifScene scene, const NifRay& ray) {
  uint8_t visible = 9;
  auto outputs = nifkit::sized<NifAnswers>();
  outputs.visible = &visible;
  nifkit::check(nifQueryRay(scene, &ray, &outputs));
  return visible;
}

/// The same scene twice: on the CPU and on a GPU.
class TwinScenes {
 public:
  explicit TwinScenes(const std::string& gpu_config)
      : cpu_device_("isa=scalar"), gpu_device_(gpu_config), cpu_(cpu_device_), gpu_(gpu_device_) {}

  uint32_t load(const format::Asset& asset) { return load(format::encode(asset)); }
  uint32_t load(std::vector<std::byte> file) {
    files_.push_back(std::move(file));
    cpu_assets_.push_back(nifkit::Asset::load(cpu_device_, files_.back()));
    gpu_assets_.push_back(nifkit::Asset::load(gpu_device_, files_.back()));
    return uint32_t(files_.size() - 1);
  }
  void add(uint32_t asset, uint32_t object, const Matrix& transform) {
    cpu_.add_instance(cpu_assets_[asset], object, transform);
    gpu_.add_instance(gpu_assets_[asset], object, transform);
  }
  void move(uint32_t instance, const Matrix& transform) {
    cpu_.set_instance_transform(instance, transform);
    gpu_.set_instance_transform(instance, transform);
  }
  /// Makes the same changes to both.
  template <class Change>
  void both(const Change& change) {
    change(cpu_);
    change(gpu_);
  }
  /// Releases the caller's reference to an asset; the scenes keep theirs.
  void forget(uint32_t asset) {
    cpu_assets_[asset] = {};
    gpu_assets_[asset] = {};
  }
  void commit() {
    cpu_.commit();
    gpu_.commit();
  }

  const nifkit::Scene& cpu_scene() const { return cpu_; }
  nifkit::Scene& gpu_scene() { return gpu_; }
  NifScene cpu() const { return cpu_.get(); }
  NifScene gpu() const { return gpu_.get(); }
  const nifkit::Device& gpu_device() const { return gpu_device_; }
  const nifkit::Asset& gpu_asset(uint32_t asset) const { return gpu_assets_[asset]; }
  /// How many objects the asset has.
  uint32_t objects(uint32_t asset) const { return gpu_assets_[asset].info().object_count; }

 private:
  nifkit::Device cpu_device_, gpu_device_;
  nifkit::Scene cpu_, gpu_;
  std::vector<std::vector<std::byte>> files_;
  std::vector<nifkit::Asset> cpu_assets_, gpu_assets_;
};

}  // namespace nif::test
