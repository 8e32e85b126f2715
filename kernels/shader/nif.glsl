// nif.glsl: asks a nifkit object whether a ray is blocked, in a shader of your own. GLSL 4.50 for Vulkan.
//
//   NifAnswer answer = nif_query(0u, origin, direction, 0.0, 1.0e30);
//   if (answer.visible) ...
//
// Bind the words of nifGetShaderTables as a read-only storage buffer. Define what you want otherwise than below before you
// include this file. What to call is at the end, and docs/shaders.md says more.
//
// The arithmetic is that of the CPU, operation by operation: each sum, product and quotient makes a `precise` value, so
// that no compiler fuses or reorders it. No stack, no pointers, no array in memory that is not the buffer.

#ifndef NIF_SET
#define NIF_SET 0  // where the buffer is bound
#endif
#ifndef NIF_BINDING
#define NIF_BINDING 0
#endif
#ifndef NIF_WORD  // (i): reads word i. If you define it, nothing is bound here
layout(std430, set = NIF_SET, binding = NIF_BINDING) readonly buffer NifTables {
  uint nif_words[];
};
#define NIF_WORD(i) nif_words[i]
#endif
#ifndef NIF_PROVES
#define NIF_PROVES true  // false: no answer is certain, for compilers that do not heed `precise`
#endif
#ifndef NIF_PLANES
#define NIF_PLANES 1  // 0 leaves out all that only planes need. So do the next four. Objects that have such parts are left open
#endif
#ifndef NIF_NETWORK
#define NIF_NETWORK 1  // a ray that the planes leave open stays open
#endif
#ifndef NIF_TRIANGLES
#define NIF_TRIANGLES 1
#endif
#ifndef NIF_SCENES
#define NIF_SCENES 1
#endif
#ifndef NIF_FIRST_HITS
#define NIF_FIRST_HITS 1  // of triangles
#endif
#if NIF_PLANES || NIF_SCENES
#ifndef NIF_CERTAIN_REACH  // how far away, in finest cells, a ray may start for a proof: this holds in the loosest arithmetic
#define NIF_CERTAIN_REACH 8192.0  // that Vulkan allows. 16384 if the device's is known to be IEEE's
#endif
#endif
#if NIF_PLANES && NIF_NETWORK
#ifndef NIF_NETWORK_WORDS
#define NIF_NETWORK_WORDS 12  // room for a network's inputs, in words of 4: enough for all that `nif bake` makes
#endif
#ifndef NIF_DOT4  // (a, b): the sum of products of four signed bytes each, an int. Your device may have an instruction for it
#define NIF_DOT4(a, b) nif_dot(a, b)
#endif
#endif

struct NifAnswer {
  bool visible;       // false: something blocks the ray
  bool certain;       // it is proven
  int logit;          // the network's output; NIF_CERTAIN_LOGIT or its negative if none was asked
  float probability;  // that the ray is visible
  float open_begin;   // if the planes prove nothing: whatever blocks the ray does so between these two t
  float open_end;
  uint instance;      // of a scene: what blocks the ray; NIF_NONE if it is visible, or of an object alone
};

#if NIF_TRIANGLES && NIF_FIRST_HITS
struct NifHit {
  bool hit;
  bool certain;   // it is proven that nothing is hit, or that this triangle is hit first
  float t;        // infinite if nothing is hit
  vec3 normal;    // of the triangle, of unit length, on the side that the ray comes from
  uint triangle;  // as in NifHits, or NIF_NONE
  float u;        // the hit is at (1 - u - v) * first corner + u * second + v * third
  float v;
  vec3 color;     // of the surface there, linear; 0.5 if the object has no colours
  uint instance;  // of a scene
};
#endif

const uint NIF_NONE = 0xffffffffu;
const int NIF_CERTAIN_LOGIT = 0x7fffffff;

// ---- Words and numbers

float nif_float(uint at) { return uintBitsToFloat(NIF_WORD(at)); }
vec3 nif_vector(uint at) { return vec3(nif_float(at), nif_float(at + 1u), nif_float(at + 2u)); }
uint nif_object;  // first word of the object's header
// Word k of that header.
uint nif_header(uint k) { return NIF_WORD(nif_object + k); }
float nif_number(uint k) { return nif_float(nif_object + k); }

// By bits: compilers may assume that there are no infinities and NaNs.
bool nif_is_finite(float x) { return (floatBitsToUint(x) & 0x7f800000u) != 0x7f800000u; }
bool nif_is_nan(float x) { return (floatBitsToUint(x) & 0x7fffffffu) > 0x7f800000u; }
bool nif_all_finite(vec3 v) { return nif_is_finite(v.x) && nif_is_finite(v.y) && nif_is_finite(v.z); }
float nif_infinity() { return uintBitsToFloat(0x7f800000u); }
// The second number if one is NaN.
float nif_smaller(float a, float b) { return a < b ? a : b; }
float nif_larger(float a, float b) { return a > b ? a : b; }
float nif_largest(vec3 v) { return nif_larger(abs(v.z), nif_larger(abs(v.y), nif_larger(abs(v.x), 0.0))); }
// The scalar product, in the CPU's order.
float nif_product(vec3 a, vec3 b) {
  precise float sum = a.x * b.x + a.y * b.y + a.z * b.z;
  return sum;
}

// Whether there are points between tmin and tmax; whether there surely are none.
bool nif_has_points(float tmin, float tmax) { return !nif_is_nan(tmin) && !nif_is_nan(tmax) && tmin <= tmax; }
bool nif_no_points(float tmin, float tmax) { return !nif_is_nan(tmin) && !nif_is_nan(tmax) && tmin > tmax; }
// Whether a direction can be computed with: from 2^-60 to 2^60.
bool nif_moves(vec3 direction) {
  float steepest = nif_largest(direction);
  return nif_all_finite(direction) && steepest >= 8.67361737988403547e-19 && steepest <= 1.152921504606846976e18;
}
// Not where a number is not finite (tmin and tmax may be infinite), the origin is 2^126 or more, the direction does not
// move, or there are no points.
bool nif_is_valid(vec3 origin, vec3 direction, float tmin, float tmax) {
  precise vec3 enlarged = origin * 4.0;
  return nif_all_finite(enlarged) && nif_moves(direction) && nif_has_points(tmin, tmax);
}

// Of a ray of which nothing is known, and of one that was not guessed.
NifAnswer nif_unknown(float tmin, float tmax) { return NifAnswer(false, false, -1, 0.5, tmin, tmax, NIF_NONE); }
NifAnswer nif_known(bool visible, bool certain, float tmin, float tmax) {
  int logit = visible ? NIF_CERTAIN_LOGIT : -NIF_CERTAIN_LOGIT;
  return NifAnswer(visible, certain, logit, visible ? 1.0 : 0.0, tmin, tmax, NIF_NONE);
}

#if NIF_PLANES
// ---- State of a traversal. Space is the grid's, whose unit is a finest cell.

uvec3 nif_voxels;               // of the grid
uint nif_levels;                // how often voxels are cut
uint nif_voxel_words;           // where their table begins
uint nif_children;
vec3 nif_origin;
vec3 nif_direction;
vec3 nif_inverse;               // 1 / direction, 0 where that is 0
bvec3 nif_flat;                 // where the direction is 0
bvec3 nif_down;                 // where it is negative
ivec3 nif_cell;                 // the finest cell; counted by -1 - cell along axes with negative direction
float nif_enter, nif_leave;     // t where the segment enters and leaves the grid, or begins and ends
bool nif_enters, nif_leaves;    // it enters from outside; it leaves
bool nif_near;                  // it starts near enough for proofs
float nif_now;
uint nif_seen;                  // sides that it has been on: 1 outside, 2 inside
bool nif_blocked;
uint nif_count;                 // open intervals so far
float nif_open_t;               // their length
precise nif_open_t;
bool nif_starts_open, nif_ends_open;
float nif_open_begin, nif_open_end;
#if NIF_NETWORK
// The second traversal of an open ray places sample points.
bool nif_placing;
uint nif_last;                  // number of the last interval, from 1 on
uint nif_placed;
float nif_spacing;
precise nif_spacing;
float nif_start;                // arc length at the start of the interval
bool nif_reversed;
uint nif_input[NIF_NETWORK_WORDS];
uint nif_output[NIF_NETWORK_WORDS];
#endif

