// Rays of the host, and what it takes to have kernels of any encoding answer them in the emulator.
#pragma once

#include <algorithm>
#include <vector>

#include "kernels/hip/bvh_kernels.hpp"
#include "kernels/hip/emulator.hpp"
#include "kernels/hip/spherical_kernels.hpp"

namespace nif::test {

/// Rays as kernels take them, and their answers, which start as what no kernel writes.
class EmulatedBatch {
 public:
  explicit EmulatedBatch(const std::vector<kernels::Segment>& segments)
      : logit(segments.size(), kUnanswered), certain(segments.size(), 2) {
    for (int a = 0; a < 3; ++a)
      for (const kernels::Segment& s : segments) {
        origin_[a].push_back(s.origin[a]);
        direction_[a].push_back(s.direction[a]);
      }
    for (const kernels::Segment& s : segments) {
      tmin_.push_back(s.tmin);
      tmax_.push_back(s.tmax);
    }
  }

  static constexpr int32_t kUnanswered = 0x55555555;
  uint32_t count() const { return uint32_t(tmin_.size()); }
  kernels::hip::RayArrays rays() const {
    return {{origin_[0].data(), origin_[1].data(), origin_[2].data()},
            {direction_[0].data(), direction_[1].data(), direction_[2].data()},
            tmin_.data(),
            tmax_.data(),
            count()};
  }
  kernels::hip::AnswerArrays answers() { return {logit.data(), certain.data()}; }
  kernels::Segment segment(uint32_t i) const { return kernels::hip::load_ray(rays(), i); }

  std::vector<int32_t> logit;
  std::vector<uint8_t> certain;

 private:
  std::vector<float> origin_[3], direction_[3], tmin_, tmax_;
};

inline uint32_t blocks_for(uint32_t count, uint32_t threads = kernels::hip::kBlockThreads) {
  return (count + threads - 1) / threads;
}

/// What a launch is made with, besides its kernel.
struct EmulatedLaunch {
  uint64_t order = 0;
  uint32_t most_blocks = 3;  ///< of kernels that take any number: so that threads go round
};

inline kernels::hip::EmulatedGrid grid_for(uint32_t blocks, uint32_t shared_bytes, uint32_t wave,
                                           uint64_t order, uint32_t threads = kernels::hip::kBlockThreads) {
  return {.blocks = blocks, .threads = threads, .shared_bytes = shared_bytes, .wave = wave, .order = order};
}

/// Answers a batch for a `bvh` object.
inline void answer_bvh(const kernels::BvhField& field, EmulatedBatch& batch, uint32_t wave = 32,
                       const EmulatedLaunch& launch = {}) {
  namespace hip = kernels::hip;
  const uint32_t blocks = std::min(launch.most_blocks, blocks_for(batch.count(), hip::kBvhThreads));
  hip::emulate(grid_for(blocks, hip::kBvhSharedBytes, wave, launch.order, hip::kBvhThreads),
               [&](const hip::EmulatedThread& thread) {
                 hip::bvh_answer(thread, field, batch.rays(), {}, batch.answers());
               });
}

/// Answers a batch for a `spherical` object; the layout must fit.
inline void answer_spherical(const kernels::SphericalField& field, EmulatedBatch& batch, uint32_t wave = 32,
                             const EmulatedLaunch& launch = {}) {
  namespace hip = kernels::hip;
  const hip::SphericalLayout layout = hip::make_layout(field);
  const uint32_t blocks = std::min(launch.most_blocks, blocks_for(batch.count(), hip::kSphericalThreads));
  hip::emulate(grid_for(blocks, layout.bytes, wave, launch.order, hip::kSphericalThreads),
               [&](const hip::EmulatedThread& thread) {
                 hip::spherical_answer(thread, field, layout, batch.rays(), {}, batch.answers());
               });
}

}  // namespace nif::test
