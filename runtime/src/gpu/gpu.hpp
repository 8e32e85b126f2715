// The GPU backend as the rest of the runtime sees it: the module, and one card that it has opened. All else
// of it lies in the module (runtime/gpu), behind module.hpp.
#pragma once

#include <atomic>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>

#include "gpu/module.hpp"
#include "nif/nif.h"

struct NifAssetObject;
struct NifJobObject;
struct NifSceneObject;

namespace nif::runtime {

struct Request;

/// A card in use by a device.
class Gpu {
 public:
  /// `module`: its file, or "" for the usual places. `backend`: "gpu", or "cuda" or "hip", which the card must
  /// then be of. No card: the first one of the backend. Throws Failure that says what is missing.
  Gpu(std::string_view module, std::string_view backend, std::optional<uint32_t> card,
      const GpuSettings& settings);
  Gpu(const Gpu&) = delete;
  Gpu& operator=(const Gpu&) = delete;
  /// Nothing may be left on the card.
  ~Gpu() { module_.close_device(device_); }

  const GpuCard& card() const { return card_; }
  /// Once a call has found that the card is lost. The CPU then answers what it can.
  bool lost() const { return lost_; }

  // On the card. They throw Failure; what is not there is not freed.
  void upload(NifAssetObject& asset);
  void upload(NifSceneObject& scene);
  void free(NifAssetObject& asset) noexcept;
  void free(NifSceneObject& scene) noexcept;
  void query(NifSceneObject& scene, const NifRays& rays, const NifAnswers& answers);
  void query_open(NifSceneObject& scene, const NifRays& rays, const NifAnswers& answers,
                  const NifOpenRays& open);
  void intersect(NifSceneObject& scene, const NifRays& rays, const NifHits& hits);
  void measure(NifSceneObject& scene, const NifRays& rays, const NifAnswers& answers, GpuMeasure measure,
               uint32_t rounds, double* seconds);

  /// Of device memory. The job is not done before wait() or is_done() has said so.
  void start(NifSceneObject& scene, const Request& request, NifJobObject& job);
  void wait(NifJobObject& job);
  void poll(NifJobObject& job);
  /// After this the job is done as far as the runtime goes; the card may still be at it.
  void let_go(NifJobObject& job) noexcept;

 private:
  void check(NifError code, const GpuMessage& message);

  const GpuModule& module_;
  GpuDevice* device_ = nullptr;
  GpuCard card_{};
  std::atomic<bool> lost_ = false;
  std::mutex uploads_;  ///< of assets
};

/// Why there is no card of a backend ("cuda" or "hip"), as one sentence; "" if a card can be used. Looks anew
/// each time. Stays until the next call on this thread.
const char* why_no_gpu(std::string_view backend);

/// Throws Failure beyond the last card.
NifCardInfo describe_card(uint32_t card);

}  // namespace nif::runtime