// Truncates x to an integer from 0 to top; 0 if it is NaN.
int nif_to_index(float x, int top) {
  if (nif_is_nan(x) || !(x > 0.0)) {
    return 0;
  }
  return x < float(top) ? clamp(int(x), 0, top) : top;
}

// ---- The grid

// To the start of the grid.
void nif_begin() {
  precise vec3 at = nif_origin + nif_enter * nif_direction;
  for (int a = 0; a < 3; ++a) {
    int cell = nif_to_index(at[a], int(nif_voxels[a] << nif_levels) - 1);
    nif_cell[a] = nif_down[a] ? -1 - cell : cell;
  }
  nif_now = nif_enter;
  nif_seen = (nif_enters || nif_leaves) ? 1u : 0u;
  nif_blocked = false;
  nif_count = 0u;
  nif_open_t = 0.0;
}

// Returns false if the segment meets no cell; it is then visible, which is certain if nif_near.
bool nif_enter_grid(vec3 origin, vec3 direction, float tmin, float tmax) {
  nif_count = 0u;
  nif_blocked = false;
  nif_voxels = uvec3(nif_header(10u), nif_header(11u), nif_header(12u));
  nif_levels = nif_header(9u);
  nif_voxel_words = nif_object + nif_header(13u);
  nif_children = nif_object + nif_header(14u);
  float scale = nif_number(7u);
  precise vec3 grid_origin = (origin - nif_vector(nif_object + 4u)) * scale;
  precise vec3 grid_direction = direction * scale;
  nif_near = nif_no_points(tmin, tmax);
  if (!nif_has_points(tmin, tmax) || !nif_all_finite(grid_origin) || !nif_moves(grid_direction)) {
    return false;
  }
  nif_near = nif_largest(grid_origin) <= NIF_CERTAIN_REACH;
  nif_origin = grid_origin;
  nif_enter = tmin;
  nif_leave = tmax;
  nif_enters = false;
  nif_leaves = false;
  precise float least = nif_largest(grid_direction) * 9.094947017729282379150390625e-13;  // 2^-40
  for (int a = 0; a < 3; ++a) {
    nif_flat[a] = abs(grid_direction[a]) < least;
    precise float inverse = 1.0 / (nif_flat[a] ? 1.0 : grid_direction[a]);
    nif_inverse[a] = nif_flat[a] ? 0.0 : inverse;
    nif_direction[a] = nif_flat[a] ? 0.0 : grid_direction[a];
    nif_down[a] = nif_direction[a] < 0.0;
    float size = float(nif_voxels[a] << nif_levels);
    precise float low = (0.0 - nif_origin[a]) * nif_inverse[a];
    precise float high = (size - nif_origin[a]) * nif_inverse[a];
    float first = nif_down[a] ? high : low;
    float last = nif_down[a] ? low : high;
    if (nif_flat[a] && !(nif_origin[a] >= 0.0 && nif_origin[a] <= size)) {
      return false;
    }
    if (!nif_flat[a] && first > nif_enter) {
      nif_enter = first;
      nif_enters = true;
    }
    if (!nif_flat[a] && last < nif_leave) {
      nif_leave = last;
      nif_leaves = true;
    }
  }
  return nif_enter <= nif_leave && nif_enter <= 3.402823466e+38;
}

#if NIF_NETWORK
// ---- Sample points

// Word i of the table that begins where word k of the header says.
uint nif_table(uint k, uint i) { return NIF_WORD(nif_object + nif_header(k) + i); }

int nif_byte(uint word, uint k) { return int(word << (24u - 8u * k)) >> 24; }

// First word of a brick of corners.
uint nif_brick(uvec3 at) {
  uvec3 bricks = (nif_voxels + 3u) / 4u;
  uint number = at.x + bricks.x * (at.y + bricks.y * at.z);
  uint word = nif_table(15u, number >> 4);
  uint mark = 1u << (number & 15u);
  uint below = uint(bitCount(word & (mark - 1u)));
  return (word & mark) != 0u ? 6u * (1u + (word >> 16) + below) : 0u;
}

// The two features of a corner at a place in a brick; NIF_NONE if that does not have them.
uint nif_pair(uint brick, uvec3 at) {
  uint layer = nif_table(16u, brick + 1u + at.z);
  uint mark = 1u << (at.x + 5u * at.y);
  uint i = nif_table(16u, brick) + (layer >> 25) + uint(bitCount(layer & (mark - 1u)));
  uint word = nif_table(17u, i >> 1);
  return (layer & mark) != 0u ? (word >> (16u * (i & 1u))) & 0xffffu : NIF_NONE;
}

// Those of a corner in whichever brick has them; 0 if none has.
uint nif_pair_anywhere(uvec3 corner) {
  uvec3 first = (max(corner, uvec3(1u)) - 1u) / 4u;
  uvec3 last = min(corner / 4u, (nif_voxels + 3u) / 4u - 1u);
  uint pair = NIF_NONE;
  for (uint k = 0u; k < 8u && pair == NIF_NONE; ++k) {
    uvec3 at = min(first + uvec3(k & 1u, (k >> 1) & 1u, k >> 2), last);
    pair = nif_pair(nif_brick(at), corner - 4u * at);
  }
  return pair == NIF_NONE ? 0u : pair;
}

uint nif_feature(int sum) { return uint((sum + (127 << 21) + (1 << 21)) >> 22); }

// The two inputs of a point: trilinear interpolation of the features of its voxel's corners, in integers.
uint nif_features(uvec3 voxel, ivec3 fraction) {
  uint brick = nif_brick(voxel / 4u);
  ivec3 rest = 128 - fraction;
  int sum_0 = 0;
  int sum_1 = 0;
  for (uint k = 0u; k < 8u; ++k) {
    uvec3 to = uvec3(k & 1u, (k >> 1) & 1u, k >> 2);
    uint pair = nif_pair(brick, (voxel & uvec3(3u)) + to);
    if (pair == NIF_NONE) {  // rounding has moved the point out of the surface voxels
      pair = nif_pair_anywhere(voxel + to);
    }
    int share = (to.x == 0u ? rest.x : fraction.x) * (to.y == 0u ? rest.y : fraction.y) * (to.z == 0u ? rest.z : fraction.z);
    sum_0 += share * nif_byte(pair, 0u);
    sum_1 += share * nif_byte(pair, 1u);
  }
  return nif_feature(sum_0) | (nif_feature(sum_1) << 8);
}

// Writes an input without an index that varies, which would put the array in memory.
void nif_put(uint at, uint word) {
  for (uint k = 0u; k < uint(NIF_NETWORK_WORDS); ++k) {
    nif_input[k] = k == at ? word : nif_input[k];
  }
}

// The sample points of one interval.
void nif_place(float begin, float end, float begin_height, float end_height) {
  bool last = nif_count == nif_last;
  uint samples = nif_header(18u);
  precise float length = end - begin;
  for (; nif_placed < samples; ++nif_placed) {
    precise float s = (float(nif_placed) + 0.5) * nif_spacing;
    precise float interval_end = nif_start + length;
    if (!last && s > interval_end) {
      nif_start = interval_end;
      return;
    }
    precise float along = begin + (s - nif_start);
    float t = nif_smaller(along, end);
    // Between the planes; 0 for an interval without length.
    precise float share = (t - begin) / (length > 0.0 ? length : 1.0);
    precise float height = begin_height + (end_height - begin_height) * share + 0.5;
    precise vec3 at = (nif_origin + t * nif_direction) * nif_number(8u);
    uvec3 voxel;
    ivec3 fraction;
    for (int a = 0; a < 3; ++a) {
      int index = nif_to_index(at[a], int(nif_voxels[a]) - 1);
      precise float nearest = (at[a] - float(index)) * 128.0 + 0.5;
      voxel[a] = uint(index);
      fraction[a] = nif_to_index(nearest, 128);
    }
    uint word = nif_features(voxel, fraction) | (length > 0.0 ? uint(nif_to_index(height, 127)) << 16 : 0u);
    nif_put(nif_reversed ? samples - 1u - nif_placed : nif_placed, word);
  }
}
#endif

