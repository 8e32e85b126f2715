// Rays of the named sets, answered by the emulated kernels and by the reference.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "formats/nif/reader.hpp"
#include "tests/gpu/emulated_segment.hpp"

namespace nif::test {

/// A way in which the kernels can answer: by one kernel, or by the pipeline with one kind of matrix
/// instruction. Objects of the other encodings have one kernel, and only the size of waves to choose.
struct KernelVariant {
  bool whole;
  MatrixKind kind;

  std::string name() const { return whole ? "one kernel" : name_of(kind); }
};
std::vector<KernelVariant> all_variants();

/// Counts of rays.
struct Comparison {
  uint64_t different = 0;       ///< another logit, or certain in one and not in the other
  uint64_t open = 0, hard = 0;  ///< of the pipeline: left to its network, or to the one kernel
};

/// In parallel; each block of rays is emulated in an order of its own. The layout of a `spherical` object
/// fits.
Comparison compare(const format::ObjectView& object, std::span<const kernels::Segment> segments,
                   const KernelVariant& variant);

}  // namespace nif::test
