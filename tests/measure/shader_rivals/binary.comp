// A rival of nif.glsl: a binary BVH of float boxes with a stack, the nearer child first. A node is four vec4s: the first child's
// lower corner and the child, its upper corner and the second child, the second child's corners. A child is a node, or with bit 31
// a leaf: from bit 28 on its triangles less one, below the first of them.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "rays.glsl"

float enters(vec3 low, vec3 high) {
  vec3 a = (low - origin) * inverse, b = (high - origin) * inverse, first = min(a, b), last = max(a, b);
  float begin = max(max(first.x, first.y), max(first.z, tmin)), end = min(min(last.x, last.y), min(last.z, tmax));
  return begin <= end ? begin : 1e38;
}

void main() {
  if (!prepare()) {
    return;
  }
  uint nodes = floatBitsToUint(words[0].x), triangles = floatBitsToUint(words[0].y);
  uint stack[64];
  uint height = 0u, child = 0u;
  bool visible = true;
  while (mask != 0u) {
    if ((child & 0x80000000u) != 0u) {
      uint at = triangles + 3u * (child & 0xfffffffu), end = at + 3u * (((child >> 28) & 7u) + 1u);
      for (; at < end && visible; at += 3u) {
        visible = !meets(at);
      }
    } else {
      uint at = nodes + 4u * child;
      vec4 low = words[at], high = words[at + 1u];
      float t_0 = enters(low.xyz, high.xyz), t_1 = enters(words[at + 2u].xyz, words[at + 3u].xyz);
      uint first = floatBitsToUint(t_0 <= t_1 ? low.w : high.w), second = floatBitsToUint(t_0 <= t_1 ? high.w : low.w);
      if (max(t_0, t_1) < 1e38) {
        stack[height++] = second;
      }
      if (min(t_0, t_1) < 1e38) {
        child = first;
        continue;
      }
    }
    if (height == 0u || !visible) {
      break;
    }
    child = stack[--height];
  }
  answer(visible);
}
