// Calls nifIntersect in an emulated GPU's memory.
#pragma once

#include "tests/gpu/module_fixture.hpp"
#include "tests/runtime/runtime_first_hits.hpp"

namespace nif::test {

/// All outputs, at odd addresses. Members of the structure may be set to null before it is asked.
class GpuHitQuery {
 public:
  GpuHitQuery(EmulatedMachine& machine, uint32_t gpu, const std::vector<NifRay>& rays)
      : rays_(machine, gpu, rays.data(), rays.size() * sizeof(NifRay)),
        query(nifMakeRays(rays_.as<NifRay>(), rays.size())),
        hits(nifkit::sized<NifHits>()) {
    query.memory = NIF_MEMORY_DEVICE;
    const auto place = [&](auto*& member, size_t each) {
      arrays_.emplace_back(machine, gpu, nullptr, each * sizeof(*member) * rays.size());
      member = reinterpret_cast<std::remove_reference_t<decltype(member)>>(arrays_.back().as<char>() + 1);
    };
    place(hits.hit, 1), place(hits.certain, 1);
    place(hits.t, 1), place(hits.t_low, 1), place(hits.t_high, 1), place(hits.normal, 3);
    place(hits.u, 1), place(hits.v, 1);
    place(hits.instance, 1), place(hits.object, 1), place(hits.triangle, 1), place(hits.color, 3);
    place(hits.user, 1);
  }

  /// Call it after the stream has executed the query.
  FirstHits get() const {
    FirstHits found(query.count);
    const auto copy = [](auto& to, const auto* from) {
      if (from) std::memcpy(to.data(), from, to.size() * sizeof(to[0]));
    };
    copy(found.hit, hits.hit), copy(found.certain, hits.certain);
    copy(found.t, hits.t), copy(found.low, hits.t_low), copy(found.high, hits.t_high);
    copy(found.normal, hits.normal), copy(found.u, hits.u), copy(found.v, hits.v);
    copy(found.instance, hits.instance), copy(found.object, hits.object);
    copy(found.triangle, hits.triangle), copy(found.color, hits.color), copy(found.user, hits.user);
    return found;
  }

 private:
  GpuArray rays_;
  std::vector<GpuArray> arrays_;

 public:
  NifRays query;
  NifHits hits;
};

inline FirstHits intersect_on_gpu(EmulatedMachine& machine, uint32_t gpu, NifScene scene,
                                  const std::vector<NifRay>& rays) {
  GpuHitQuery on_gpu(machine, gpu, rays);
  void* stream = on_gpu.query.stream = machine.make_stream(gpu);
  EXPECT_EQ(nifIntersect(scene, &on_gpu.query, &on_gpu.hits), NIF_OK) << nifGetErrorMessage();
  EXPECT_EQ(rays.empty() ? 0xa5 : on_gpu.hits.hit[0], 0xa5)
      << "nothing is done before the stream is waited for";
  machine.wait_stream(stream);
  machine.free_stream(stream);
  return on_gpu.get();
}

}  // namespace nif::test