// ---- Traversal

// The segment from t = nif_now to t = left in a cell with planes.
void nif_pass_cell(uint word, vec3 middle, float size, float left) {
  int u = int((word >> 4) & 63u) - 31;
  int v = int((word >> 10) & 63u) - 31;
  vec3 normal = vec3(ivec3(u + v, u - v, 62 - 2 * max(abs(u), abs(v))));
  precise vec3 relative = nif_origin - middle;
  precise vec3 enter_point = relative + nif_now * nif_direction;
  precise vec3 leave_point = relative + left * nif_direction;
  float enter_height = nif_product(normal, enter_point);
  float leave_height = nif_product(normal, leave_point);
  precise float step_size = (31.0 * size + 1.0) * 0.0078125;  // exact, as all are that follow from size and word alone
  precise float lower = (float((word >> 16) & 255u) - 128.0) * step_size;
  precise float upper = (float((word >> 24) + 1u) - 128.0) * step_size;
  bool enters_above = enter_height > upper;
  bool enters_below = enter_height < lower;
  bool leaves_above = leave_height > upper;
  bool leaves_below = leave_height < lower;
  uint kind = word & 15u;
  bool wall = ((0x3f00u >> kind) & 1u) != 0u;
  nif_blocked = wall && ((enters_above && leaves_below) || (enters_below && leaves_above));
  nif_seen |= (enters_above || leaves_above) ? (0x06109610u >> (2u * kind)) & 3u : 0u;
  nif_seen |= (enters_below || leaves_below) ? (0x04846484u >> (2u * kind)) & 3u : 0u;
  if ((enters_above && leaves_above) || (enters_below && leaves_below)) {
    return;
  }

  // The part between the planes.
  precise float climb = leave_height - enter_height;
  precise float rate = (left - nif_now) / (climb != 0.0 ? climb : 1.0);
  precise float first_t = nif_now + ((enters_above ? upper : lower) - enter_height) * rate;
  precise float last_t = nif_now + ((leaves_above ? upper : lower) - enter_height) * rate;
  float begin = (enters_above || enters_below) ? nif_smaller(nif_larger(first_t, nif_now), left) : nif_now;
  float end = (leaves_above || leaves_below) ? nif_smaller(nif_larger(last_t, begin), left) : left;
  ++nif_count;
#if NIF_NETWORK
  if (nif_placing) {
    precise float scale = 127.0 / (upper - lower);
    precise float enters = (enter_height - lower) * scale + 0.5;
    precise float leaves = (leave_height - lower) * scale + 0.5;
    nif_place(begin, end, float(nif_to_index(enters, 127)), float(nif_to_index(leaves, 127)));
    return;
  }
#endif
  if (nif_count == 1u) {
    nif_starts_open = begin == nif_enter && !nif_enters;
    nif_open_begin = nif_now;
  }
  nif_ends_open = end == nif_leave && !nif_leaves;
  nif_open_end = left;
  nif_open_t = nif_open_t + (end - begin);
}

// One skip through empty space, or one cell. Returns false if the traversal is over.
bool nif_next() {
  ivec3 cells = ivec3(nif_voxels << uvec3(nif_levels));
  ivec3 at = clamp(ivec3(nif_down.x ? -1 - nif_cell.x : nif_cell.x, nif_down.y ? -1 - nif_cell.y : nif_cell.y,
                         nif_down.z ? -1 - nif_cell.z : nif_cell.z), ivec3(0), cells - 1);
  uvec3 voxel = uvec3(at) >> uvec3(nif_levels);
  uint word = NIF_WORD(nif_voxel_words + voxel.x + nif_voxels.x * (voxel.y + nif_voxels.y * voxel.z));
  uint level = nif_levels;
  for (; level > 0u && (word & 15u) == 15u;) {
    --level;
    uvec3 upper = (uvec3(at) >> uvec3(level)) & uvec3(1u);
    uint child = 1u << (upper.x | (upper.y << 1) | (upper.z << 2));
    uint mask = (word >> 4) & 255u;
    if ((mask & child) != 0u) {
      word = NIF_WORD(nif_children + (word >> 12) + uint(bitCount(mask & (child - 1u))));
    } else {
      word = 14u;  // no triangle, and nothing is known of its side
    }
  }

  // Where the segment leaves the box or the cell.
  bool is_empty = (word & 15u) == 14u;
  uint box = (is_empty && nif_near) ? word : 0u;
  int size = 1 << level;
  ivec3 low = ivec3((uvec3(at) >> uvec3(level)) << uvec3(level));
  vec3 leaving;
  for (int a = 0; a < 3; ++a) {
    uint extent = (box >> (8u + 8u * uint(a) + (nif_down[a] ? 0u : 4u))) & 15u;
    int reach = int(extent) * size;
    float plane = float(nif_down[a] ? low[a] - reach : low[a] + size + reach);
    precise float crossing = (plane - nif_origin[a]) * nif_inverse[a];
    leaving[a] = nif_flat[a] ? nif_infinity() : crossing;
  }
  float t = nif_smaller(nif_smaller(leaving.x, leaving.y), leaving.z);
  bool ends = !(t < nif_leave);
  float left = nif_larger(ends ? nif_leave : t, nif_now);
  if (is_empty) {
    nif_seen |= (word >> 4) & 3u;
  } else {
    precise vec3 middle = vec3(low) + 0.5 * float(size);  // exact
    nif_pass_cell(word, middle, float(size), left);
  }
  nif_blocked = nif_blocked || nif_seen == 3u;
  nif_now = left;
  if (nif_blocked || ends) {
    return false;
  }

  // The cell behind it. Along each axis its number is estimated from below, by at most 1 too little, and corrected
  // by a crossing; those of lower axes at the same t come first. Far away each plane is tested. One loop for all, whose end no
  // compiler knows: they would unroll it, and drivers that run several rays together would do all of it for each.
  precise vec3 reached = nif_origin + nif_direction * t;
  ivec3 cell = nif_cell;
  if (nif_near) {
    for (int a = 0; a < 3; ++a) {
      precise float lowered = (nif_down[a] ? -reached[a] : reached[a]) - 0.03125;
      cell[a] = max(int(clamp(floor(lowered), -1025.0, 1025.0)), cell[a]);
    }
  }
  bvec3 passes = bvec3(true);
  for (int k = 0; k < size && (passes.x || passes.y || passes.z); ++k) {
    for (int a = 0; a < 3; ++a) {
      bool later = (a > 0 && leaving.x == t) || (a > 1 && leaving.y == t);
      int next = cell[a] + 1;
      float plane = float(nif_down[a] ? -next : next);
      precise float crossing = (plane - nif_origin[a]) * nif_inverse[a];
      bool crossed = passes[a] && !nif_flat[a] && (crossing < t || (crossing == t && !later));
      cell[a] = crossed ? next : cell[a];
      passes[a] = crossed && !nif_near && (next & (size - 1)) != 0;
    }
  }
  nif_cell = cell;
  return true;
}

#if NIF_NETWORK
// ---- The network

// No input is above 127.
int nif_dot(uint weights, uint inputs) {
  return nif_byte(weights, 0u) * int(inputs & 255u) + nif_byte(weights, 1u) * int((inputs >> 8) & 255u) +
         nif_byte(weights, 2u) * int((inputs >> 16) & 255u) + nif_byte(weights, 3u) * int(inputs >> 24);
}

