// How much of the sun and of the sky each pixel's surface sees: shadows and ambient occlusion.
#version 450
#extension GL_GOOGLE_include_directive : require

// nifkit's functions. They read the object's words from the buffer at this place.
#define NIF_SET 0
#define NIF_BINDING 0
// This shader asks one object alone, and whether a ray is blocked, not where.
#define NIF_SCENES 0
#define NIF_FIRST_HITS 0
#include "nif.glsl"

layout(local_size_x = 64) in;

// What an engine has in its G-buffer. kind: 0 where the pixel sees no surface.
struct Pixel {
  vec3 start;  // on the surface, moved off it by the object's bias
  float kind;
  vec3 normal;
  float unused;
};
layout(std430, set = 0, binding = 1) readonly buffer Pixels { Pixel pixels[]; };
// Points of the sun's disc, as directions, and then as many points of a sphere.
layout(std430, set = 0, binding = 2) readonly buffer Directions { vec4 directions[]; };
// For each pixel: rays to the sun that nothing blocks, the same of the sky, rays asked in all, and how many are proven.
layout(std430, set = 0, binding = 3) writeonly buffer Light { uvec4 light[]; };

layout(push_constant) uniform Frame {
  uint pixel_count;
  uint direction_count;  // of the sun, a power of two
  uint samples;          // rays to the sun, and to the sky
  uint up;               // the axis that points up
};

uvec4 asked;  // of this pixel, as in Light

void ask(vec3 start, vec3 direction, uint light_number) {
  NifAnswer answer = nif_query(0u, start, direction, 0.0, 1.0e30);
  asked[light_number] += answer.visible ? 1u : 0u;
  asked.z += 1u;
  asked.w += answer.certain ? 1u : 0u;
}

// Other directions for each pixel. check.cpp makes the same.
uint scrambled(uint i) {
  uint a = (i ^ 61u ^ (i >> 16)) * 9u;
  uint b = (a ^ (a >> 4)) * 0x27d4eb2du;
  return b ^ (b >> 15);
}

void main() {
  uint i = gl_GlobalInvocationID.x;
  if (i >= pixel_count) {
    return;
  }
  asked = uvec4(0u);
  Pixel pixel = pixels[i];
  if (pixel.kind != 0.0) {
    uint first = scrambled(i);
    for (uint k = 0u; k < samples; ++k) {
      uint which = (first + k) & (direction_count - 1u);
      vec3 to_sun = directions[which].xyz;
      precise vec3 products = to_sun * pixel.normal;
      precise float two = products.x + products.y;
      precise float cosine = two + products.z;
      if (cosine > 0.0 && to_sun[up] > 0.0) {
        ask(pixel.start, to_sun, 0u);
      }
      // A point of the sphere that touches the surface: so directions are distributed by the cosine.
      precise vec3 to_sky = pixel.normal + directions[direction_count + which].xyz;
      if (to_sky[up] > 0.0) {  // the ground hides what is below the horizon
        ask(pixel.start, to_sky, 1u);
      }
    }
  }
  light[i] = asked;
}
