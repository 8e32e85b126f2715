// Answers rays by kernels/shader/nif.glsl, for tests. Buffer 0: tables of an object, at the word that the first word
// of buffer 1 names. Buffer 1: then a mask, the number of rays, a word of nothing, and the rays, 8 floats each as in NifRay. Buffer 2: 8 words
// a ray. With NIF_TEST_PROVE it asks the planes alone, with NIF_TEST_SCENE a scene.
#version 450
#extension GL_GOOGLE_include_directive : require
#ifdef NIF_TEST_DOT4  // glslang knows no function for OpSDotKHR of four bytes (format 0)
#extension GL_EXT_spirv_intrinsics : require
spirv_instruction(extensions = ["SPV_KHR_integer_dot_product"], capabilities = [6018, 6019], id = 4450)
int dot4(uint a, uint b, spirv_literal int format);
#define NIF_DOT4(a, b) dot4(a, b, 0)
#endif
#include "kernels/shader/nif.glsl"

layout(local_size_x = 64) in;
layout(std430, set = 0, binding = 1) readonly buffer Rays {
  uint object;
  uint mask;
  uint count;
  uint unused;
  vec4 rays[];
};
layout(std430, set = 0, binding = 2) writeonly buffer Answers {
  uvec4 answers[];
};

void main() {
  uint i = gl_GlobalInvocationID.x;
  if (i >= count) {
    return;
  }
  vec4 start = rays[2u * i];
  vec4 way = rays[2u * i + 1u];
#if defined(NIF_TEST_SCENE) && defined(NIF_TEST_PROVE)
  NifAnswer answer = nif_prove_scene(object, start.xyz, way.xyz, start.w, way.w, mask);
#elif defined(NIF_TEST_SCENE)
  NifAnswer answer = nif_query_scene(object, start.xyz, way.xyz, start.w, way.w, mask);
#elif defined(NIF_TEST_PROVE)
  NifAnswer answer = nif_prove(object, start.xyz, way.xyz, start.w, way.w);
#else
  if (mask == 0u) {  // to time what else takes time
    return;
  }
  NifAnswer answer = nif_query(object, start.xyz, way.xyz, start.w, way.w);
#endif
  answers[2u * i] = uvec4(answer.visible ? 1u : 0u, answer.certain ? 1u : 0u, uint(answer.logit),
                          floatBitsToUint(answer.probability));
  answers[2u * i + 1u] = uvec4(floatBitsToUint(answer.open_begin), floatBitsToUint(answer.open_end),
                               answer.instance, 0u);
}
