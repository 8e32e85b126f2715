// Golden files: assets of every version of the format that was ever released, kept for good, each with rays
// and what was answered. v2-NAME.nif goes with v2-NAME.answers, an array of GoldenAnswer, and with
// v2-NAME.hits, an array of GoldenHit (docs/answers.md, "Golden answers").
#pragma once

#include <bit>
#include <cstdint>
#include <nif/nif.hpp>
#include <vector>

#include "kernels/reference/ray.hpp"
#include "tests/support/test_first_hits.hpp"

namespace nif::test {

/// The answer of an object, without an instance.
struct GoldenAnswer {
  uint32_t object;
  kernels::Segment ray;
  int32_t logit;
  uint8_t visible, certain;
  uint16_t zero;
};
static_assert(sizeof(GoldenAnswer) == 44);

/// The result of nifIntersect.
struct GoldenHit {
  uint32_t scene;  ///< an object of the asset alone, untransformed; kWholeAsset: all as the asset places it
  kernels::Segment ray;
  float t, t_low, t_high, normal[3];
  uint32_t instance, object, triangle;
  float u, v, color[3];
  uint8_t hit, certain;
  uint16_t zero;
};
static_assert(sizeof(GoldenHit) == 96);

inline constexpr uint32_t kWholeAsset = 0xffffffff;

inline NifRay to_nif_ray(const kernels::Segment& ray) {
  return {{ray.origin[0], ray.origin[1], ray.origin[2]},
          ray.tmin,
          {ray.direction[0], ray.direction[1], ray.direction[2]},
          ray.tmax};
}

/// The scene that a GoldenHit is about.
inline nifkit::Scene golden_scene(const nifkit::Device& device, const nifkit::Asset& asset, uint32_t scene) {
  nifkit::Scene made(device);
  if (scene == kWholeAsset)
    made.add_asset(asset);
  else
    made.add_instance(asset, scene);
  made.commit();
  return made;
}

/// The first hits of rays in one scene.
inline std::vector<GoldenHit> golden_hits(const nifkit::Scene& scene, uint32_t number,
                                          const std::vector<kernels::Segment>& segments) {
  std::vector<NifRay> rays;
  for (const kernels::Segment& segment : segments) rays.push_back(to_nif_ray(segment));
  FirstHits found(rays.size());
  const nifkit::Rays query(rays);
  const NifHits outputs = found.outputs();
  nifkit::check(nifIntersect(scene.get(), &query.get(), &outputs));
  std::vector<GoldenHit> hits(rays.size());
  for (size_t i = 0; i < hits.size(); ++i) {
    const size_t k = 3 * i;
    hits[i] = {.scene = number,
               .ray = segments[i],
               .t = found.t[i],
               .t_low = found.low[i],
               .t_high = found.high[i],
               .normal = {found.normal[k], found.normal[k + 1], found.normal[k + 2]},
               .instance = found.instance[i],
               .object = found.object[i],
               .triangle = found.triangle[i],
               .u = found.u[i],
               .v = found.v[i],
               .color = {found.color[k], found.color[k + 1], found.color[k + 2]},
               .hit = found.hit[i],
               .certain = found.certain[i],
               .zero = 0};
  }
  return hits;
}

}  // namespace nif::test
