// First hits by kernels/shader/nif.glsl, for tests: buffers 0 and 1 as in answer_rays.comp, and 16 words a ray in buffer 2.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "kernels/shader/nif.glsl"

layout(local_size_x = 64) in;
layout(std430, set = 0, binding = 1) readonly buffer Rays {
  uint object;
  uint mask;
  uint count;
  uint unused;
  vec4 rays[];
};
layout(std430, set = 0, binding = 2) writeonly buffer Hits {
  uvec4 hits[];
};

void main() {
  uint i = gl_GlobalInvocationID.x;
  if (i >= count) {
    return;
  }
  vec4 start = rays[2u * i];
  vec4 way = rays[2u * i + 1u];
#ifdef NIF_TEST_SCENE
  NifHit hit = nif_first_hit_scene(object, start.xyz, way.xyz, start.w, way.w, mask);
#else
  if (mask == 0u) {
    return;
  }
  NifHit hit = nif_first_hit(object, start.xyz, way.xyz, start.w, way.w);
#endif
  hits[4u * i] = uvec4(hit.hit ? 1u : 0u, hit.certain ? 1u : 0u, hit.triangle, hit.instance);
  hits[4u * i + 1u] = floatBitsToUint(vec4(hit.t, hit.u, hit.v, 0.0));
  hits[4u * i + 2u] = floatBitsToUint(vec4(hit.normal, 0.0));
  hits[4u * i + 3u] = floatBitsToUint(vec4(hit.color, 0.0));
}
