// Calls nifQueryOpen in an emulated GPU's memory.
#pragma once

#include "tests/gpu/module_fixture.hpp"
#include "tests/runtime/open_answers.hpp"

namespace nif::test {

/// Lists and outputs at odd addresses, except the count.
class GpuOpenQuery {
 public:
  GpuOpenQuery(EmulatedMachine& machine, uint32_t gpu, const std::vector<NifRay>& rays, size_t capacity)
      : capacity_(capacity),
        rays_(machine, gpu, rays.data(), rays.size() * sizeof(NifRay)),
        answers_(machine, gpu, rays.size()),
        numbers_(machine, gpu, nullptr, 4 * capacity),
        tmin_(machine, gpu, nullptr, 4 * capacity),
        tmax_(machine, gpu, nullptr, 4 * capacity),
        count_(machine, gpu, nullptr, 4),
        instances_(machine, gpu, nullptr, 4 * capacity),
        query(nifMakeRays(rays_.as<NifRay>(), rays.size())),
        outputs(answers_.outputs()),
        open(nifkit::sized<NifOpenRays>()) {
    query.memory = NIF_MEMORY_DEVICE;
    open.capacity = capacity;
    open.rays = reinterpret_cast<uint32_t*>(numbers_.as<char>() + 1);
    open.tmin = reinterpret_cast<float*>(tmin_.as<char>() + 1);
    open.tmax = reinterpret_cast<float*>(tmax_.as<char>() + 1);
    open.count = count_.as<uint32_t>();
    open.instance = reinterpret_cast<uint32_t*>(instances_.as<char>() + 1);
  }

  /// Call it after the stream has executed the query.
  OpenAnswers get() const {
    OpenAnswers answers(query.count);
    static_cast<Answers&>(answers) = answers_.get();
    answers.count = *open.count;
    for (size_t k = 0; k < std::min<size_t>(capacity_, answers.count); ++k) {
      OpenRay ray;
      std::memcpy(&ray.ray, open.rays + k, 4);
      std::memcpy(&ray.tmin, open.tmin + k, 4);
      std::memcpy(&ray.tmax, open.tmax + k, 4);
      answers.open.push_back(ray);
    }
    std::sort(answers.open.begin(), answers.open.end());
    return answers;
  }
  /// Of each ray the instance that the list names; of others 0xcccccccc.
  std::vector<uint32_t> instances() const {
    std::vector<uint32_t> of_rays(query.count, 0xcccccccc);
    for (size_t k = 0; k < std::min<size_t>(capacity_, *open.count); ++k) {
      uint32_t ray;
      std::memcpy(&ray, open.rays + k, 4);
      std::memcpy(&of_rays.at(ray), open.instance + k, 4);
    }
    return of_rays;
  }

 private:
  size_t capacity_;
  GpuArray rays_;
  GpuAnswerArrays answers_;
  GpuArray numbers_, tmin_, tmax_, count_, instances_;

 public:
  NifRays query;
  NifAnswers outputs;
  NifOpenRays open;
};

inline OpenAnswers query_open_on_gpu(EmulatedMachine& machine, uint32_t gpu, NifScene scene,
                                     const std::vector<NifRay>& rays, size_t capacity) {
  GpuOpenQuery on_gpu(machine, gpu, rays, capacity);
  void* stream = on_gpu.query.stream = machine.make_stream(gpu);
  EXPECT_EQ(nifQueryOpen(scene, &on_gpu.query, &on_gpu.outputs, &on_gpu.open), NIF_OK)
      << nifGetErrorMessage();
  EXPECT_EQ(*on_gpu.open.count, 0xa5a5a5a5) << "nothing is done before the stream is waited for";
  machine.wait_stream(stream);
  machine.free_stream(stream);
  return on_gpu.get();
}

}  // namespace nif::test
