// The GPU backend as the rest of the runtime sees it: the module, and one card that it has opened. All else
// of it lies in the module (runtime/gpu), behind module.hpp.
#pragma once

#include <atomic>
#include <mutex>
#include <string>
#include <string_view>

#include "gpu/module.hpp"
#include "nif/nif.h"

struct NifAssetObject;
struct NifJobObject;
struct NifSceneObject;

namespace nif::runtime {

/// A card in use by a device.
class Gpu {
 public:
  /// `module`: its file, or "" for the usual places. Throws Failure that says what is missing.
  Gpu(std::string_view module, uint32_t card, const GpuSettings& settings);
  Gpu(const Gpu&) = delete;
  Gpu& operator=(const Gpu&) = delete;
  /// Nothing may be left on the card.
  ~Gpu() { module_.close_device(device_); }

  const char* card_name() const { return card_.name; }
  /// Once a call has found that the card is lost. The CPU then answers what it can.
  bool lost() const { return lost_; }

  // On the card. They throw Failure; what is not there is not freed.
  void upload(NifAssetObject& asset);
  void upload(NifSceneObject& scene);
  void free(NifAssetObject& asset) noexcept;
  void free(NifSceneObject& scene) noexcept;
  void query(NifSceneObject& scene, const NifQuery& query);
  void query_open(NifSceneObject& scene, const NifQuery& query, const NifOpenRays& open);
  void intersect(NifSceneObject& scene, const NifQuery& query, const NifHits& hits);
  void measure(NifSceneObject& scene, const NifQuery& query, GpuMeasure measure, uint32_t rounds,
               double* seconds);

  /// Of device memory; `hits`: null, or where first hits go. The job is not done before wait() or is_done()
  /// has said so.
  void start(NifSceneObject& scene, const NifQuery& query, const NifHits* hits, NifJobObject& job);
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

/// Why there is no GPU backend, as one sentence; "" where a card can be used. Looks anew each time. Stays
/// until the next call on this thread.
const char* why_no_gpu();

/// Throws Failure beyond the last card.
NifCardInfo describe_card(uint32_t card);

}  // namespace nif::runtime
