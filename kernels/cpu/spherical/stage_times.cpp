// Times the stages of the runtime's `spherical` kernel (answer-inl.hpp) with a clock that is read after each
// stage. Not part of the runtime: only `nif bench --stages` links it.
#include "kernels/cpu/spherical/stage_times.hpp"

#include <chrono>

#include "kernels/cpu/targets.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/cpu/spherical/stage_times.cpp"
#include <hwy/foreach_target.h>  // must come before highway.h

#include <hwy/highway.h>

#if HWY_TARGET == HWY_SCALAR
namespace nif::kernels::cpu::HWY_NAMESPACE {
bool TimeSpherical(const SphericalField&, const SegmentBatch&, AnswerBatch&, void*, StageSeconds&) {
  return false;
}
}  // namespace nif::kernels::cpu::HWY_NAMESPACE
#else
#include "kernels/cpu/spherical/answer-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace nif::kernels::cpu::HWY_NAMESPACE {

class StageClock {
 public:
  explicit StageClock(StageSeconds& seconds) : seconds_(seconds) {}
  void lap(SphericalStage stage) {
    const auto now = std::chrono::steady_clock::now();
    seconds_[size_t(stage)] += std::chrono::duration<double>(now - last_).count();
    last_ = now;
  }

 private:
  StageSeconds& seconds_;
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

bool TimeSpherical(const SphericalField& field, const SegmentBatch& batch, AnswerBatch& answers,
                   void* scratch, StageSeconds& seconds) {
  StageClock clock(seconds);
  answer_batch(field, batch, answers, scratch, clock);
  return true;
}

}  // namespace nif::kernels::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif  // HWY_TARGET

#if HWY_ONCE
namespace nif::kernels::cpu {

HWY_EXPORT(TimeSpherical);

bool time_spherical(const SphericalField& field, const SegmentBatch& batch, AnswerBatch& answers,
                    void* scratch, StageSeconds& seconds) {
  return HWY_DYNAMIC_DISPATCH(TimeSpherical)(field, batch, answers, scratch, seconds);
}

}  // namespace nif::kernels::cpu
#endif
