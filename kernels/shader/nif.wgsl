// nif.wgsl: asks a nifkit object whether a ray is blocked, in a shader of your own. Made from nif.glsl, whose comments say
// how to use it. WGSL has no preprocessor: change what follows up to the structures to your needs.
@group(0) @binding(0) var<storage, read> nif_words : array<u32>;
fn nif_word(i : u32) -> u32 { return nif_words[i]; }
const NIF_PROVES : bool = false;  // WGSL may reorder operations, so no bound holds: no answer is certain
// #if NIF_PLANES || NIF_SCENES // Such marks, up to `// #endif`, have what may be left out; `nif export-shader` does that.
const NIF_CERTAIN_REACH : f32 = 8192.0;
// #endif
// #if NIF_PLANES && NIF_NETWORK
const NIF_NETWORK_WORDS : u32 = 12u;
// #endif

struct NifAnswer {
  visible : bool,  // false: something blocks the ray
  certain : bool,  // it is proven
  logit : i32,  // the network's output; NIF_CERTAIN_LOGIT or its negative if none was asked
  probability : f32,  // that the ray is visible
  open_begin : f32,  // if the planes prove nothing: whatever blocks the ray does so between these two t
  open_end : f32,
  instance : u32,  // of a scene: what blocks the ray; NIF_NONE if it is visible, or of an object alone
}

// #if NIF_TRIANGLES && NIF_FIRST_HITS
struct NifHit {
  hit : bool,
  certain : bool,  // it is proven that nothing is hit, or that this triangle is hit first
  t : f32,  // infinite if nothing is hit
  normal : vec3<f32>,  // of the triangle, of unit length, on the side that the ray comes from
  triangle : u32,  // as in NifHits, or NIF_NONE
  u : f32,  // the hit is at (1 - u - v) * first corner + u * second + v * third
  v : f32,
  color : vec3<f32>,  // of the surface there, linear; 0.5 if the object has no colours
  instance : u32,  // of a scene
}
// #endif

const NIF_NONE : u32 = 0xffffffffu;
const NIF_CERTAIN_LOGIT : i32 = 0x7fffffff;

// ---- Words and numbers

fn nif_float(at : u32) -> f32 { return bitcast<f32>(nif_word(at)); }
fn nif_vector(at : u32) -> vec3<f32> { return vec3<f32>(nif_float(at), nif_float(at + 1u), nif_float(at + 2u)); }
var<private> nif_object : u32;  // first word of the object's header
// Word k of that header.
fn nif_header(k : u32) -> u32 { return nif_word(nif_object + k); }
fn nif_number(k : u32) -> f32 { return nif_float(nif_object + k); }

// By bits: compilers may assume that there are no infinities and NaNs.
fn nif_is_finite(x : f32) -> bool { return (bitcast<u32>(x) & 0x7f800000u) != 0x7f800000u; }
fn nif_is_nan(x : f32) -> bool { return (bitcast<u32>(x) & 0x7fffffffu) > 0x7f800000u; }
fn nif_all_finite(v : vec3<f32>) -> bool { return nif_is_finite(v.x) && nif_is_finite(v.y) && nif_is_finite(v.z); }
fn nif_infinity() -> f32 { return 3.40282346e+38; }
// The second number if one is NaN.
fn nif_smaller(a : f32, b : f32) -> f32 { return select(b, a, a < b); }
fn nif_larger(a : f32, b : f32) -> f32 { return select(b, a, a > b); }
fn nif_largest(v : vec3<f32>) -> f32 { return nif_larger(abs(v.z), nif_larger(abs(v.y), nif_larger(abs(v.x), 0.0))); }
// The scalar product, in the CPU's order.
fn nif_product(a : vec3<f32>, b : vec3<f32>) -> f32 {
  let sum : f32 = a.x * b.x + a.y * b.y + a.z * b.z;
  return sum;
}

// Whether there are points between tmin and tmax; whether there surely are none.
fn nif_has_points(tmin : f32, tmax : f32) -> bool { return !nif_is_nan(tmin) && !nif_is_nan(tmax) && tmin <= tmax; }
fn nif_no_points(tmin : f32, tmax : f32) -> bool { return !nif_is_nan(tmin) && !nif_is_nan(tmax) && tmin > tmax; }
// Whether a direction can be computed with: from 2^-60 to 2^60.
fn nif_moves(direction : vec3<f32>) -> bool {
  let steepest : f32 = nif_largest(direction);
  return nif_all_finite(direction) && steepest >= 8.67361737988403547e-19 && steepest <= 1.152921504606846976e18;
}
// Not where a number is not finite (tmin and tmax may be infinite), the origin is 2^126 or more, the direction does not
// move, or there are no points.
fn nif_is_valid(origin : vec3<f32>, direction : vec3<f32>, tmin : f32, tmax : f32) -> bool {
  let enlarged : vec3<f32> = origin * 4.0;
  return nif_all_finite(enlarged) && nif_moves(direction) && nif_has_points(tmin, tmax);
}

// Of a ray of which nothing is known, and of one that was not guessed.
fn nif_unknown(tmin : f32, tmax : f32) -> NifAnswer { return NifAnswer(false, false, -1, 0.5, tmin, tmax, NIF_NONE); }
fn nif_known(visible : bool, certain : bool, tmin : f32, tmax : f32) -> NifAnswer {
  let logit : i32 = select(-NIF_CERTAIN_LOGIT, NIF_CERTAIN_LOGIT, visible);
  return NifAnswer(visible, certain, logit, select(0.0, 1.0, visible), tmin, tmax, NIF_NONE);
}

// #if NIF_PLANES
// ---- State of a traversal. Space is the grid's, whose unit is a finest cell.

var<private> nif_voxels : vec3<u32>;  // of the grid
var<private> nif_levels : u32;  // how often voxels are cut
var<private> nif_voxel_words : u32;  // where their table begins
var<private> nif_children : u32;
var<private> nif_origin : vec3<f32>;
var<private> nif_direction : vec3<f32>;
var<private> nif_inverse : vec3<f32>;  // 1 / direction, 0 where that is 0
var<private> nif_flat : vec3<bool>;  // where the direction is 0
var<private> nif_down : vec3<bool>;  // where it is negative
var<private> nif_cell : vec3<i32>;  // the finest cell; counted by -1 - cell along axes with negative direction
var<private> nif_enter : f32; var<private> nif_leave : f32;  // t where the segment enters and leaves the grid, or begins and ends
var<private> nif_enters : bool; var<private> nif_leaves : bool;  // it enters from outside; it leaves
var<private> nif_near : bool;  // it starts near enough for proofs
var<private> nif_now : f32;
var<private> nif_seen : u32;  // sides that it has been on: 1 outside, 2 inside
var<private> nif_blocked : bool;
var<private> nif_count : u32;  // open intervals so far
var<private> nif_open_t : f32;  // their length
var<private> nif_starts_open : bool; var<private> nif_ends_open : bool;
var<private> nif_open_begin : f32; var<private> nif_open_end : f32;
// #if NIF_NETWORK
// The second traversal of an open ray places sample points.
var<private> nif_placing : bool;
var<private> nif_last : u32;  // number of the last interval, from 1 on
var<private> nif_placed : u32;
var<private> nif_spacing : f32;
var<private> nif_start : f32;  // arc length at the start of the interval
var<private> nif_reversed : bool;
var<private> nif_input : array<u32, NIF_NETWORK_WORDS>;
var<private> nif_output : array<u32, NIF_NETWORK_WORDS>;
// #endif

// Truncates x to an integer from 0 to top; 0 if it is NaN.
fn nif_to_index(x : f32, top : i32) -> i32 {
  if (nif_is_nan(x) || !(x > 0.0)) {
    return 0;
  }
  return select(top, clamp(i32(x), 0, top), x < f32(top));
}

// ---- The grid