// The sum of one neuron, whose row of weights begins at a word.
int nif_neuron(uint row, uint words) {
  int sum = int(NIF_WORD(row));
  for (uint k = 0u; k < uint(NIF_NETWORK_WORDS); ++k) {
    if (k < words) {
      sum += NIF_DOT4(NIF_WORD(row + 1u + k), nif_input[k]);
    }
  }
  return sum;
}

// The inputs that belong to no point: direction, length, flags.
void nif_put_globals(uint samples) {
  float length = sqrt(nif_product(nif_direction, nif_direction));
  precise vec3 unit = nif_direction / length;
  precise vec3 way = 64.0 + 63.5 * (nif_reversed ? -unit : unit);
  precise float open = nif_open_t * length * nif_number(19u) + 0.5;
  nif_put(samples, uint(nif_to_index(way.x, 127)) | (uint(nif_to_index(way.y, 127)) << 8) |
                       (uint(nif_to_index(way.z, 127)) << 16) | (uint(nif_to_index(open, 127)) << 24));
  bool starts = nif_reversed ? nif_ends_open : nif_starts_open;
  bool ends = nif_reversed ? nif_starts_open : nif_ends_open;
  nif_put(samples + 1u, ((nif_seen & 1u) * 0x7fu) | ((nif_seen >> 1) * 0x7f00u) | (starts ? 0x7f0000u : 0u) |
                            (ends ? 0x7f000000u : 0u));
}

// The network's output for nif_input.
int nif_evaluate() {
  uint layers = min(nif_header(20u), 4u);
  for (uint l = 0u; l < layers; ++l) {
    uint row = nif_object + nif_header(24u + 4u * l);
    uint words = nif_header(25u + 4u * l);
    uint shift = nif_header(27u + 4u * l);
    if (l + 1u == layers) {
      return nif_neuron(row, words);
    }
    uint groups = nif_header(26u + 4u * l) >> 2;
    for (uint w = 0u; w < groups; ++w) {
      uint four = 0u;
      for (uint k = 0u; k < 4u; ++k) {
        int sum = nif_neuron(row, words) + ((1 << shift) >> 1);
        four |= min(uint(max(sum, 0)) >> shift, 127u) << (8u * k);
        row += words + 1u;
      }
      for (uint k = 0u; k < uint(NIF_NETWORK_WORDS); ++k) {
        nif_output[k] = k == w ? four : nif_output[k];
      }
    }
    for (uint k = 0u; k < uint(NIF_NETWORK_WORDS); ++k) {
      nif_input[k] = nif_output[k];
    }
  }
  return -1;
}
#endif

// By planes, and if `learned` by the network about what they leave open, if there is one.
NifAnswer nif_ask_planes(vec3 origin, vec3 direction, float tmin, float tmax, bool learned) {
  NifAnswer answer = nif_unknown(tmin, tmax);
  bool goes_on = nif_enter_grid(origin, direction, tmin, tmax);
#if NIF_NETWORK
  uint samples = nif_header(18u);
  bool has_network = learned && (nif_header(3u) & 1u) != 0u && nif_header(21u) <= uint(NIF_NETWORK_WORDS);
  nif_placing = false;
#endif
  if (goes_on) {
    nif_begin();
  }
  // Each step goes at least one cell along an axis, and a ray is traversed at most twice.
  for (int k = 0; k < 2 * (3 * 1024 + 2) && goes_on; ++k) {
    goes_on = nif_next();
#if NIF_NETWORK
    if (!goes_on && !nif_placing && !nif_blocked && nif_count > 0u && has_network) {
      // From the end that makes the direction point up.
      vec3 d = nif_direction;
      nif_reversed = d.z < 0.0 || (d.z == 0.0 && (d.y < 0.0 || (d.y == 0.0 && d.x < 0.0)));
      for (uint w = 0u; w < uint(NIF_NETWORK_WORDS); ++w) {
        nif_input[w] = 0u;
        nif_output[w] = 0u;
      }
      nif_put_globals(samples);
      nif_spacing = nif_open_t / float(samples);
      nif_last = nif_count;
      nif_placed = 0u;
      nif_start = 0.0;
      nif_placing = true;
      nif_begin();
      goes_on = true;
    }
#endif
  }
  if (goes_on) {
    return answer;
  }
  if (nif_blocked || nif_count == 0u) {
    return nif_known(!nif_blocked, NIF_PROVES && nif_near && (nif_header(3u) & 2u) != 0u, tmin, tmax);
  }

  // The interval in which the caller's own triangles can decide: a voxel longer at each end.
  precise float culling_reach = 0.25 * NIF_CERTAIN_REACH;
  if (nif_largest(nif_origin) <= culling_reach) {
    precise float voxel = float(1u << nif_levels) / nif_largest(nif_direction);
    precise float begin = nif_open_begin - voxel;
    precise float end = nif_open_end + voxel;
    answer.open_begin = nif_larger(begin, tmin);
    answer.open_end = nif_smaller(end, tmax);
  }
#if NIF_NETWORK
  if (nif_placing) {
    answer.logit = nif_evaluate();
    answer.visible = answer.logit >= 0;
    precise float odds = float(answer.logit + int(nif_header(23u))) * nif_number(22u);
    precise float probability = 1.0 / (1.0 + exp(-odds));
    answer.probability = probability;
  }
#endif
  return answer;
}
#endif

#if NIF_TRIANGLES
// ---- Triangles: a tree of boxes whose nodes lie depth first, so that no stack is needed. The triangle's vectors are turned
// to end with the axis along which the ray moves most, and sheared so that the ray runs along it.

uint nif_steep;                 // that axis
float nif_steepest;             // the direction along it, without its sign
vec3 nif_from;                  // the ray's origin, turned
float nif_slope_x, nif_slope_y;
float nif_per_unit;             // t for a unit along that axis
float nif_error_share;          // sheared coordinates are off by less than this share of the distance, and nif_error_least
float nif_error_least;
precise nif_slope_x, nif_slope_y, nif_per_unit, nif_error_least;
bool nif_in_reach;              // of proofs
bvec3 nif_back;                 // where the direction is negative
vec3 nif_box_step, nif_box_near, nif_box_far;  // boxes count t by nif_steepest
float nif_box_enter, nif_box_leave;
precise nif_box_step, nif_box_near, nif_box_far, nif_box_enter, nif_box_leave;
float nif_tmin, nif_tmax;
bool nif_looks_for_first;       // else for any triangle
bool nif_met, nif_met_surely;   // one, as single precision says
bool nif_doubtful;              // there is a triangle of which rounding decides whether it is met
bool nif_found;                 // no other triangle matters
bool nif_hit_surely;            // the nearest one
float nif_hit_t;
float nif_hit_low, nif_hit_high;  // it is met from here to here
float nif_hit_u, nif_hit_v;
uint nif_hit_triangle;
uint nif_hit_corners;           // their word
uint nif_hit_vertex;            // the first of the leaf
uint nif_hit_object;
uint nif_hit_instance;          // its first word, or NIF_NONE
float nif_others_low;           // none of the others is met before

float nif_least(vec3 v) { return nif_smaller(v.z, nif_smaller(v.y, v.x)); }
float nif_most(vec3 v) { return nif_larger(v.z, nif_larger(v.y, v.x)); }
vec3 nif_turn(vec3 v) { return nif_steep == 2u ? v : (nif_steep == 0u ? vec3(v.y, v.z, v.x) : vec3(v.z, v.x, v.y)); }

