// Rays of the named sets, answered by the emulated kernels in half precision, and how far that is from the
// reference in single precision.
#pragma once

#include <span>
#include <vector>

#include "tests/gpu/object_on_gpu.hpp"

namespace nif::test {

/// Counts of rays, and what happened to the probabilities of those that a network was asked about.
struct HalfComparison {
  uint64_t asked = 0;      ///< left to a network
  uint64_t different = 0;  ///< visible in one precision and occluded in the other
  uint64_t beyond = 0;     ///< farther off than half_bound() allows, or with another certain answer: 0
  uint64_t wrong_single = 0, wrong_half = 0;  ///< other than `visible` says
  double mean_moved = 0, most_moved = 0;      ///< of probabilities
  double most_log_odds = 0;                   ///< moved
};

/// Instructions that differ in half precision.
inline constexpr MatrixKind kHalfKinds[] = {MatrixKind::dot32, MatrixKind::wmma, MatrixKind::mfma32,
                                            MatrixKind::imma};

/// One comparison for each kind. In parallel. `visible` is the truth, a byte a ray. The same for any number
/// of threads. make_half_layout() of the object fits.
std::vector<HalfComparison> compare_half(const kernels::SphericalField& field,
                                         std::span<const kernels::Segment> segments,
                                         std::span<const uint8_t> visible, std::span<const MatrixKind> kinds);

}  // namespace nif::test
