// Answers queries with proofs first, and with an Embree BVH for the rays that they leave open.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "bake/oracle/embree_baseline.hpp"
#include "bake/oracle/evaluate.hpp"
#include "nif/nif.h"

namespace nif::tools {

/// Memory for such queries, for as many rays as the first query had. Not thread-safe.
class ProofsFirst {
 public:
  /// Answers a query; `query` has the rays and all outputs but `visible`. Returns the number of rays that
  /// Embree traced.
  size_t ask(NifScene scene, NifQuery query, std::span<const kernels::Segment> segments,
             const bake::EmbreeScene& embree, bake::EmbreeCall call, uint8_t* visible);

 private:
  std::vector<uint32_t> rays_;
  std::vector<float> tmin_, tmax_;
};

/// Answers this way; the proven rays are certain. Both scenes must outlive the answerer.
bake::Answerer proofs_first_answerer(NifScene scene, const bake::EmbreeScene& embree);

}  // namespace nif::tools
