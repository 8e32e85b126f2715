// Answers rays by kernels/shader/nif.hlsl, for tests. Buffers and macros are those of answer_rays.comp and first_hits.comp; with
// NIF_TEST_HITS it asks for first hits.
[[vk::binding(0)]] StructuredBuffer<uint> tables;
#define NIF_WORD(i) tables[i]
#include "kernels/shader/nif.hlsl"

[[vk::binding(1)]] StructuredBuffer<uint> rays;  // object, mask, number of rays, a word of nothing; then 8 words a ray
[[vk::binding(2)]] RWStructuredBuffer<uint> answers;

float ray_number(uint i) { return asfloat(rays[4u + i]); }

[numthreads(64, 1, 1)] void main(uint3 id : SV_DispatchThreadID) {
  uint i = id.x;
  if (i >= rays[2]) {
    return;
  }
  uint object = rays[0];
  uint mask = rays[1];
  float3 origin = float3(ray_number(8u * i), ray_number(8u * i + 1u), ray_number(8u * i + 2u));
  float tmin = ray_number(8u * i + 3u);
  float3 direction = float3(ray_number(8u * i + 4u), ray_number(8u * i + 5u), ray_number(8u * i + 6u));
  float tmax = ray_number(8u * i + 7u);
#ifdef NIF_TEST_HITS
#ifdef NIF_TEST_SCENE
  NifHit hit = nif_first_hit_scene(object, origin, direction, tmin, tmax, mask);
#else
  NifHit hit = nif_first_hit(object, origin, direction, tmin, tmax);
#endif
  uint found[16] = {hit.hit ? 1u : 0u, hit.certain ? 1u : 0u, hit.triangle_number, hit.instance,
                    asuint(hit.t), asuint(hit.u), asuint(hit.v), 0u,
                    asuint(hit.normal.x), asuint(hit.normal.y), asuint(hit.normal.z), 0u,
                    asuint(hit.color.x), asuint(hit.color.y), asuint(hit.color.z), 0u};
  for (uint k = 0u; k < 16u; ++k) {
    answers[16u * i + k] = found[k];
  }
#else
#if defined(NIF_TEST_SCENE) && defined(NIF_TEST_PROVE)
  NifAnswer answer = nif_prove_scene(object, origin, direction, tmin, tmax, mask);
#elif defined(NIF_TEST_SCENE)
  NifAnswer answer = nif_query_scene(object, origin, direction, tmin, tmax, mask);
#elif defined(NIF_TEST_PROVE)
  NifAnswer answer = nif_prove(object, origin, direction, tmin, tmax);
#else
  NifAnswer answer = nif_query(object, origin, direction, tmin, tmax);
#endif
  uint found[8] = {answer.visible ? 1u : 0u, answer.certain ? 1u : 0u, uint(answer.logit), asuint(answer.probability),
                   asuint(answer.open_begin), asuint(answer.open_end), answer.instance, 0u};
  for (uint k = 0u; k < 8u; ++k) {
    answers[8u * i + k] = found[k];
  }
#endif
}
