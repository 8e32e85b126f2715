// A rival of nif.glsl: a compressed wide BVH with a stack, after Ylitie, Karras and Laine (2017). Its nodes are those of the
// `bvh` encoding (kernels/reference/triangles/triangles_field.hpp), 20 words each; their slots lie as likely to block rays.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "rays.glsl"

void main() {
  if (!prepare()) {
    return;
  }
  uint nodes = floatBitsToUint(words[0].x), triangles = floatBitsToUint(words[0].y);
  uvec2 stack[40];  // the first of a node's children, and which are left
  uint height = 0u;
  uvec2 group = uvec2(0u, 1u);
  bool visible = true;
  while (mask != 0u) {
    uint child = uint(findLSB(group.y));
    group.y &= group.y - 1u;
    if (group.y != 0u) {
      stack[height++] = group;
    }
    uint at = nodes + 5u * (group.x + child);
    uvec4 head = floatBitsToUint(words[at]), next = floatBitsToUint(words[at + 1u]), third = floatBitsToUint(words[at + 2u]),
          fourth = floatBitsToUint(words[at + 3u]), last = floatBitsToUint(words[at + 4u]);
    vec3 scale = uintBitsToFloat((head.xyz & 255u) << 23u);
    vec3 corner = vec3(ivec3(head.xyz) >> 8) * scale;
    vec3 step_t = scale * inverse, first_t = (corner - origin) * inverse;
    uint first_triangle = next.x;
    uvec2 slots = next.zw;
    uvec2 low[3] = {third.xy, third.zw, fourth.xy}, high[3] = {fourth.zw, last.xy, last.zw};
    group = uvec2(head.w, 0u);
    for (uint s = 0u; s < 8u && visible; ++s) {
      uint half_word = s >> 2, shift = 8u * (s & 3u);
      uint slot = ((half_word == 0u ? slots.x : slots.y) >> shift) & 255u;
      if (slot == 0u) {
        break;
      }
      vec3 from, to;
      for (int a = 0; a < 3; ++a) {
        from[a] = float(((half_word == 0u ? low[a].x : low[a].y) >> shift) & 255u);
        to[a] = float(((half_word == 0u ? high[a].x : high[a].y) >> shift) & 255u);
      }
      vec3 t_0 = from * step_t + first_t, t_1 = to * step_t + first_t, enter = min(t_0, t_1), leave = max(t_0, t_1);
      if (max(max(enter.x, enter.y), max(enter.z, tmin)) <= min(min(leave.x, leave.y), min(leave.z, tmax))) {
        uint kind = slot >> 5, rank = slot & 31u;
        if (kind == 7u) {
          group.y |= 1u << rank;
        } else {
          uint triangle = triangles + 3u * (first_triangle + rank), end = triangle + 3u * kind;
          for (; triangle < end && visible; triangle += 3u) {
            visible = !meets(triangle);
          }
        }
      }
    }
    if (!visible) {
      break;
    }
    if (group.y == 0u) {
      if (height == 0u) {
        break;
      }
      group = stack[--height];
    }
  }
  answer(visible);
}
