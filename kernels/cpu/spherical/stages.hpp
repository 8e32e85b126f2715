// Where the time of a `spherical` field goes, by the paper's breakdown (section on performance).
#pragma once

#include <array>
#include <cstddef>

#include "kernels/reference/object_kernel.hpp"
#include "kernels/reference/spherical/field.hpp"

namespace nif::kernels::cpu {

enum class SphericalStage : uint8_t {
  ray_cast,  ///< against the AABB, with the coordinates of what meets it
  outer_grids,
  outer_network,
  inner_grids,
  inner_network,
};
inline constexpr size_t kSphericalStages = 5;
/// [stage]: seconds.
using StageSeconds = std::array<double, kSphericalStages>;

/// Answers a batch of at most kBatchRays as the runtime's kernel does with this machine's best instruction
/// set, and adds the time of each stage to `seconds`; reading the clock is some hundredths of it. Weights
/// must be single (kernels/cpu/spherical/single_weights.hpp), `scratch` kKernelScratchBytes, aligned to 64.
/// False where the machine has no such instructions, and nothing was answered.
bool time_spherical(const SphericalField& field, const SegmentBatch& batch, AnswerBatch& answers,
                    void* scratch, StageSeconds& seconds);

}  // namespace nif::kernels::cpu
