// What the rivals share: rays and answers as in tests/shader/answer_rays.comp, and the usual test of a triangle (Moeller and
// Trumbore). Buffer 0: a vec4 whose bits say where nodes and triangles begin, in vec4s; nodes; three vec4s a triangle: a corner
// and two edges. Nothing here proves anything.
layout(local_size_x = 64) in;
layout(std430, set = 0, binding = 0) readonly buffer Words {
  vec4 words[];
};
layout(std430, set = 0, binding = 1) readonly buffer Rays {
  uint object;
  uint mask;  // 0: rays are answered without a look, to time what else takes time
  uint count;
  uint unused;
  vec4 rays[];
};
layout(std430, set = 0, binding = 2) writeonly buffer Answers {
  uvec4 answers[];
};

vec3 origin, direction, inverse;
float tmin, tmax;

bool prepare() {
  uint i = gl_GlobalInvocationID.x;
  if (i >= count) {
    return false;
  }
  vec4 start = rays[2u * i], way = rays[2u * i + 1u];
  origin = start.xyz, direction = way.xyz, tmin = start.w, tmax = way.w;
  inverse = 1.0 / mix(direction, vec3(1e-20), lessThan(abs(direction), vec3(1e-20)));
  return true;
}

bool meets(uint at) {
  vec3 edge_1 = words[at + 1u].xyz, edge_2 = words[at + 2u].xyz, relative = origin - words[at].xyz;
  vec3 p = cross(direction, edge_2), q = cross(relative, edge_1);
  float scale = 1.0 / dot(edge_1, p), u = dot(relative, p) * scale, v = dot(direction, q) * scale, t = dot(edge_2, q) * scale;
  return u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t >= tmin && t <= tmax;
}

void answer(bool visible) {
  uint i = gl_GlobalInvocationID.x;
  answers[2u * i] = uvec4(visible ? 1u : 0u, 0u, visible ? 0u : 0xffffffffu, 0u);
  answers[2u * i + 1u] = uvec4(0u);
}
