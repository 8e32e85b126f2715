# Makes the arithmetic of nif.glsl looser than any that Vulkan allows: each result that rounds is moved by up to a unit in
# its last place, a quotient by up to two. What follows from small integers alone is exact in every arithmetic, so it stays.
/precise float (heights|units|step_size|lower_place|upper_place|lower|upper|half_size|most|times|culling_reach) = /b
/precise vec3 (middle|enlarged) = /b
s/precise (float|vec3) ([a-z_0-9]+) = ([^;]* \/ [^;]*);/precise \1 \2 = nif_rough(nif_rough(\3));/
t
s/precise (float|vec3) ([a-z_0-9]+) = ([^;]*);/precise \1 \2 = nif_rough(\3);/
# In front of the first function.
/^uint nif_header\(/i\
float nif_rough(float x) {\
  uint bits = floatBitsToUint(x);\
  uint hash = bits * 2654435761u;\
  hash = (hash ^ (hash >> 15)) * 2246822519u;\
  bool exact = (bits & 0x7fffffffu) == 0u || (bits & 0x7f800000u) == 0x7f800000u;\
  return exact ? x : uintBitsToFloat(bits + ((hash >> 16) % 3u) - 1u);\
}\
vec3 nif_rough(vec3 v) { return vec3(nif_rough(v.x), nif_rough(v.y), nif_rough(v.z)); }