// To the start of the grid.
fn nif_begin() {
  let at : vec3<f32> = nif_origin + nif_enter * nif_direction;
  for (var a : i32 = 0; a < 3; a++) {
    let cell : i32 = nif_to_index(at[a], i32(nif_voxels[a] << nif_levels) - 1);
    nif_cell[a] = select(cell, -1 - cell, nif_down[a]);
  }
  nif_now = nif_enter;
  nif_seen = select(0u, 1u, (nif_enters || nif_leaves));
  nif_blocked = false;
  nif_count = 0u;
  nif_open_t = 0.0;
}

// Returns false if the segment meets no cell; it is then visible, which is certain if nif_near.
fn nif_enter_grid(origin : vec3<f32>, direction : vec3<f32>, tmin : f32, tmax : f32) -> bool {
  nif_count = 0u;
  nif_blocked = false;
  nif_voxels = vec3<u32>(nif_header(10u), nif_header(11u), nif_header(12u));
  nif_levels = nif_header(9u);
  nif_voxel_words = nif_object + nif_header(13u);
  nif_children = nif_object + nif_header(14u);
  let scale : f32 = nif_number(7u);
  let grid_origin : vec3<f32> = (origin - nif_vector(nif_object + 4u)) * scale;
  let grid_direction : vec3<f32> = direction * scale;
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
  let least : f32 = nif_largest(grid_direction) * 9.094947017729282379150390625e-13;  // 2^-40
  for (var a : i32 = 0; a < 3; a++) {
    nif_flat[a] = abs(grid_direction[a]) < least;
    let inverse : f32 = 1.0 / (select(grid_direction[a], 1.0, nif_flat[a]));
    nif_inverse[a] = select(inverse, 0.0, nif_flat[a]);
    nif_direction[a] = select(grid_direction[a], 0.0, nif_flat[a]);
    nif_down[a] = nif_direction[a] < 0.0;
    let size : f32 = f32(nif_voxels[a] << nif_levels);
    let low : f32 = (0.0 - nif_origin[a]) * nif_inverse[a];
    let high : f32 = (size - nif_origin[a]) * nif_inverse[a];
    let first : f32 = select(low, high, nif_down[a]);
    let last : f32 = select(high, low, nif_down[a]);
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

// #if NIF_NETWORK
// ---- Sample points

// Word i of the table that begins where word k of the header says.
fn nif_table(k : u32, i : u32) -> u32 { return nif_word(nif_object + nif_header(k) + i); }

fn nif_byte(word : u32, k : u32) -> i32 { return i32(word << (24u - 8u * k)) >> 24; }

// First word of a brick of corners.
fn nif_brick(at : vec3<u32>) -> u32 {
  let bricks : vec3<u32> = (nif_voxels + 3u) / 4u;
  let number : u32 = at.x + bricks.x * (at.y + bricks.y * at.z);
  let word : u32 = nif_table(15u, number >> 4);
  let mark : u32 = 1u << (number & 15u);
  let below : u32 = u32(countOneBits(word & (mark - 1u)));
  return select(0u, 6u * (1u + (word >> 16) + below), (word & mark) != 0u);
}

// The two features of a corner at a place in a brick; NIF_NONE if that does not have them.
fn nif_pair(brick : u32, at : vec3<u32>) -> u32 {
  let layer : u32 = nif_table(16u, brick + 1u + at.z);
  let mark : u32 = 1u << (at.x + 5u * at.y);
  let i : u32 = nif_table(16u, brick) + (layer >> 25) + u32(countOneBits(layer & (mark - 1u)));
  let word : u32 = nif_table(17u, i >> 1);
  return select(NIF_NONE, (word >> (16u * (i & 1u))) & 0xffffu, (layer & mark) != 0u);
}

// Those of a corner in whichever brick has them; 0 if none has.
fn nif_pair_anywhere(corner : vec3<u32>) -> u32 {
  let first : vec3<u32> = (max(corner, vec3<u32>(1u)) - 1u) / 4u;
  let last : vec3<u32> = min(corner / 4u, (nif_voxels + 3u) / 4u - 1u);
  var pair : u32 = NIF_NONE;
  for (var k : u32 = 0u; k < 8u && pair == NIF_NONE; k++) {
    let at : vec3<u32> = min(first + vec3<u32>(k & 1u, (k >> 1) & 1u, k >> 2), last);
    pair = nif_pair(nif_brick(at), corner - 4u * at);
  }
  return select(pair, 0u, pair == NIF_NONE);
}

fn nif_feature(sum : i32) -> u32 { return u32((sum + (127 << 21) + (1 << 21)) >> 22); }

// The two inputs of a point: trilinear interpolation of the features of its voxel's corners, in integers.
fn nif_features(voxel : vec3<u32>, fraction : vec3<i32>) -> u32 {
  let brick : u32 = nif_brick(voxel / 4u);
  let rest : vec3<i32> = 128 - fraction;
  var sum_0 : i32 = 0;
  var sum_1 : i32 = 0;
  for (var k : u32 = 0u; k < 8u; k++) {
    let to : vec3<u32> = vec3<u32>(k & 1u, (k >> 1) & 1u, k >> 2);
    var pair : u32 = nif_pair(brick, (voxel & vec3<u32>(3u)) + to);
    if (pair == NIF_NONE) {  // rounding has moved the point out of the surface voxels
      pair = nif_pair_anywhere(voxel + to);
    }
    let share : i32 = (select(fraction.x, rest.x, to.x == 0u)) * (select(fraction.y, rest.y, to.y == 0u)) * (select(fraction.z, rest.z, to.z == 0u));
    sum_0 += share * nif_byte(pair, 0u);
    sum_1 += share * nif_byte(pair, 1u);
  }
  return nif_feature(sum_0) | (nif_feature(sum_1) << 8);
}

// Writes an input without an index that varies, which would put the array in memory.
fn nif_put(at : u32, word : u32) {
  for (var k : u32 = 0u; k < u32(NIF_NETWORK_WORDS); k++) {
    nif_input[k] = select(nif_input[k], word, k == at);
  }
}

// The sample points of one interval.
fn nif_place(begin : f32, end : f32, begin_height : f32, end_height : f32) {
  let last : bool = nif_count == nif_last;
  let samples : u32 = nif_header(18u);
  let length : f32 = end - begin;
  for (; nif_placed < samples; nif_placed++) {
    let s : f32 = (f32(nif_placed) + 0.5) * nif_spacing;
    let interval_end : f32 = nif_start + length;
    if (!last && s > interval_end) {
      nif_start = interval_end;
      return;
    }
    let along : f32 = begin + (s - nif_start);
    let t : f32 = nif_smaller(along, end);
    // Between the planes; 0 for an interval without length.
    let share : f32 = (t - begin) / (select(1.0, length, length > 0.0));
    let height : f32 = begin_height + (end_height - begin_height) * share + 0.5;
    let at : vec3<f32> = (nif_origin + t * nif_direction) * nif_number(8u);
    var voxel : vec3<u32>;
    var fraction : vec3<i32>;
    for (var a : i32 = 0; a < 3; a++) {
      let index : i32 = nif_to_index(at[a], i32(nif_voxels[a]) - 1);
      let nearest : f32 = (at[a] - f32(index)) * 128.0 + 0.5;
      voxel[a] = u32(index);
      fraction[a] = nif_to_index(nearest, 128);
    }
    let word : u32 = nif_features(voxel, fraction) | (select(0u, u32(nif_to_index(height, 127)) << 16, length > 0.0));
    nif_put(select(nif_placed, samples - 1u - nif_placed, nif_reversed), word);
  }
}
// #endif

// ---- Traversal

// The segment from t = nif_now to t = left in a cell with planes.
fn nif_pass_cell(word : u32, middle : vec3<f32>, size : f32, left : f32) {
  let u : i32 = i32((word >> 4) & 63u) - 31;
  let v : i32 = i32((word >> 10) & 63u) - 31;
  let normal : vec3<f32> = vec3<f32>(vec3<i32>(u + v, u - v, 62 - 2 * max(abs(u), abs(v))));
  let relative : vec3<f32> = nif_origin - middle;
  let enter_point : vec3<f32> = relative + nif_now * nif_direction;
  let leave_point : vec3<f32> = relative + left * nif_direction;
  let enter_height : f32 = nif_product(normal, enter_point);
  let leave_height : f32 = nif_product(normal, leave_point);
  let step_size : f32 = (31.0 * size + 1.0) * 0.0078125;  // exact, as all are that follow from size and word alone
  let lower : f32 = (f32((word >> 16) & 255u) - 128.0) * step_size;
  let upper : f32 = (f32((word >> 24) + 1u) - 128.0) * step_size;
  let enters_above : bool = enter_height > upper;
  let enters_below : bool = enter_height < lower;
  let leaves_above : bool = leave_height > upper;
  let leaves_below : bool = leave_height < lower;
  let kind : u32 = word & 15u;
  let wall : bool = ((0x3f00u >> kind) & 1u) != 0u;
  nif_blocked = wall && ((enters_above && leaves_below) || (enters_below && leaves_above));
  nif_seen |= select(0u, (0x06109610u >> (2u * kind)) & 3u, (enters_above || leaves_above));
  nif_seen |= select(0u, (0x04846484u >> (2u * kind)) & 3u, (enters_below || leaves_below));
  if ((enters_above && leaves_above) || (enters_below && leaves_below)) {
    return;
  }

  // The part between the planes.
  let climb : f32 = leave_height - enter_height;
  let rate : f32 = (left - nif_now) / (select(1.0, climb, climb != 0.0));
  let first_t : f32 = nif_now + ((select(lower, upper, enters_above)) - enter_height) * rate;
  let last_t : f32 = nif_now + ((select(lower, upper, leaves_above)) - enter_height) * rate;
  let begin : f32 = select(nif_now, nif_smaller(nif_larger(first_t, nif_now), left), (enters_above || enters_below));
  let end : f32 = select(left, nif_smaller(nif_larger(last_t, begin), left), (leaves_above || leaves_below));
  nif_count++;
// #if NIF_NETWORK
  if (nif_placing) {
    let scale : f32 = 127.0 / (upper - lower);
    let enters : f32 = (enter_height - lower) * scale + 0.5;
    let leaves : f32 = (leave_height - lower) * scale + 0.5;
    nif_place(begin, end, f32(nif_to_index(enters, 127)), f32(nif_to_index(leaves, 127)));
    return;
  }
// #endif
  if (nif_count == 1u) {
    nif_starts_open = begin == nif_enter && !nif_enters;
    nif_open_begin = nif_now;
  }
  nif_ends_open = end == nif_leave && !nif_leaves;
  nif_open_end = left;
  nif_open_t = nif_open_t + (end - begin);
}

// One skip through empty space, or one cell. Returns false if the traversal is over.
fn nif_next() -> bool {
  let cells : vec3<i32> = vec3<i32>(nif_voxels << vec3<u32>(nif_levels));
  let at : vec3<i32> = clamp(vec3<i32>(select(nif_cell.x, -1 - nif_cell.x, nif_down.x), select(nif_cell.y, -1 - nif_cell.y, nif_down.y), select(nif_cell.z, -1 - nif_cell.z, nif_down.z)), vec3<i32>(0), cells - 1);
  let voxel : vec3<u32> = vec3<u32>(at) >> vec3<u32>(nif_levels);
  var word : u32 = nif_word(nif_voxel_words + voxel.x + nif_voxels.x * (voxel.y + nif_voxels.y * voxel.z));
  var level : u32 = nif_levels;
  for (; level > 0u && (word & 15u) == 15u; ) {
    level--;
    let upper : vec3<u32> = (vec3<u32>(at) >> vec3<u32>(level)) & vec3<u32>(1u);
    let child : u32 = 1u << (upper.x | (upper.y << 1) | (upper.z << 2));
    let mask : u32 = (word >> 4) & 255u;
    if ((mask & child) != 0u) {
      word = nif_word(nif_children + (word >> 12) + u32(countOneBits(mask & (child - 1u))));
    } else {
      word = 14u;  // no triangle, and nothing is known of its side
    }
  }

  // Where the segment leaves the box or the cell.
  let is_empty : bool = (word & 15u) == 14u;
  let box : u32 = select(0u, word, (is_empty && nif_near));
  let size : i32 = 1 << level;
  let low : vec3<i32> = vec3<i32>((vec3<u32>(at) >> vec3<u32>(level)) << vec3<u32>(level));
  var leaving : vec3<f32>;
  for (var a : i32 = 0; a < 3; a++) {
    let extent : u32 = (box >> (8u + 8u * u32(a) + (select(4u, 0u, nif_down[a])))) & 15u;
    let reach : i32 = i32(extent) * size;
    var plane : f32 = f32(select(low[a] + size + reach, low[a] - reach, nif_down[a]));
    var crossing : f32 = (plane - nif_origin[a]) * nif_inverse[a];
    leaving[a] = select(crossing, nif_infinity(), nif_flat[a]);
  }
  let t : f32 = nif_smaller(nif_smaller(leaving.x, leaving.y), leaving.z);
  let ends : bool = !(t < nif_leave);
  let left : f32 = nif_larger(select(t, nif_leave, ends), nif_now);
  if (is_empty) {
    nif_seen |= (word >> 4) & 3u;
  } else {
    let middle : vec3<f32> = vec3<f32>(low) + 0.5 * f32(size);  // exact
    nif_pass_cell(word, middle, f32(size), left);
  }
  nif_blocked = nif_blocked || nif_seen == 3u;
  nif_now = left;
  if (nif_blocked || ends) {
    return false;
  }

  // The cell behind it. Along each axis its number is estimated from below, by at most 1 too little, and corrected
  // by a crossing; those of lower axes at the same t come first. Far away each plane is tested. One loop for all, whose end no
  // compiler knows: they would unroll it, and drivers that run several rays together would do all of it for each.
  let reached : vec3<f32> = nif_origin + nif_direction * t;
  var cell : vec3<i32> = nif_cell;
  if (nif_near) {
    for (var a : i32 = 0; a < 3; a++) {
      let lowered : f32 = (select(reached[a], -reached[a], nif_down[a])) - 0.03125;
      cell[a] = max(i32(clamp(floor(lowered), -1025.0, 1025.0)), cell[a]);
    }
  }
  var passes : vec3<bool> = vec3<bool>(true);
  for (var k : i32 = 0; k < size && (passes.x || passes.y || passes.z); k++) {
    for (var a : i32 = 0; a < 3; a++) {
      let later : bool = (a > 0 && leaving.x == t) || (a > 1 && leaving.y == t);
      let next : i32 = cell[a] + 1;
      let plane : f32 = f32(select(next, -next, nif_down[a]));
      let crossing : f32 = (plane - nif_origin[a]) * nif_inverse[a];
      let crossed : bool = passes[a] && !nif_flat[a] && (crossing < t || (crossing == t && !later));
      cell[a] = select(cell[a], next, crossed);
      passes[a] = crossed && !nif_near && (next & (size - 1)) != 0;
    }
  }
  nif_cell = cell;
  return true;
}

// #if NIF_NETWORK
// ---- The network

// No input is above 127.
fn nif_dot(weights : u32, inputs : u32) -> i32 {
  return nif_byte(weights, 0u) * i32(inputs & 255u) + nif_byte(weights, 1u) * i32((inputs >> 8) & 255u) + nif_byte(weights, 2u) * i32((inputs >> 16) & 255u) + nif_byte(weights, 3u) * i32(inputs >> 24);
}

// The sum of one neuron, whose row of weights begins at a word.
fn nif_neuron(row : u32, words : u32) -> i32 {
  var sum : i32 = i32(nif_word(row));
  for (var k : u32 = 0u; k < u32(NIF_NETWORK_WORDS); k++) {
    if (k < words) {
      sum += nif_dot(nif_word(row + 1u + k), nif_input[k]);
    }
  }
  return sum;
}

// The inputs that belong to no point: direction, length, flags.
fn nif_put_globals(samples : u32) {
  let length : f32 = sqrt(nif_product(nif_direction, nif_direction));
  let unit : vec3<f32> = nif_direction / length;
  let way : vec3<f32> = 64.0 + 63.5 * (select(unit, -unit, nif_reversed));
  let open : f32 = nif_open_t * length * nif_number(19u) + 0.5;
  nif_put(samples, u32(nif_to_index(way.x, 127)) | (u32(nif_to_index(way.y, 127)) << 8) | (u32(nif_to_index(way.z, 127)) << 16) | (u32(nif_to_index(open, 127)) << 24));
  let starts : bool = select(nif_starts_open, nif_ends_open, nif_reversed);
  let ends : bool = select(nif_ends_open, nif_starts_open, nif_reversed);
  nif_put(samples + 1u, ((nif_seen & 1u) * 0x7fu) | ((nif_seen >> 1) * 0x7f00u) | (select(0u, 0x7f0000u, starts)) | (select(0u, 0x7f000000u, ends)));
}

// The network's output for nif_input.
fn nif_evaluate() -> i32 {
  let layers : u32 = min(nif_header(20u), 4u);
  for (var l : u32 = 0u; l < layers; l++) {
    var row : u32 = nif_object + nif_header(24u + 4u * l);
    let words : u32 = nif_header(25u + 4u * l);
    let shift : u32 = nif_header(27u + 4u * l);
    if (l + 1u == layers) {
      return nif_neuron(row, words);
    }
    let groups : u32 = nif_header(26u + 4u * l) >> 2;
    for (var w : u32 = 0u; w < groups; w++) {
      var four : u32 = 0u;
      for (var k : u32 = 0u; k < 4u; k++) {
        let sum : i32 = nif_neuron(row, words) + ((1 << shift) >> 1);
        four |= min(u32(max(sum, 0)) >> shift, 127u) << (8u * k);
        row += words + 1u;
      }
      for (var k : u32 = 0u; k < u32(NIF_NETWORK_WORDS); k++) {
        nif_output[k] = select(nif_output[k], four, k == w);
      }
    }
    for (var k : u32 = 0u; k < u32(NIF_NETWORK_WORDS); k++) {
      nif_input[k] = nif_output[k];
    }
  }
  return -1;
}
// #endif

// By planes, and if `learned` by the network about what they leave open, if there is one.
fn nif_ask_planes(origin : vec3<f32>, direction : vec3<f32>, tmin : f32, tmax : f32, learned : bool) -> NifAnswer {
  var answer : NifAnswer = nif_unknown(tmin, tmax);
  var goes_on : bool = nif_enter_grid(origin, direction, tmin, tmax);
// #if NIF_NETWORK
  let samples : u32 = nif_header(18u);
  let has_network : bool = learned && (nif_header(3u) & 1u) != 0u && nif_header(21u) <= u32(NIF_NETWORK_WORDS);
  nif_placing = false;
// #endif
  if (goes_on) {
    nif_begin();
  }
  // Each step goes at least one cell along an axis, and a ray is traversed at most twice.
  for (var k : i32 = 0; k < 2 * (3 * 1024 + 2) && goes_on; k++) {
    goes_on = nif_next();
// #if NIF_NETWORK
    if (!goes_on && !nif_placing && !nif_blocked && nif_count > 0u && has_network) {
      // From the end that makes the direction point up.
      let d : vec3<f32> = nif_direction;
      nif_reversed = d.z < 0.0 || (d.z == 0.0 && (d.y < 0.0 || (d.y == 0.0 && d.x < 0.0)));
      for (var w : u32 = 0u; w < u32(NIF_NETWORK_WORDS); w++) {
        nif_input[w] = 0u;
        nif_output[w] = 0u;
      }
      nif_put_globals(samples);
      nif_spacing = nif_open_t / f32(samples);
      nif_last = nif_count;
      nif_placed = 0u;
      nif_start = 0.0;
      nif_placing = true;
      nif_begin();
      goes_on = true;
    }
// #endif
  }
  if (goes_on) {
    return answer;
  }
  if (nif_blocked || nif_count == 0u) {
    return nif_known(!nif_blocked, NIF_PROVES && nif_near && (nif_header(3u) & 2u) != 0u, tmin, tmax);
  }

  // The interval in which the caller's own triangles can decide: a voxel longer at each end.
  let culling_reach : f32 = 0.25 * NIF_CERTAIN_REACH;
  if (nif_largest(nif_origin) <= culling_reach) {
    let voxel : f32 = f32(1u << nif_levels) / nif_largest(nif_direction);
    let begin : f32 = nif_open_begin - voxel;
    let end : f32 = nif_open_end + voxel;
    answer.open_begin = nif_larger(begin, tmin);
    answer.open_end = nif_smaller(end, tmax);
  }
// #if NIF_NETWORK
  if (nif_placing) {
    answer.logit = nif_evaluate();
    answer.visible = answer.logit >= 0;
    let odds : f32 = f32(answer.logit + i32(nif_header(23u))) * nif_number(22u);
    let probability : f32 = 1.0 / (1.0 + exp(-odds));
    answer.probability = probability;
  }
// #endif
  return answer;
}
// #endif

// #if NIF_TRIANGLES
// ---- Triangles: a tree of boxes whose nodes lie depth first, so that no stack is needed. The triangle's vectors are turned
// to end with the axis along which the ray moves most, and sheared so that the ray runs along it.

var<private> nif_steep : u32;  // that axis
var<private> nif_steepest : f32;  // the direction along it, without its sign
var<private> nif_from : vec3<f32>;  // the ray's origin, turned
var<private> nif_slope_x : f32; var<private> nif_slope_y : f32;
var<private> nif_per_unit : f32;  // t for a unit along that axis
var<private> nif_error_share : f32;  // sheared coordinates are off by less than this share of the distance, and nif_error_least
var<private> nif_error_least : f32;
var<private> nif_in_reach : bool;  // of proofs
var<private> nif_back : vec3<bool>;  // where the direction is negative
var<private> nif_box_step : vec3<f32>; var<private> nif_box_near : vec3<f32>; var<private> nif_box_far : vec3<f32>;  // boxes count t by nif_steepest
var<private> nif_box_enter : f32; var<private> nif_box_leave : f32;
var<private> nif_tmin : f32; var<private> nif_tmax : f32;
var<private> nif_looks_for_first : bool;  // else for any triangle
var<private> nif_met : bool; var<private> nif_met_surely : bool;  // one, as single precision says
var<private> nif_doubtful : bool;  // there is a triangle of which rounding decides whether it is met
var<private> nif_found : bool;  // no other triangle matters
var<private> nif_hit_surely : bool;  // the nearest one
var<private> nif_hit_t : f32;
var<private> nif_hit_low : f32; var<private> nif_hit_high : f32;  // it is met from here to here
var<private> nif_hit_u : f32; var<private> nif_hit_v : f32;
var<private> nif_hit_triangle : u32;
var<private> nif_hit_corners : u32;  // their word
var<private> nif_hit_vertex : u32;  // the first of the leaf
var<private> nif_hit_object : u32;
var<private> nif_hit_instance : u32;  // its first word, or NIF_NONE
var<private> nif_others_low : f32;  // none of the others is met before

fn nif_least(v : vec3<f32>) -> f32 { return nif_smaller(v.z, nif_smaller(v.y, v.x)); }
fn nif_most(v : vec3<f32>) -> f32 { return nif_larger(v.z, nif_larger(v.y, v.x)); }
fn nif_turn(v : vec3<f32>) -> vec3<f32> { return select((select(vec3<f32>(v.z, v.x, v.y), vec3<f32>(v.y, v.z, v.x), nif_steep == 0u)), v, nif_steep == 2u); }

// Prepares a ray for the object's triangles. Returns false if it meets none, without a look at them. `moved`: the sum of
// magnitudes from which an instance's transform has made the origin, or negative.
fn nif_enter_tree(origin : vec3<f32>, direction : vec3<f32>, tmin : f32, tmax : f32, moved : f32) -> bool {
  let extent : f32 = nif_number(53u);
  let far : f32 = nif_largest(origin);
  let reach : f32 = nif_larger(far, extent);
  nif_steepest = nif_largest(direction);
  let farthest : f32 = extent * 4294967296.0;
  let near_at_all : bool = far <= farthest && reach <= 2.305843009213693952e18;  // 2^61
  if (!nif_all_finite(origin) || !nif_moves(direction) || !nif_has_points(tmin, tmax) || !near_at_all) {
    return false;
  }
  let steep : vec3<f32> = abs(direction);
  nif_steep = select((select(0u, 1u, steep.y > steep.x)), 2u, steep.z > nif_larger(steep.x, steep.y));
  nif_from = nif_turn(origin);
  let turned : vec3<f32> = nif_turn(direction);
  nif_slope_x = turned.x / turned.z;
  nif_slope_y = turned.y / turned.z;
  nif_per_unit = 1.0 / turned.z;
  nif_tmin = tmin;
  nif_tmax = tmax;

  // How far rounding may move it, and what is too far away, too small or too large for that bound (docs/shaders.md).
  let is_moved : bool = moved >= 0.0;
  nif_error_share = select(9.5367431640625e-7, 3.814697265625e-6, is_moved);  // 2^-18, 2^-20
  let error_moved : f32 = moved * 1.9073486328125e-6;  // 2^-19
  nif_error_least = reach * 9.31322574615478515625e-10 + (select(0.0, error_moved, is_moved));  // 2^-30
  let near : f32 = extent * 1024.0;
  let proves : bool = NIF_PROVES && (nif_header(3u) & 2u) != 0u;
  // At most 1024 extents away; from 2^-30 to 2^36; a direction from 2^-40 to 2^40.
  let near_enough : bool = reach <= near && reach <= 6.8719476736e10 && extent >= 9.31322574615478515625e-10;
  let steep_enough : bool = nif_steepest <= 1.099511627776e12 && nif_steepest >= 9.094947017729282379e-13;
  nif_in_reach = proves && near_enough && steep_enough;

  // Boxes grow by more than any of that, up to where they would no longer be of use.
  let useful : f32 = extent * 2048.0;
  let counted : f32 = nif_smaller(reach, useful);
  let padding : f32 = counted * 3.814697265625e-6 + counted * (nif_error_share * 4.0) + nif_error_least * 2.0;
  var outward : vec3<f32>;
  var way : vec3<f32>;
  for (var a : i32 = 0; a < 3; a++) {
    nif_back[a] = direction[a] < 0.0;
    let share : f32 = steep[a] / nif_steepest;
    let size : f32 = nif_larger(share, 9.31322574615478515625e-10);  // 2^-30
    way[a] = select(size, -size, nif_back[a]);
    outward[a] = select(padding, -padding, nif_back[a]);
  }
  let inverse : vec3<f32> = 1.0 / way;
  let corner : vec3<f32> = nif_vector(nif_object + 54u);
  nif_box_step = nif_vector(nif_object + 57u) * inverse;
  nif_box_near = (corner - (origin + outward)) * inverse;
  nif_box_far = (corner - (origin - outward)) * inverse;
  let last : f32 = reach * 4.0 / nif_steepest;  // nothing is met beyond
  nif_box_enter = nif_larger(tmin, -last) * nif_steepest;
  nif_box_leave = nif_smaller(nif_smaller(tmax, nif_hit_high), last) * nif_steepest;
  return true;
}

// Does the ray perhaps meet something in a node's box?
fn nif_meets_box(at : u32) -> bool {
  let words : vec3<u32> = vec3<u32>(nif_word(at), nif_word(at + 1u), nif_word(at + 2u));
  let low : vec3<f32> = vec3<f32>(words & vec3<u32>(65535u));
  let high : vec3<f32> = vec3<f32>(words >> vec3<u32>(16u));
  let first : vec3<f32> = vec3<f32>(select(low.x, high.x, nif_back.x), select(low.y, high.y, nif_back.y), select(low.z, high.z, nif_back.z));
  let last : vec3<f32> = vec3<f32>(select(high.x, low.x, nif_back.x), select(high.y, low.y, nif_back.y), select(high.z, low.z, nif_back.z));
  let enters : vec3<f32> = first * nif_box_step + nif_box_near;
  let leaves : vec3<f32> = last * nif_box_step + nif_box_far;
  return nif_larger(nif_most(enters), nif_box_enter) <= nif_smaller(nif_least(leaves), nif_box_leave);
}

// Does the ray meet a triangle? Both triangles of an edge see it by the same numbers, so that no ray passes between them.
// Returns false if it certainly does not; then nothing else is set.
fn nif_meet_triangle(p : vec3<f32>, q : vec3<f32>, r : vec3<f32>, triangle : u32) -> bool {
  let to_p : vec3<f32> = nif_turn(p) - nif_from;
  let to_q : vec3<f32> = nif_turn(q) - nif_from;
  let to_r : vec3<f32> = nif_turn(r) - nif_from;
  let depths : vec3<f32> = vec3<f32>(to_p.z, to_q.z, to_r.z);
  let x : vec3<f32> = vec3<f32>(to_p.x, to_q.x, to_r.x) - depths * nif_slope_x;
  let y : vec3<f32> = vec3<f32>(to_p.y, to_q.y, to_r.y) - depths * nif_slope_y;
  let sides : vec3<f32> = x.zxy * y.yzx - y.zxy * x.yzx;

  // Bounds of their errors: e (|x| + |y| of both ends of the edge + e) 2, where e is that of a sheared coordinate.
  let distance : f32 = nif_larger(nif_largest(to_p), nif_larger(nif_largest(to_q), nif_largest(to_r)));
  let error : f32 = distance * nif_error_share + nif_error_least;
  let error_2 : f32 = error * 2.0;
  let sizes : vec3<f32> = abs(x) + abs(y);
  let bounds : vec3<f32> = (sizes.zxy + sizes.yzx + error) * error_2;
  let left : bool = sides.x > bounds.x || sides.y > bounds.y || sides.z > bounds.z;
  let right : bool = sides.x < -bounds.x || sides.y < -bounds.y || sides.z < -bounds.z;
  if (left && right) {
    return false;  // beside it
  }
  let arrivals : vec3<f32> = depths * nif_per_unit;
  let slack : f32 = error_2 * abs(nif_per_unit);
  var low : f32 = nif_least(arrivals) - slack;
  var high : f32 = nif_most(arrivals) + slack;
  if (low > nif_tmax || high < nif_tmin || low > nif_hit_high) {
    return false;
  }

  let sum : f32 = sides.x + sides.y + sides.z;
  let inside : bool = (nif_least(sides) >= 0.0 || nif_most(sides) <= 0.0) && sum != 0.0;
  var surely : bool = (sides.x > bounds.x && sides.y > bounds.y && sides.z > bounds.z) || (sides.x < -bounds.x && sides.y < -bounds.y && sides.z < -bounds.z);
  let per_sum : f32 = 1.0 / (select(1.0, sum, sum != 0.0));
  let weights : vec3<f32> = sides * per_sum;
  let t : f32 = nif_product(weights, depths) * nif_per_unit;
  if (surely) {
    let off : f32 = (bounds.x + bounds.y + bounds.z) * abs(per_sum);
    let around : f32 = (nif_most(arrivals) - nif_least(arrivals)) * off + slack * 2.0;
    low = t - around;
    high = t + around;
    if (low > nif_tmax || high < nif_tmin) {
      return false;
    }
    surely = low >= nif_tmin && high <= nif_tmax;
  }
  let met : bool = inside && nif_tmin <= t && t <= nif_tmax;
  nif_met = nif_met || met;
  nif_met_surely = nif_met_surely || surely;
  nif_doubtful = nif_doubtful || !surely;
  if (!nif_looks_for_first) {
    nif_found = nif_met_surely || (met && !nif_in_reach);
    return met;
  }
  let nearer : bool = met && (t < nif_hit_t || (t == nif_hit_t && triangle < nif_hit_triangle));
  nif_others_low = nif_smaller(select(low, nif_hit_low, nearer), nif_others_low);
  if (nearer) {
    nif_hit_t = t;
    nif_hit_low = low;
    nif_hit_high = high;
    nif_hit_u = weights.y;
    nif_hit_v = weights.z;
    nif_hit_triangle = triangle;
    nif_hit_surely = surely;
    let leave : f32 = high * nif_steepest;
    nif_box_leave = nif_smaller(leave, nif_box_leave);
  }
  return nearer;
}

// Every step goes on in the buffer, because a tree has no link back. Some devices end long loops early: then nothing is
// proven. `instance`: for nif_hit_instance.
fn nif_walk_tree(instance : u32) {
  let tree : u32 = nif_object + nif_header(48u);
  let end : u32 = nif_object + nif_header(49u);
  let vertices : u32 = nif_object + nif_header(50u);
  var at : u32 = tree;
  for (; at < end && !nif_found; ) {
    let link : u32 = nif_word(at + 3u);
    let count : u32 = select(0u, link & 7u, (link & 0x80000000u) != 0u);
    var next : u32 = select(tree + link, at + 6u + count, count != 0u);
    if (nif_meets_box(at)) {
      next = select(at + 4u, next, count != 0u);
      var k : u32 = 0u;
      for (; k < count && !nif_found; k++) {
        let corners : u32 = nif_word(at + 6u + k);
        let first : u32 = nif_word(at + 4u);
        let p : u32 = vertices + 3u * (first + (corners & 255u));
        let q : u32 = vertices + 3u * (first + ((corners >> 8) & 255u));
        let r : u32 = vertices + 3u * (first + ((corners >> 16) & 255u));
        if (nif_meet_triangle(nif_vector(p), nif_vector(q), nif_vector(r), nif_word(at + 5u) + k)) {
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
fn nif_leave_boxes_outside(begin : f32, end : f32) {
  let enter : f32 = begin * nif_steepest;
  let leave : f32 = end * nif_steepest;
  nif_box_enter = nif_larger(enter, nif_box_enter);
  nif_box_leave = nif_smaller(leave, nif_box_leave);
}

// Before the first triangle.
fn nif_forget_triangles(first : bool) {
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
fn nif_ask_triangles(by_planes : NifAnswer) -> NifAnswer {
  nif_leave_boxes_outside(by_planes.open_begin, by_planes.open_end);
  nif_walk_tree(NIF_NONE);
  if (nif_in_reach && (nif_met_surely || !nif_doubtful)) {
    return nif_known(!nif_met, true, by_planes.open_begin, by_planes.open_end);
  }
  return NifAnswer(!nif_met, false, select(0, -1, nif_met), 0.5, by_planes.open_begin, by_planes.open_end, NIF_NONE);
}
// #endif

// ---- Queries

// Goes to an object. Returns false if this file does not read its tables.
fn nif_enter_object(object : u32) -> bool {
  nif_object = object;
  var parts : u32 = 3u;
// #if NIF_TRIANGLES
  parts |= 4u;
// #endif
// #if NIF_PLANES
  parts |= 8u;
// #endif
  return nif_header(0u) == 0x5346494eu && nif_header(1u) == 2u && (nif_header(3u) | parts) == parts;
}

// The whole of it. `moved`: as for nif_enter_tree(). Planes are asked in one place, because compilers that copy each function
// to its callers would otherwise have that traversal twice.
fn nif_ask(object : u32, origin : vec3<f32>, direction : vec3<f32>, tmin : f32, tmax : f32, learned : bool, moved : f32) -> NifAnswer {
  var answer : NifAnswer = nif_unknown(tmin, tmax);
  if (!nif_enter_object(object)) {
    return answer;
  }
  let flags : u32 = nif_header(3u);
// #if NIF_TRIANGLES
  if ((flags & 4u) != 0u) {
    nif_forget_triangles(false);
    if (!nif_enter_tree(origin, direction, tmin, tmax, moved)) {
      return nif_known(true, NIF_PROVES && (flags & 2u) != 0u && nif_no_points(tmin, tmax), tmin, tmax);
    }
  }
// #endif
// #if NIF_PLANES
  if ((flags & 8u) != 0u) {
    answer = nif_ask_planes(origin, direction, tmin, tmax, learned);
  }
// #endif
// #if NIF_TRIANGLES
  if ((flags & 4u) != 0u && !answer.certain) {
    answer = nif_ask_triangles(answer);
  }
// #endif
  return answer;
}

// What proofs alone say: a valid ray that is not certain is open, and counts as occluded.
fn nif_or_open(answer : NifAnswer, valid : bool) -> NifAnswer {
  if (answer.certain || (answer.visible && !valid)) {
    return answer;
  }
  var open : NifAnswer = answer;
  open.visible = false;
  open.logit = -1;
  open.probability = 0.5;
  return open;
}

// #if NIF_SCENES
// ---- Scenes

// Whether a valid ray may meet the box of an instance. A ray that does not certainly misses it, from anywhere.
fn nif_may_meet(box : u32, origin : vec3<f32>, direction : vec3<f32>, tmin : f32, tmax : f32) -> bool {
  let low : vec3<f32> = nif_vector(box);
  let high : vec3<f32> = nif_vector(box + 3u);
  var enter : f32 = -nif_infinity();
  var leave : f32 = nif_infinity();
  for (var a : i32 = 0; a < 3; a++) {
    let moves : bool = abs(direction[a]) >= 1.17549435082228751e-38;  // 2^-126
    if (!moves && !(low[a] < origin[a] && origin[a] < high[a])) {
      return false;
    }
    if (moves) {
      let inverse : f32 = 1.0 / direction[a];
      let t_low : f32 = (low[a] - origin[a]) * inverse;
      let t_high : f32 = (high[a] - origin[a]) * inverse;
      enter = nif_larger(nif_smaller(t_low, t_high), enter);
      leave = nif_smaller(nif_larger(t_high, t_low), leave);
    }
  }
  let enter_less : f32 = enter * 0.9999847412109375;  // 1 - 2^-16
  let enter_more : f32 = enter * 1.0000152587890625;
  let first : f32 = nif_smaller(enter_less, enter_more) - 7.34683969e-40;  // 2^-130
  let leave_less : f32 = leave * 0.9999847412109375;
  let leave_more : f32 = leave * 1.0000152587890625;
  let last : f32 = nif_larger(leave_less, leave_more) + 7.34683969e-40;
  let begin : f32 = nif_larger(nif_smaller(first, 1.70141183460469232e38), tmin);  // 2^127
  let end : f32 = nif_smaller(nif_larger(last, -1.70141183460469232e38), tmax);
  return begin <= end;
}

var<private> nif_local_object : u32;
var<private> nif_local_origin : vec3<f32>;
var<private> nif_local_direction : vec3<f32>;
var<private> nif_local_moved : f32;  // as for nif_enter_tree()
var<private> nif_local_stays : bool;  // what is proven in object space is so in the world

// Three rows times v.
fn nif_rows(x : vec3<f32>, y : vec3<f32>, z : vec3<f32>, v : vec3<f32>) -> vec3<f32> { return vec3<f32>(nif_product(x, v), nif_product(y, v), nif_product(z, v)); }

// Takes a ray to the space of an instance whose words begin at `at`: sets nif_local_origin and what follows it.
fn nif_enter_instance(scene : u32, at : u32, origin : vec3<f32>, direction : vec3<f32>, tmin : f32, tmax : f32) {
  let word : u32 = nif_word(at + 21u);
  nif_local_object = scene + (word & 0x1fffffffu);
  nif_local_origin = origin;
  nif_local_direction = direction;
  nif_local_moved = -1.0;
  var stays : bool = true;
  if ((word & 0x20000000u) == 0u) {  // not the identity
    let x : vec3<f32> = nif_vector(at);
    let y : vec3<f32> = nif_vector(at + 3u);
    let z : vec3<f32> = nif_vector(at + 6u);
    let remainder : vec3<f32> = nif_vector(at + 12u);
    let relative : vec3<f32> = origin - nif_vector(at + 9u) - remainder;
    nif_local_origin = nif_rows(x, y, z, relative);
    nif_local_direction = nif_rows(x, y, z, direction);
    // Whether a proof for the ray in object space holds in the world: rounding must move it little.
    let reach : f32 = nif_largest(nif_rows(abs(x), abs(y), abs(z), abs(relative)));
    let spread : f32 = nif_largest(nif_rows(abs(x), abs(y), abs(z), abs(direction)));
    let remains : bool = remainder.x != 0.0 || remainder.y != 0.0 || remainder.z != 0.0;
    let longer : f32 = reach * 1.25;
    nif_local_moved = select(reach, longer, remains);
    let cells : f32 = nif_local_moved * nif_float(nif_local_object + 47u);
    let most : f32 = NIF_CERTAIN_REACH * 0.125;
    let times : f32 = NIF_CERTAIN_REACH * 0.000244140625;  // 4 for the CPU's reach
    let wide : f32 = times * nif_largest(nif_local_direction);
    stays = tmin > tmax || ((word & 0x40000000u) != 0u && cells <= most && spread <= wide);
  }
  nif_local_stays = stays && (word & 0x80000000u) == 0u;
}

// The answer of one instance for a ray in world space.
fn nif_ask_instance(scene : u32, at : u32, origin : vec3<f32>, direction : vec3<f32>, tmin : f32, tmax : f32, learned : bool) -> NifAnswer {
  nif_enter_instance(scene, at, origin, direction, tmin, tmax);
  var answer : NifAnswer = nif_ask(nif_local_object, nif_local_origin, nif_local_direction, tmin, tmax, learned, nif_local_moved);
  if (!nif_local_stays) {
    answer.certain = false;
    answer.open_begin = tmin;
    answer.open_end = tmax;
  }
  return answer;
}

fn nif_is_scene(scene : u32) -> bool { return nif_word(scene) == 0x4346494eu && nif_word(scene + 1u) == 2u; }

// The answers of all instances joined: one that blocks the ray is enough.
fn nif_ask_scene(scene : u32, origin : vec3<f32>, direction : vec3<f32>, tmin : f32, tmax : f32, mask : u32, learned : bool) -> NifAnswer {
  if (!nif_is_scene(scene)) {
    return nif_unknown(tmin, tmax);
  }
  let proves : bool = NIF_PROVES && (nif_word(scene + 3u) & 2u) != 0u;
  let valid : bool = nif_is_valid(origin, direction, tmin, tmax);
  var all_certain : bool = proves && (valid || nif_no_points(tmin, tmax));
  var blocked : bool = false;
  var joined : NifAnswer = nif_known(true, all_certain, tmin, tmax);
  if (proves) {  // else what proves nothing may block the ray anywhere
    joined.open_begin = nif_infinity();
    joined.open_end = -nif_infinity();
  }
  let alone : bool = nif_word(scene + 4u) == 1u;  // then its box is not asked, as by the CPU
  var node : u32 = scene + nif_word(scene + 11u);
  let end : u32 = scene + nif_word(scene + 12u);
  for (; node < end && !blocked; ) {
    let meets : bool = alone || (valid && nif_may_meet(node, origin, direction, tmin, tmax));
    let list : u32 = nif_word(node + 7u);
    var at : u32 = scene + 16u + 24u * (list >> 3);
    let here : u32 = select(0u, list & 7u, meets);
    var i : u32 = 0u;
    for (; i < here && !blocked; i++) {
      if ((nif_word(at + 22u) & mask) != 0u && (alone || nif_may_meet(at + 15u, origin, direction, tmin, tmax))) {
        let answer : NifAnswer = nif_ask_instance(scene, at, origin, direction, tmin, tmax, learned);
        all_certain = (alone || all_certain) && answer.certain;
        blocked = answer.certain && answer.logit < 0;
        if (answer.logit < min(joined.logit, 0)) {
          joined.instance = nif_word(at + 23u);
        }
        joined.logit = min(joined.logit, answer.logit);
        let probability : f32 = joined.probability * answer.probability;
        joined.probability = probability;
        if (!answer.certain) {
          joined.open_begin = nif_smaller(answer.open_begin, joined.open_begin);
          joined.open_end = nif_larger(answer.open_end, joined.open_end);
        }
      }
      at += 24u;
    }
    all_certain = all_certain && i == here;
    node = select(scene + nif_word(node + 6u), node + 8u, meets);
  }
  all_certain = all_certain && node >= end;
  joined.visible = joined.logit >= 0;
  joined.certain = select(blocked, all_certain, joined.visible);
  return joined;
}
// #endif

// #if NIF_TRIANGLES && NIF_FIRST_HITS
// ---- First hits

// Looks for a nearer triangle in one object. `stays`: what is proven for this ray is so in the world.
fn nif_find_first(object : u32, origin : vec3<f32>, direction : vec3<f32>, tmin : f32, tmax : f32, moved : f32, stays : bool, instance : u32) {
  let flags : u32 = select(0u, nif_header(3u), nif_enter_object(object));
  let has_triangles : bool = (flags & 4u) != 0u;
  var answer : NifAnswer = nif_unknown(tmin, tmax);
// #if NIF_PLANES
  if ((flags & 8u) != 0u) {
    answer = nif_ask_planes(origin, direction, tmin, tmax, false);
  }
// #endif
  let passes : bool = answer.certain && answer.visible;
  var proves : bool = passes && stays;
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
    nif_others_low = nif_smaller(select(answer.open_begin, -nif_infinity(), has_triangles || !stays), nif_others_low);
  }
}

// Which triangle of the source mesh it is, if the object knows; otherwise its own number.
fn nif_source_triangle(triangle : u32) -> u32 {
  let bits : u32 = nif_header(52u);
  if (bits == 0u) {
    return triangle;
  }
  let before : u32 = (triangle & 31u) * bits;
  let at : u32 = nif_object + nif_header(51u) + (triangle >> 5) * bits + (before >> 5);
  let shift : u32 = before & 31u;
  let low : u32 = nif_word(at) >> shift;
  let high : u32 = nif_word(at + 1u) << ((32u - shift) & 31u);
  return (low | (select(0u, high, shift != 0u))) & (0xffffffffu >> (32u - bits));
}

// v in unit length, or 0.
fn nif_unit(v : vec3<f32>) -> vec3<f32> {
  let largest : f32 = nif_largest(v);
  let scaled : vec3<f32> = v / (select(1.0, largest, largest > 0.0));
  let length : f32 = sqrt(nif_product(scaled, scaled));
  let unit : vec3<f32> = scaled / (select(1.0, length, length > 0.0));
  return unit;
}

// #if NIF_PLANES
// The packed colour of a voxel; NIF_NONE if it has none.
fn nif_packed_color(voxel : vec3<i32>) -> u32 {
  let voxels : vec3<u32> = vec3<u32>(nif_header(10u), nif_header(11u), nif_header(12u));
  let at : vec3<u32> = vec3<u32>(voxel);  // a negative one becomes large
  if (at.x >= voxels.x || at.y >= voxels.y || at.z >= voxels.z) {
    return NIF_NONE;
  }
  let bricks : vec3<u32> = voxels / 4u + 1u;
  let brick : vec3<u32> = at / 4u;
  let number : u32 = brick.x + bricks.x * (brick.y + bricks.y * brick.z);
  let entry : u32 = (nif_word(nif_object + nif_header(60u) + (number >> 1)) >> (16u * (number & 1u))) & 0xffffu;
  if (entry < 3u) {
    return NIF_NONE;  // a brick without surface
  }
  let record : u32 = nif_object + nif_header(61u) + 3u * (entry - 3u);
  let bit : u32 = (at.x & 3u) | ((at.y & 3u) << 2) | ((at.z & 3u) << 4);
  let mask : u32 = nif_word(record + 1u + (bit >> 5));
  let mark : u32 = 1u << (bit & 31u);
  let before : u32 = select(0u, u32(countOneBits(nif_word(record + 1u))), (bit >> 5) != 0u);
  let i : u32 = nif_word(record) + before + u32(countOneBits(mask & (mark - 1u)));
  let word : u32 = select(0u, nif_word(nif_object + nif_header(62u) + (i >> 1)), (mask & mark) != 0u);
  return select(NIF_NONE, (word >> (16u * (i & 1u))) & 0xffffu, (mask & mark) != 0u);
}

// The colour of the surface at a point in object space: of its voxel, or of the nearest one around that.
fn nif_color_at(place : vec3<f32>) -> vec3<f32> {
  if (nif_header(62u) == 0u) {
    return vec3<f32>(0.5);
  }
  let at : vec3<f32> = (place - nif_vector(nif_object + 4u)) * nif_number(7u) * nif_number(8u);
  var middle : vec3<i32>;
  for (var a : i32 = 0; a < 3; a++) {
    middle[a] = nif_to_index(at[a], i32(nif_header(10u + u32(a))) - 1);
  }
  var color : u32 = nif_packed_color(middle);
  var nearest : f32 = select(nif_infinity(), 0.0, color != NIF_NONE);
  for (var i : i32 = 0; i < 27 && nearest > 0.0; i++) {
    let voxel : vec3<i32> = middle + vec3<i32>(i % 3, (i / 3) % 3, i / 9) - 1;
    let below : vec3<f32> = vec3<f32>(voxel) - at;
    let above : vec3<f32> = at - vec3<f32>(voxel + 1);
    let off : vec3<f32> = max(max(below, above), vec3<f32>(0.0));
    let square : f32 = nif_product(off, off);
    let other : u32 = nif_packed_color(voxel);
    if (other != NIF_NONE && square < nearest) {
      color = other;
      nearest = square;
    }
  }
  let steps : vec3<f32> = vec3<f32>(f32((color >> 11) & 31u), f32((color >> 5) & 63u), f32(color & 31u)) / vec3<f32>(31.0, 63.0, 31.0);
  let light : vec3<f32> = steps * steps;
  return select(vec3<f32>(0.5), light, color != NIF_NONE);
}
// #endif

// What has been found.
fn nif_take_hit(direction : vec3<f32>) -> NifHit {
  var hit : NifHit = NifHit(false, !nif_doubtful, nif_infinity(), vec3<f32>(0.0), NIF_NONE, 0.0, 0.0, vec3<f32>(0.0), NIF_NONE);
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
  let vertices : u32 = nif_object + nif_header(50u) + 3u * nif_hit_vertex;
  let p : vec3<f32> = nif_vector(vertices + 3u * (nif_hit_corners & 255u));
  let edge_1 : vec3<f32> = nif_vector(vertices + 3u * ((nif_hit_corners >> 8) & 255u)) - p;
  let edge_2 : vec3<f32> = nif_vector(vertices + 3u * ((nif_hit_corners >> 16) & 255u)) - p;
  hit.color = vec3<f32>(0.5);
// #if NIF_PLANES
  let place : vec3<f32> = p + hit.u * edge_1 + hit.v * edge_2;
  hit.color = nif_color_at(place);
// #endif
  let way_1 : vec3<f32> = nif_unit(edge_1);
  let way_2 : vec3<f32> = nif_unit(edge_2);
  var normal : vec3<f32> = way_1.yzx * way_2.zxy - way_1.zxy * way_2.yzx;
// #if NIF_SCENES
  if (nif_hit_instance != NIF_NONE) {
    hit.instance = nif_word(nif_hit_instance + 23u);
    if ((nif_word(nif_hit_instance + 21u) & 0x20000000u) == 0u) {
      normal = nif_vector(nif_hit_instance) * normal.x + nif_vector(nif_hit_instance + 3u) * normal.y + nif_vector(nif_hit_instance + 6u) * normal.z;
    }
  }
// #endif
  let way : vec3<f32> = nif_unit(direction);
  var facing : vec3<f32> = nif_unit(normal);
  facing = select(facing, -facing, nif_product(facing, way) > 0.0);
  hit.normal = select(-way, facing, nif_largest(facing) > 0.0);
  return hit;
}
// #endif

// ---- What to call. `object` is the first word of the object's tables in the buffer: 0 if it has but one.

// Does anything block one of the points origin + t direction, tmin <= t <= tmax? Planes prove most answers, and the
// network decides the rest. Without a network (`proof`) a ray that is left open counts as occluded, not certain.
fn nif_query(object : u32, origin : vec3<f32>, direction : vec3<f32>, tmin : f32, tmax : f32) -> NifAnswer {
  return nif_ask(object, origin, direction, tmin, tmax, true, -1.0);
}

// The same by proofs alone: if the answer is not certain, test your own triangles from open_begin to open_end.
fn nif_prove(object : u32, origin : vec3<f32>, direction : vec3<f32>, tmin : f32, tmax : f32) -> NifAnswer {
  let valid : bool = nif_is_valid(origin, direction, tmin, tmax);
  return nif_or_open(nif_ask(object, origin, direction, tmin, tmax, false, -1.0), valid);
}

// #if NIF_SCENES
// The same of a scene, whose words begin at `scene`, for a ray in world space. It meets the instances whose mask has a bit
// in common with `mask`.
fn nif_query_scene(scene : u32, origin : vec3<f32>, direction : vec3<f32>, tmin : f32, tmax : f32, mask : u32) -> NifAnswer {
  return nif_ask_scene(scene, origin, direction, tmin, tmax, mask, true);
}
fn nif_prove_scene(scene : u32, origin : vec3<f32>, direction : vec3<f32>, tmin : f32, tmax : f32, mask : u32) -> NifAnswer {
  let valid : bool = nif_is_valid(origin, direction, tmin, tmax);
  return nif_or_open(nif_ask_scene(scene, origin, direction, tmin, tmax, mask, false), valid);
}
// #endif

// #if NIF_TRIANGLES && NIF_FIRST_HITS
// The first triangle that the ray hits, of an object or of a scene. Objects without triangles are not hit; if they may be in
// the way, the hit is not certain.
fn nif_first_hit(object : u32, origin : vec3<f32>, direction : vec3<f32>, tmin : f32, tmax : f32) -> NifHit {
  nif_forget_triangles(true);
  nif_find_first(object, origin, direction, tmin, tmax, -1.0, true, NIF_NONE);
  return nif_take_hit(direction);
}
// #if NIF_SCENES
fn nif_first_hit_scene(scene : u32, origin : vec3<f32>, direction : vec3<f32>, tmin : f32, tmax : f32, mask : u32) -> NifHit {
  nif_forget_triangles(true);
  if (!nif_is_scene(scene)) {
    nif_doubtful = true;
    return nif_take_hit(direction);
  }
  let alone : bool = nif_word(scene + 4u) == 1u;
  let valid : bool = nif_is_valid(origin, direction, tmin, tmax);
  let proves : bool = NIF_PROVES && (nif_word(scene + 3u) & 2u) != 0u;
  nif_doubtful = !proves || (!valid && !nif_no_points(tmin, tmax));
  nif_others_low = select(nif_infinity(), -nif_infinity(), nif_doubtful);
  var node : u32 = scene + nif_word(scene + 11u);
  let end : u32 = scene + nif_word(scene + 12u);
  var complete : bool = true;
  for (; node < end; ) {
    let until : f32 = nif_smaller(tmax, nif_hit_high);
    let meets : bool = alone || (valid && nif_may_meet(node, origin, direction, tmin, until));
    let list : u32 = nif_word(node + 7u);
    var at : u32 = scene + 16u + 24u * (list >> 3);
    let here : u32 = select(0u, list & 7u, meets);
    var i : u32 = 0u;
    for (; i < here; i++) {
      if ((nif_word(at + 22u) & mask) != 0u && (alone || nif_may_meet(at + 15u, origin, direction, tmin, tmax))) {
        nif_enter_instance(scene, at, origin, direction, tmin, tmax);
        nif_find_first(nif_local_object, nif_local_origin, nif_local_direction, tmin, tmax, nif_local_moved, nif_local_stays, at);
      }
      at += 24u;
    }
    complete = complete && i == here;
    node = select(scene + nif_word(node + 6u), node + 8u, meets);
  }
  if (!complete || node < end) {
    nif_doubtful = true;
    nif_others_low = -nif_infinity();
  }
  return nif_take_hit(direction);
}
// #endif
// #endif
