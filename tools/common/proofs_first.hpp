// Answers queries with proofs first, and with an Embree BVH for the rays that they leave open.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "bake/ground_truth/embree_baseline.hpp"
#include "bake/ground_truth/evaluate.hpp"
#include "nif/nif.h"

namespace nif::tools {

/// Memory for such queries, for as many rays as the first query had. Not thread-safe.
class ProofsFirst {
 public:
  /// Answers rays, which `segments` are, too; answers.visible must be set. Returns how many Embree was asked
  /// about.
  size_t ask(NifScene scene, const NifRays& rays, NifAnswers answers,
             std::span<const kernels::Segment> segments, const bake::EmbreeScene& embree,
             bake::EmbreeCall call);

 private:
  std::vector<uint32_t> rays_;
  std::vector<float> tmin_, tmax_;
};

/// Answers this way; the proven rays are certain. Both scenes must outlive the answerer.
bake::Answerer proofs_first_answerer(NifScene scene, const bake::EmbreeScene& embree);

}  // namespace nif::tools
