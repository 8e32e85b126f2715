// Measures where the time of a `spherical` field goes, by the paper's breakdown (section on performance).
#pragma once

#include <array>
#include <cstddef>

#include "kernels/reference/object_kernel.hpp"
#include "kernels/reference/spherical/spherical_field.hpp"

namespace nif::kernels::cpu {

enum class SphericalStage : uint8_t {
  ray_cast,  ///< against the AABB, with the coordinates of the rays that meet it
  outer_grids,
  outer_network,
  inner_grids,
  inner_network,
};
inline constexpr size_t kSphericalStages = 5;
/// [stage]: seconds.
using StageSeconds = std::array<double, kSphericalStages>;

/// Answers a batch of at most kBatchRays like the runtime's kernel with this machine's best instruction set,
/// and adds the time of each stage to `seconds`; reading the clock takes a few hundredths of it. Weights must
/// be single (kernels/cpu/spherical/single_weights.hpp), `scratch` kKernelScratchBytes, aligned to 64.
/// Returns false, without an answer, if the machine has no such instructions.
bool time_spherical(const SphericalField& field, const SegmentBatch& batch, AnswerBatch& answers,
                    void* scratch, StageSeconds& seconds);

}  // namespace nif::kernels::cpu