// Prepares a ray for the object's triangles. Returns false if it meets none, without a look at them. `moved`: the sum of
// magnitudes from which an instance's transform has made the origin, or negative.
bool nif_enter_tree(vec3 origin, vec3 direction, float tmin, float tmax, float moved) {
  float extent = nif_number(53u);
  float far = nif_largest(origin);
  float reach = nif_larger(far, extent);
  nif_steepest = nif_largest(direction);
  precise float farthest = extent * 4294967296.0;
  bool near_at_all = far <= farthest && reach <= 2.305843009213693952e18;  // 2^61
  if (!nif_all_finite(origin) || !nif_moves(direction) || !nif_has_points(tmin, tmax) || !near_at_all) {
    return false;
  }
  vec3 steep = abs(direction);
  nif_steep = steep.z > nif_larger(steep.x, steep.y) ? 2u : (steep.y > steep.x ? 1u : 0u);
  nif_from = nif_turn(origin);
  vec3 turned = nif_turn(direction);
  nif_slope_x = turned.x / turned.z;
  nif_slope_y = turned.y / turned.z;
  nif_per_unit = 1.0 / turned.z;
  nif_tmin = tmin;
  nif_tmax = tmax;

  // How far rounding may move it, and what is too far away, too small or too large for that bound (docs/shaders.md).
  bool is_moved = moved >= 0.0;
  nif_error_share = is_moved ? 3.814697265625e-6 : 9.5367431640625e-7;  // 2^-18, 2^-20
  precise float error_moved = moved * 1.9073486328125e-6;               // 2^-19
  nif_error_least = reach * 9.31322574615478515625e-10 + (is_moved ? error_moved : 0.0);  // 2^-30
  precise float near = extent * 1024.0;
  bool proves = NIF_PROVES && (nif_header(3u) & 2u) != 0u;
  // At most 1024 extents away; from 2^-30 to 2^36; a direction from 2^-40 to 2^40.
  bool near_enough = reach <= near && reach <= 6.8719476736e10 && extent >= 9.31322574615478515625e-10;
  bool steep_enough = nif_steepest <= 1.099511627776e12 && nif_steepest >= 9.094947017729282379e-13;
  nif_in_reach = proves && near_enough && steep_enough;

  // Boxes grow by more than any of that, up to where they would no longer be of use.
  precise float useful = extent * 2048.0;
  float counted = nif_smaller(reach, useful);
  precise float padding = counted * 3.814697265625e-6 + counted * (nif_error_share * 4.0) + nif_error_least * 2.0;
  vec3 outward;
  vec3 way;
  for (int a = 0; a < 3; ++a) {
    nif_back[a] = direction[a] < 0.0;
    precise float share = steep[a] / nif_steepest;
    float size = nif_larger(share, 9.31322574615478515625e-10);  // 2^-30
    way[a] = nif_back[a] ? -size : size;
    outward[a] = nif_back[a] ? -padding : padding;
  }
  precise vec3 inverse = 1.0 / way;
  vec3 corner = nif_vector(nif_object + 54u);
  nif_box_step = nif_vector(nif_object + 57u) * inverse;
  nif_box_near = (corner - (origin + outward)) * inverse;
  nif_box_far = (corner - (origin - outward)) * inverse;
  precise float last = reach * 4.0 / nif_steepest;  // nothing is met beyond
  nif_box_enter = nif_larger(tmin, -last) * nif_steepest;
  nif_box_leave = nif_smaller(nif_smaller(tmax, nif_hit_high), last) * nif_steepest;
  return true;
}

// Does the ray perhaps meet something in a node's box?
bool nif_meets_box(uint at) {
  uvec3 words = uvec3(NIF_WORD(at), NIF_WORD(at + 1u), NIF_WORD(at + 2u));
  vec3 low = vec3(words & uvec3(65535u));
  vec3 high = vec3(words >> uvec3(16u));
  vec3 first = vec3(nif_back.x ? high.x : low.x, nif_back.y ? high.y : low.y, nif_back.z ? high.z : low.z);
  vec3 last = vec3(nif_back.x ? low.x : high.x, nif_back.y ? low.y : high.y, nif_back.z ? low.z : high.z);
  precise vec3 enters = first * nif_box_step + nif_box_near;
  precise vec3 leaves = last * nif_box_step + nif_box_far;
  return nif_larger(nif_most(enters), nif_box_enter) <= nif_smaller(nif_least(leaves), nif_box_leave);
}

// Does the ray meet a triangle? Both triangles of an edge see it by the same numbers, so that no ray passes between them.
// Returns false if it certainly does not; then nothing else is set.
bool nif_meet_triangle(vec3 p, vec3 q, vec3 r, uint triangle) {
  precise vec3 to_p = nif_turn(p) - nif_from;
  precise vec3 to_q = nif_turn(q) - nif_from;
  precise vec3 to_r = nif_turn(r) - nif_from;
  vec3 depths = vec3(to_p.z, to_q.z, to_r.z);
  precise vec3 x = vec3(to_p.x, to_q.x, to_r.x) - depths * nif_slope_x;
  precise vec3 y = vec3(to_p.y, to_q.y, to_r.y) - depths * nif_slope_y;
  precise vec3 sides = x.zxy * y.yzx - y.zxy * x.yzx;

  // Bounds of their errors: e (|x| + |y| of both ends of the edge + e) 2, where e is that of a sheared coordinate.
  float distance = nif_larger(nif_largest(to_p), nif_larger(nif_largest(to_q), nif_largest(to_r)));
  precise float error = distance * nif_error_share + nif_error_least;
  precise float error_2 = error * 2.0;
  precise vec3 sizes = abs(x) + abs(y);
  precise vec3 bounds = (sizes.zxy + sizes.yzx + error) * error_2;
  bool left = sides.x > bounds.x || sides.y > bounds.y || sides.z > bounds.z;
  bool right = sides.x < -bounds.x || sides.y < -bounds.y || sides.z < -bounds.z;
  if (left && right) {
    return false;  // beside it
  }
  precise vec3 arrivals = depths * nif_per_unit;
  precise float slack = error_2 * abs(nif_per_unit);
  precise float low = nif_least(arrivals) - slack;
  precise float high = nif_most(arrivals) + slack;
  if (low > nif_tmax || high < nif_tmin || low > nif_hit_high) {
    return false;
  }

  precise float sum = sides.x + sides.y + sides.z;
  bool inside = (nif_least(sides) >= 0.0 || nif_most(sides) <= 0.0) && sum != 0.0;
  bool surely = (sides.x > bounds.x && sides.y > bounds.y && sides.z > bounds.z) ||
                (sides.x < -bounds.x && sides.y < -bounds.y && sides.z < -bounds.z);
  precise float per_sum = 1.0 / (sum != 0.0 ? sum : 1.0);
  precise vec3 weights = sides * per_sum;
  precise float t = nif_product(weights, depths) * nif_per_unit;
  if (surely) {
    precise float off = (bounds.x + bounds.y + bounds.z) * abs(per_sum);
    precise float around = (nif_most(arrivals) - nif_least(arrivals)) * off + slack * 2.0;
    low = t - around;
    high = t + around;
    if (low > nif_tmax || high < nif_tmin) {
      return false;
    }
    surely = low >= nif_tmin && high <= nif_tmax;
  }
  bool met = inside && nif_tmin <= t && t <= nif_tmax;
  nif_met = nif_met || met;
  nif_met_surely = nif_met_surely || surely;
  nif_doubtful = nif_doubtful || !surely;
  if (!nif_looks_for_first) {
    nif_found = nif_met_surely || (met && !nif_in_reach);
    return met;
  }
  bool nearer = met && (t < nif_hit_t || (t == nif_hit_t && triangle < nif_hit_triangle));
  nif_others_low = nif_smaller(nearer ? nif_hit_low : low, nif_others_low);
  if (nearer) {
    nif_hit_t = t;
    nif_hit_low = low;
    nif_hit_high = high;
    nif_hit_u = weights.y;
    nif_hit_v = weights.z;
    nif_hit_triangle = triangle;
    nif_hit_surely = surely;
    precise float leave = high * nif_steepest;
    nif_box_leave = nif_smaller(leave, nif_box_leave);
  }
  return nearer;
}

