// The `spherical` kernels in half precision, run by the emulator on rays of the host.
#pragma once

#include "kernels/hip/spherical_half_kernels.hpp"
#include "tests/gpu/emulated.hpp"

namespace nif::test {

/// The matrix instructions that spherical_half() can be made with, and the waves that go with them.
enum class HalfKind { dot32, dot64, wmma, mfma, mma };
inline constexpr HalfKind kHalfKinds[] = {HalfKind::dot32, HalfKind::dot64, HalfKind::wmma, HalfKind::mfma,
                                          HalfKind::mma};
constexpr const char* name_of(HalfKind kind) {
  constexpr const char* kNames[] = {"dot32", "dot64", "wmma", "mfma", "mma"};
  return kNames[size_t(kind)];
}
constexpr uint32_t wave_of(HalfKind kind) {
  return kind == HalfKind::dot64 || kind == HalfKind::mfma ? 64 : 32;
}

template <class Matrix, kernels::SphericalKind kKind, uint32_t kTiles>
void emulate_half(const kernels::SphericalField& field, EmulatedBatch& batch,
                  const kernels::hip::SphericalItems& items, uint32_t wave, const EmulatedLaunch& launch) {
  namespace hip = kernels::hip;
  const hip::SphericalHalfLayout layout = hip::make_half_layout(field);
  const uint32_t blocks = std::min(launch.most_blocks, blocks_for(batch.count(), hip::kHalfThreads));
  hip::emulate(grid_for(blocks, layout.bytes, wave, launch.order, hip::kHalfThreads),
               [&](const hip::EmulatedThread& thread) {
                 hip::spherical_half<Matrix, kKind, kTiles>(thread, field, layout, items, batch.answers());
               });
}

template <class Matrix>
void emulate_half(const kernels::SphericalField& field, EmulatedBatch& batch,
                  const kernels::hip::SphericalItems& items, uint32_t wave, const EmulatedLaunch& launch) {
  using enum kernels::SphericalKind;
  constexpr uint32_t kFew = kernels::hip::kHalfTiles, kMost = kernels::hip::kMostHalfTiles;
  if (kernels::hip::make_half_layout(field).tiles == kFew) {
    emulate_half<Matrix, outer, kFew>(field, batch, items, wave, launch);
    emulate_half<Matrix, inner, kFew>(field, batch, items, wave, launch);
  } else {
    emulate_half<Matrix, outer, kMost>(field, batch, items, wave, launch);
    emulate_half<Matrix, inner, kMost>(field, batch, items, wave, launch);
  }
}

/// How many rays were left to each of an object's fields.
struct HalfCounts {
  uint32_t outer, inner;
};

/// Answers a batch by the cast and both networks; the layout must fit.
inline HalfCounts answer_spherical_half(const kernels::SphericalField& field, EmulatedBatch& batch,
                                        HalfKind kind, const EmulatedLaunch& launch = {}) {
  namespace hip = kernels::hip;
  const uint32_t capacity = batch.count(), wave = wave_of(kind);
  HalfCounts counts{};
  std::vector<uint32_t> ray(capacity);
  std::vector<float> coordinates(size_t(capacity) * hip::kItemCoordinates);
  const hip::SphericalItems items{&counts.outer, &counts.inner, ray.data(), coordinates.data(), capacity};
  hip::emulate(grid_for(blocks_for(capacity), 0, wave, launch.order), [&](const hip::EmulatedThread& thread) {
    hip::spherical_cast(thread, field, batch.rays(), items, batch.answers());
  });
  switch (kind) {
    case HalfKind::dot32:
    case HalfKind::dot64:
      emulate_half<hip::DotHalfMatrix>(field, batch, items, wave, launch);
      break;
    case HalfKind::wmma:
      emulate_half<hip::WmmaHalfMatrix>(field, batch, items, wave, launch);
      break;
    case HalfKind::mfma:
      emulate_half<hip::MfmaHalfMatrix>(field, batch, items, wave, launch);
      break;
    case HalfKind::mma:
      emulate_half<hip::MmaHalfMatrix>(field, batch, items, wave, launch);
      break;
  }
  return counts;
}

}  // namespace nif::test
