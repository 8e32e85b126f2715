// Calls nifIntersect for tests.
#pragma once

#include "tests/runtime/runtime_fixture.hpp"
#include "tests/support/test_first_hits.hpp"

namespace nif::test {

inline FirstHits intersect_all(NifScene scene, const std::vector<NifRay>& rays) {
  FirstHits hits(rays.size());
  const NifRays query = nifMakeRays(rays.data(), rays.size());
  const NifHits outputs = hits.outputs();
  EXPECT_EQ(nifIntersect(scene, &query, &outputs), NIF_OK) << nifGetErrorMessage();
  return hits;
}

}  // namespace nif::test