// Every step goes on in the buffer, because a tree has no link back. Some devices end long loops early: then nothing is
// proven. `instance`: for nif_hit_instance.
void nif_walk_tree(uint instance) {
  uint tree = nif_object + nif_header(48u);
  uint end = nif_object + nif_header(49u);
  uint vertices = nif_object + nif_header(50u);
  uint at = tree;
  for (; at < end && !nif_found;) {
    uint link = NIF_WORD(at + 3u);
    uint count = (link & 0x80000000u) != 0u ? link & 7u : 0u;
    uint next = count != 0u ? at + 6u + count : tree + link;
    if (nif_meets_box(at)) {
      next = count != 0u ? next : at + 4u;
      uint k = 0u;
      for (; k < count && !nif_found; ++k) {
        uint corners = NIF_WORD(at + 6u + k);
        uint first = NIF_WORD(at + 4u);
        uint p = vertices + 3u * (first + (corners & 255u));
        uint q = vertices + 3u * (first + ((corners >> 8) & 255u));
        uint r = vertices + 3u * (first + ((corners >> 16) & 255u));
        if (nif_meet_triangle(nif_vector(p), nif_vector(q), nif_vector(r), NIF_WORD(at + 5u) + k)) {
          nif_hit_corners = corners;
          nif_hit_vertex = first;
          nif_hit_object = nif_object;
          nif_hit_instance = instance;
        }
      }
      nif_in_reach = nif_in_reach && (k == count || nif_found);
    }
    at = next;
  }
  nif_in_reach = nif_in_reach && (at >= end || nif_found);
}

// Only boxes between two t are entered from now on.
void nif_leave_boxes_outside(float begin, float end) {
  precise float enter = begin * nif_steepest;
  precise float leave = end * nif_steepest;
  nif_box_enter = nif_larger(enter, nif_box_enter);
  nif_box_leave = nif_smaller(leave, nif_box_leave);
}

// Before the first triangle.
void nif_forget_triangles(bool first) {
  nif_looks_for_first = first;
  nif_met = false;
  nif_met_surely = false;
  nif_doubtful = false;
  nif_found = false;
  nif_hit_t = nif_infinity();
  nif_hit_low = nif_infinity();
  nif_hit_high = nif_infinity();
  nif_hit_triangle = NIF_NONE;
  nif_hit_surely = false;
  nif_others_low = nif_infinity();
}

// What the triangles between the planes say. nif_enter_tree() has prepared the ray.
NifAnswer nif_ask_triangles(NifAnswer by_planes) {
  nif_leave_boxes_outside(by_planes.open_begin, by_planes.open_end);
  nif_walk_tree(NIF_NONE);
  if (nif_in_reach && (nif_met_surely || !nif_doubtful)) {
    return nif_known(!nif_met, true, by_planes.open_begin, by_planes.open_end);
  }
  return NifAnswer(!nif_met, false, nif_met ? -1 : 0, 0.5, by_planes.open_begin, by_planes.open_end, NIF_NONE);
}
#endif

// ---- Queries

// Goes to an object. Returns false if this file does not read its tables.
bool nif_enter_object(uint object) {
  nif_object = object;
  uint parts = 3u;
#if NIF_TRIANGLES
  parts |= 4u;
#endif
#if NIF_PLANES
  parts |= 8u;
#endif
  return nif_header(0u) == 0x5346494eu && nif_header(1u) == 2u && (nif_header(3u) | parts) == parts;
}

// The whole of it. `moved`: as for nif_enter_tree(). Planes are asked in one place, because compilers that copy each function
// to its callers would otherwise have that traversal twice.
NifAnswer nif_ask(uint object, vec3 origin, vec3 direction, float tmin, float tmax, bool learned, float moved) {
  NifAnswer answer = nif_unknown(tmin, tmax);
  if (!nif_enter_object(object)) {
    return answer;
  }
  uint flags = nif_header(3u);
#if NIF_TRIANGLES
  if ((flags & 4u) != 0u) {
    nif_forget_triangles(false);
    if (!nif_enter_tree(origin, direction, tmin, tmax, moved)) {
      return nif_known(true, NIF_PROVES && (flags & 2u) != 0u && nif_no_points(tmin, tmax), tmin, tmax);
    }
  }
#endif
#if NIF_PLANES
  if ((flags & 8u) != 0u) {
    answer = nif_ask_planes(origin, direction, tmin, tmax, learned);
  }
#endif
#if NIF_TRIANGLES
  if ((flags & 4u) != 0u && !answer.certain) {
    answer = nif_ask_triangles(answer);
  }
#endif
  return answer;
}

// What proofs alone say: a valid ray that is not certain is open, and counts as occluded.
NifAnswer nif_or_open(NifAnswer answer, bool valid) {
  if (answer.certain || (answer.visible && !valid)) {
    return answer;
  }
  NifAnswer open = answer;
  open.visible = false;
  open.logit = -1;
  open.probability = 0.5;
  return open;
}

#if NIF_SCENES
// ---- Scenes

// Whether a valid ray may meet the box of an instance. A ray that does not certainly misses it, from anywhere.
bool nif_may_meet(uint box, vec3 origin, vec3 direction, float tmin, float tmax) {
  vec3 low = nif_vector(box);
  vec3 high = nif_vector(box + 3u);
  float enter = -nif_infinity();
  float leave = nif_infinity();
  for (int a = 0; a < 3; ++a) {
    bool moves = abs(direction[a]) >= 1.17549435082228751e-38;  // 2^-126
    if (!moves && !(low[a] < origin[a] && origin[a] < high[a])) {
      return false;
    }
    if (moves) {
      precise float inverse = 1.0 / direction[a];
      precise float t_low = (low[a] - origin[a]) * inverse;
      precise float t_high = (high[a] - origin[a]) * inverse;
      enter = nif_larger(nif_smaller(t_low, t_high), enter);
      leave = nif_smaller(nif_larger(t_high, t_low), leave);
    }
  }
  precise float enter_less = enter * 0.9999847412109375;  // 1 - 2^-16
  precise float enter_more = enter * 1.0000152587890625;
  precise float first = nif_smaller(enter_less, enter_more) - 7.34683969e-40;  // 2^-130
  precise float leave_less = leave * 0.9999847412109375;
  precise float leave_more = leave * 1.0000152587890625;
  precise float last = nif_larger(leave_less, leave_more) + 7.34683969e-40;
  float begin = nif_larger(nif_smaller(first, 1.70141183460469232e38), tmin);  // 2^127
  float end = nif_smaller(nif_larger(last, -1.70141183460469232e38), tmax);
  return begin <= end;
}

uint nif_local_object;
vec3 nif_local_origin;
vec3 nif_local_direction;
float nif_local_moved;          // as for nif_enter_tree()
bool nif_local_stays;           // what is proven in object space is so in the world

// Three rows times v.
vec3 nif_rows(vec3 x, vec3 y, vec3 z, vec3 v) { return vec3(nif_product(x, v), nif_product(y, v), nif_product(z, v)); }

// Takes a ray to the space of an instance whose words begin at `at`: sets nif_local_origin and what follows it.
void nif_enter_instance(uint scene, uint at, vec3 origin, vec3 direction, float tmin, float tmax) {
  uint word = NIF_WORD(at + 21u);
  nif_local_object = scene + (word & 0x1fffffffu);
  nif_local_origin = origin;
  nif_local_direction = direction;
  nif_local_moved = -1.0;
  bool stays = true;
  if ((word & 0x20000000u) == 0u) {  // not the identity
    vec3 x = nif_vector(at);
    vec3 y = nif_vector(at + 3u);
    vec3 z = nif_vector(at + 6u);
    vec3 remainder = nif_vector(at + 12u);
    precise vec3 relative = origin - nif_vector(at + 9u) - remainder;
    nif_local_origin = nif_rows(x, y, z, relative);
    nif_local_direction = nif_rows(x, y, z, direction);
    // Whether a proof for the ray in object space holds in the world: rounding must move it little.
    float reach = nif_largest(nif_rows(abs(x), abs(y), abs(z), abs(relative)));
    float spread = nif_largest(nif_rows(abs(x), abs(y), abs(z), abs(direction)));
    bool remains = remainder.x != 0.0 || remainder.y != 0.0 || remainder.z != 0.0;
    precise float longer = reach * 1.25;
    nif_local_moved = remains ? longer : reach;
    precise float cells = nif_local_moved * nif_float(nif_local_object + 47u);
    precise float most = NIF_CERTAIN_REACH * 0.125;
    precise float times = NIF_CERTAIN_REACH * 0.000244140625;  // 4 for the CPU's reach
    precise float wide = times * nif_largest(nif_local_direction);
    stays = tmin > tmax || ((word & 0x40000000u) != 0u && cells <= most && spread <= wide);
  }
  nif_local_stays = stays && (word & 0x80000000u) == 0u;
}

// The answer of one instance for a ray in world space.
NifAnswer nif_ask_instance(uint scene, uint at, vec3 origin, vec3 direction, float tmin, float tmax, bool learned) {
  nif_enter_instance(scene, at, origin, direction, tmin, tmax);
  NifAnswer answer =
      nif_ask(nif_local_object, nif_local_origin, nif_local_direction, tmin, tmax, learned, nif_local_moved);
  if (!nif_local_stays) {
    answer.certain = false;
    answer.open_begin = tmin;
    answer.open_end = tmax;
  }
  return answer;
}

bool nif_is_scene(uint scene) { return NIF_WORD(scene) == 0x4346494eu && NIF_WORD(scene + 1u) == 2u; }

// The answers of all instances joined: one that blocks the ray is enough.
NifAnswer nif_ask_scene(uint scene, vec3 origin, vec3 direction, float tmin, float tmax, uint mask, bool learned) {
  if (!nif_is_scene(scene)) {
    return nif_unknown(tmin, tmax);
  }
  bool proves = NIF_PROVES && (NIF_WORD(scene + 3u) & 2u) != 0u;
  bool valid = nif_is_valid(origin, direction, tmin, tmax);
  bool all_certain = proves && (valid || nif_no_points(tmin, tmax));
  bool blocked = false;
  NifAnswer joined = nif_known(true, all_certain, tmin, tmax);
  if (proves) {  // else what proves nothing may block the ray anywhere
    joined.open_begin = nif_infinity();
    joined.open_end = -nif_infinity();
  }
  bool alone = NIF_WORD(scene + 4u) == 1u;  // then its box is not asked, as by the CPU
  uint node = scene + NIF_WORD(scene + 11u);
  uint end = scene + NIF_WORD(scene + 12u);
  for (; node < end && !blocked;) {
    bool meets = alone || (valid && nif_may_meet(node, origin, direction, tmin, tmax));
    uint list = NIF_WORD(node + 7u);
    uint at = scene + 16u + 24u * (list >> 3);
    uint here = meets ? list & 7u : 0u;
    uint i = 0u;
    for (; i < here && !blocked; ++i) {
      if ((NIF_WORD(at + 22u) & mask) != 0u && (alone || nif_may_meet(at + 15u, origin, direction, tmin, tmax))) {
        NifAnswer answer = nif_ask_instance(scene, at, origin, direction, tmin, tmax, learned);
        all_certain = (alone || all_certain) && answer.certain;
        blocked = answer.certain && answer.logit < 0;
        if (answer.logit < min(joined.logit, 0)) {
          joined.instance = NIF_WORD(at + 23u);
        }
        joined.logit = min(joined.logit, answer.logit);
        precise float probability = joined.probability * answer.probability;
        joined.probability = probability;
        if (!answer.certain) {
          joined.open_begin = nif_smaller(answer.open_begin, joined.open_begin);
          joined.open_end = nif_larger(answer.open_end, joined.open_end);
        }
      }
      at += 24u;
    }
    all_certain = all_certain && i == here;
    node = meets ? node + 8u : scene + NIF_WORD(node + 6u);
  }
  all_certain = all_certain && node >= end;
  joined.visible = joined.logit >= 0;
  joined.certain = joined.visible ? all_certain : blocked;
  return joined;
}
#endif

#if NIF_TRIANGLES && NIF_FIRST_HITS
// ---- First hits

// Looks for a nearer triangle in one object. `stays`: what is proven for this ray is so in the world.
void nif_find_first(uint object, vec3 origin, vec3 direction, float tmin, float tmax, float moved, bool stays,
                    uint instance) {
  uint flags = nif_enter_object(object) ? nif_header(3u) : 0u;
  bool has_triangles = (flags & 4u) != 0u;
  NifAnswer answer = nif_unknown(tmin, tmax);
#if NIF_PLANES
  if ((flags & 8u) != 0u) {
    answer = nif_ask_planes(origin, direction, tmin, tmax, false);
  }
#endif
  bool passes = answer.certain && answer.visible;
  bool proves = passes && stays;
  if (has_triangles && !passes) {
    if (nif_enter_tree(origin, direction, tmin, tmax, moved)) {
      if (!answer.certain) {
        nif_leave_boxes_outside(answer.open_begin, answer.open_end);
      }
      nif_walk_tree(instance);
      proves = nif_in_reach && stays;
    } else {
      proves = stays && NIF_PROVES && tmin > tmax;
    }
  }
  if (!proves) {  // or its planes may block the ray, but have no first hit
    nif_doubtful = true;
    nif_others_low = nif_smaller(has_triangles || !stays ? -nif_infinity() : answer.open_begin, nif_others_low);
  }
}

// Which triangle of the source mesh it is, if the object knows; otherwise its own number.
uint nif_source_triangle(uint triangle) {
  uint bits = nif_header(52u);
  if (bits == 0u) {
    return triangle;
  }
  uint before = (triangle & 31u) * bits;
  uint at = nif_object + nif_header(51u) + (triangle >> 5) * bits + (before >> 5);
  uint shift = before & 31u;
  uint low = NIF_WORD(at) >> shift;
  uint high = NIF_WORD(at + 1u) << ((32u - shift) & 31u);
  return (low | (shift != 0u ? high : 0u)) & (0xffffffffu >> (32u - bits));
}

// v in unit length, or 0.
vec3 nif_unit(vec3 v) {
  float largest = nif_largest(v);
  precise vec3 scaled = v / (largest > 0.0 ? largest : 1.0);
  float length = sqrt(nif_product(scaled, scaled));
  precise vec3 unit = scaled / (length > 0.0 ? length : 1.0);
  return unit;
}

#if NIF_PLANES
// The packed colour of a voxel; NIF_NONE if it has none.
uint nif_packed_color(ivec3 voxel) {
  uvec3 voxels = uvec3(nif_header(10u), nif_header(11u), nif_header(12u));
  uvec3 at = uvec3(voxel);  // a negative one becomes large
  if (at.x >= voxels.x || at.y >= voxels.y || at.z >= voxels.z) {
    return NIF_NONE;
  }
  uvec3 bricks = voxels / 4u + 1u;
  uvec3 brick = at / 4u;
  uint number = brick.x + bricks.x * (brick.y + bricks.y * brick.z);
  uint entry = (NIF_WORD(nif_object + nif_header(60u) + (number >> 1)) >> (16u * (number & 1u))) & 0xffffu;
  if (entry < 3u) {
    return NIF_NONE;  // a brick without surface
  }
  uint record = nif_object + nif_header(61u) + 3u * (entry - 3u);
  uint bit = (at.x & 3u) | ((at.y & 3u) << 2) | ((at.z & 3u) << 4);
  uint mask = NIF_WORD(record + 1u + (bit >> 5));
  uint mark = 1u << (bit & 31u);
  uint before = (bit >> 5) != 0u ? uint(bitCount(NIF_WORD(record + 1u))) : 0u;
  uint i = NIF_WORD(record) + before + uint(bitCount(mask & (mark - 1u)));
  uint word = (mask & mark) != 0u ? NIF_WORD(nif_object + nif_header(62u) + (i >> 1)) : 0u;
  return (mask & mark) != 0u ? (word >> (16u * (i & 1u))) & 0xffffu : NIF_NONE;
}

// The colour of the surface at a point in object space: of its voxel, or of the nearest one around that.
vec3 nif_color_at(vec3 place) {
  if (nif_header(62u) == 0u) {
    return vec3(0.5);
  }
  precise vec3 at = (place - nif_vector(nif_object + 4u)) * nif_number(7u) * nif_number(8u);
  ivec3 middle;
  for (int a = 0; a < 3; ++a) {
    middle[a] = nif_to_index(at[a], int(nif_header(10u + uint(a))) - 1);
  }
  uint color = nif_packed_color(middle);
  float nearest = color != NIF_NONE ? 0.0 : nif_infinity();
  for (int i = 0; i < 27 && nearest > 0.0; ++i) {
    ivec3 voxel = middle + ivec3(i % 3, (i / 3) % 3, i / 9) - 1;
    precise vec3 below = vec3(voxel) - at;
    precise vec3 above = at - vec3(voxel + 1);
    vec3 off = max(max(below, above), vec3(0.0));
    float square = nif_product(off, off);
    uint other = nif_packed_color(voxel);
    if (other != NIF_NONE && square < nearest) {
      color = other;
      nearest = square;
    }
  }
  precise vec3 steps = vec3(float((color >> 11) & 31u), float((color >> 5) & 63u), float(color & 31u)) / vec3(31.0, 63.0, 31.0);
  precise vec3 light = steps * steps;
  return color != NIF_NONE ? light : vec3(0.5);
}
#endif

// What has been found.
NifHit nif_take_hit(vec3 direction) {
  NifHit hit = NifHit(false, !nif_doubtful, nif_infinity(), vec3(0.0), NIF_NONE, 0.0, 0.0, vec3(0.0), NIF_NONE);
  if (nif_hit_triangle == NIF_NONE) {
    return hit;
  }
  nif_object = nif_hit_object;
  hit.hit = true;
  hit.certain = nif_hit_surely && nif_hit_high < nif_others_low;
  hit.t = nif_hit_t;
  hit.triangle = nif_source_triangle(nif_hit_triangle);
  hit.u = nif_hit_u;
  hit.v = nif_hit_v;
  uint vertices = nif_object + nif_header(50u) + 3u * nif_hit_vertex;
  vec3 p = nif_vector(vertices + 3u * (nif_hit_corners & 255u));
  precise vec3 edge_1 = nif_vector(vertices + 3u * ((nif_hit_corners >> 8) & 255u)) - p;
  precise vec3 edge_2 = nif_vector(vertices + 3u * ((nif_hit_corners >> 16) & 255u)) - p;
  hit.color = vec3(0.5);
#if NIF_PLANES
  precise vec3 place = p + hit.u * edge_1 + hit.v * edge_2;
  hit.color = nif_color_at(place);
#endif
  vec3 way_1 = nif_unit(edge_1);
  vec3 way_2 = nif_unit(edge_2);
  precise vec3 normal = way_1.yzx * way_2.zxy - way_1.zxy * way_2.yzx;
#if NIF_SCENES
  if (nif_hit_instance != NIF_NONE) {
    hit.instance = NIF_WORD(nif_hit_instance + 23u);
    if ((NIF_WORD(nif_hit_instance + 21u) & 0x20000000u) == 0u) {
      normal = nif_vector(nif_hit_instance) * normal.x + nif_vector(nif_hit_instance + 3u) * normal.y +
               nif_vector(nif_hit_instance + 6u) * normal.z;
    }
  }
#endif
  vec3 way = nif_unit(direction);
  vec3 facing = nif_unit(normal);
  facing = nif_product(facing, way) > 0.0 ? -facing : facing;
  hit.normal = nif_largest(facing) > 0.0 ? facing : -way;
  return hit;
}
#endif

// ---- What to call. `object` is the first word of the object's tables in the buffer: 0 if it has but one.

// Does anything block one of the points origin + t direction, tmin <= t <= tmax? Planes prove most answers, and the
// network decides the rest. Without a network (`proof`) a ray that is left open counts as occluded, not certain.
NifAnswer nif_query(uint object, vec3 origin, vec3 direction, float tmin, float tmax) {
  return nif_ask(object, origin, direction, tmin, tmax, true, -1.0);
}

// The same by proofs alone: if the answer is not certain, test your own triangles from open_begin to open_end.
NifAnswer nif_prove(uint object, vec3 origin, vec3 direction, float tmin, float tmax) {
  bool valid = nif_is_valid(origin, direction, tmin, tmax);
  return nif_or_open(nif_ask(object, origin, direction, tmin, tmax, false, -1.0), valid);
}

#if NIF_SCENES
// The same of a scene, whose words begin at `scene`, for a ray in world space. It meets the instances whose mask has a bit
// in common with `mask`.
NifAnswer nif_query_scene(uint scene, vec3 origin, vec3 direction, float tmin, float tmax, uint mask) {
  return nif_ask_scene(scene, origin, direction, tmin, tmax, mask, true);
}
NifAnswer nif_prove_scene(uint scene, vec3 origin, vec3 direction, float tmin, float tmax, uint mask) {
  bool valid = nif_is_valid(origin, direction, tmin, tmax);
  return nif_or_open(nif_ask_scene(scene, origin, direction, tmin, tmax, mask, false), valid);
}
#endif

#if NIF_TRIANGLES && NIF_FIRST_HITS
// The first triangle that the ray hits, of an object or of a scene. Objects without triangles are not hit; if they may be in
// the way, the hit is not certain.
NifHit nif_first_hit(uint object, vec3 origin, vec3 direction, float tmin, float tmax) {
  nif_forget_triangles(true);
  nif_find_first(object, origin, direction, tmin, tmax, -1.0, true, NIF_NONE);
  return nif_take_hit(direction);
}
#if NIF_SCENES
NifHit nif_first_hit_scene(uint scene, vec3 origin, vec3 direction, float tmin, float tmax, uint mask) {
  nif_forget_triangles(true);
  if (!nif_is_scene(scene)) {
    nif_doubtful = true;
    return nif_take_hit(direction);
  }
  bool alone = NIF_WORD(scene + 4u) == 1u;
  bool valid = nif_is_valid(origin, direction, tmin, tmax);
  bool proves = NIF_PROVES && (NIF_WORD(scene + 3u) & 2u) != 0u;
  nif_doubtful = !proves || (!valid && !nif_no_points(tmin, tmax));
  nif_others_low = nif_doubtful ? -nif_infinity() : nif_infinity();
  uint node = scene + NIF_WORD(scene + 11u);
  uint end = scene + NIF_WORD(scene + 12u);
  bool complete = true;
  for (; node < end;) {
    float until = nif_smaller(tmax, nif_hit_high);
    bool meets = alone || (valid && nif_may_meet(node, origin, direction, tmin, until));
    uint list = NIF_WORD(node + 7u);
    uint at = scene + 16u + 24u * (list >> 3);
    uint here = meets ? list & 7u : 0u;
    uint i = 0u;
    for (; i < here; ++i) {
      if ((NIF_WORD(at + 22u) & mask) != 0u && (alone || nif_may_meet(at + 15u, origin, direction, tmin, tmax))) {
        nif_enter_instance(scene, at, origin, direction, tmin, tmax);
        nif_find_first(nif_local_object, nif_local_origin, nif_local_direction, tmin, tmax, nif_local_moved,
                       nif_local_stays, at);
      }
      at += 24u;
    }
    complete = complete && i == here;
    node = meets ? node + 8u : scene + NIF_WORD(node + 6u);
  }
  if (!complete || node < end) {
    nif_doubtful = true;
    nif_others_low = -nif_infinity();
  }
  return nif_take_hit(direction);
}
#endif
#endif
