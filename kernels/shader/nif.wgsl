// nif.wgsl: asks a nifkit object whether a ray is blocked, in a shader of your own. Made from nif.glsl, whose comments say
// how to use it. WGSL has no preprocessor: change what follows up to the first line of dashes to your needs.
@group(0) @binding(0) var<storage, read> nif_words : array<u32>;
fn nif_word(i : u32) -> u32 { return nif_words[i]; }
const NIF_NETWORK_WORDS : u32 = 12u;
const NIF_CERTAIN_REACH : f32 = 8192.0;
const NIF_PROVES : bool = false;  // WGSL may reorder sums, and for that no bound is derived: no answer is certain
const NIF_TRIANGLES : bool = true;

struct NifAnswer {
  visible : bool,  // false: something blocks the ray
  certain : bool,  // it is proven
  logit : i32,  // the network's output; NIF_CERTAIN_LOGIT or its negative if none was asked
  probability : f32,  // that the ray is visible
  open_begin : f32,  // if the planes prove nothing: whatever blocks the ray does so between these two t
  open_end : f32,
  instance : u32,  // of a scene: what blocks the ray; NIF_NONE if it is visible, or of an object alone
}

struct NifHit {
  hit : bool,
  certain : bool,  // it is proven that nothing is hit, or that this triangle is hit first
  t : f32,  // infinite if nothing is hit
  normal : vec3<f32>,  // of the triangle, of unit length, on the side that the ray comes from
  triangle : u32,  // as in NifHits, or NIF_NONE
  u : f32,  // the hit is at (1 - u - v) * first corner + u * second + v * third
  v : f32,
  instance : u32,  // of a scene
}

const NIF_NONE : u32 = 0xffffffffu;
const NIF_CERTAIN_LOGIT : i32 = 0x7fffffff;

// ---- State of a traversal. Space is the grid's, whose unit is a finest cell.

var<private> nif_object : u32;  // first word of the object's header
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
var<private> nif_enter : f32;  // t where the segment enters the grid, or begins
var<private> nif_leave : f32;  // t where it leaves it, or ends
var<private> nif_enters : bool;  // it enters from outside
var<private> nif_leaves : bool;
var<private> nif_near : bool;  // it starts near enough for proofs
var<private> nif_now : f32;
var<private> nif_seen : u32;  // sides that it has been on: 1 outside, 2 inside
var<private> nif_blocked : bool;
var<private> nif_count : u32;  // open intervals so far
var<private> nif_open_t : f32;  // their length
var<private> nif_starts_open : bool;
var<private> nif_ends_open : bool;
var<private> nif_open_begin : f32;
var<private> nif_open_end : f32;

// The second traversal of an open ray places sample points.
var<private> nif_placing : bool;
var<private> nif_last : u32;  // number of the last interval
var<private> nif_placed : u32;
var<private> nif_spacing : f32;
var<private> nif_start : f32;  // arc length at the start of the interval
var<private> nif_reversed : bool;
var<private> nif_input : array<u32, NIF_NETWORK_WORDS>;
var<private> nif_output : array<u32, NIF_NETWORK_WORDS>;

fn nif_header(k : u32) -> u32 { return nif_word(nif_object + k); }
fn nif_number(k : u32) -> f32 { return bitcast<f32>(nif_header(k)); }
fn nif_table(k : u32, i : u32) -> u32 { return nif_word(nif_object + nif_header(k) + i); }

// By bits: compilers may assume that there are no infinities and NaNs.
fn nif_is_finite(x : f32) -> bool { return (bitcast<u32>(x) & 0x7f800000u) != 0x7f800000u; }
fn nif_is_nan(x : f32) -> bool { return (bitcast<u32>(x) & 0x7fffffffu) > 0x7f800000u; }
fn nif_all_finite(v : vec3<f32>) -> bool { return nif_is_finite(v.x) && nif_is_finite(v.y) && nif_is_finite(v.z); }
fn nif_infinity() -> f32 { return 3.40282346e+38; }
// The second number if one is NaN.
fn nif_smaller(a : f32, b : f32) -> f32 { return select(b, a, a < b); }
fn nif_larger(a : f32, b : f32) -> f32 { return select(b, a, a > b); }
fn nif_largest(v : vec3<f32>) -> f32 { return nif_larger(abs(v.z), nif_larger(abs(v.y), nif_larger(abs(v.x), 0.0))); }

// Truncates x to an integer from 0 to top; 0 if it is NaN.
fn nif_to_index(x : f32, top : i32) -> i32 {
  if (nif_is_nan(x) || !(x > 0.0)) {
    return 0;
  }
  if (!(x < f32(top))) {
    return top;
  }
  return clamp(i32(x), 0, top);
}

// ---- The grid

// Clips the segment to the grid along one axis. Returns false if it misses the grid.
fn nif_clip(origin : f32, inverse : f32, flat_axis : bool, down : bool, voxels : u32) -> bool {
  let size : f32 = f32(voxels << nif_levels);
  if (flat_axis) {
    return origin >= 0.0 && origin <= size;
  }
  let to_low : f32 = 0.0 - origin;
  let low : f32 = to_low * inverse;
  let to_high : f32 = size - origin;
  let high : f32 = to_high * inverse;
  let first : f32 = select(low, high, down);
  let last : f32 = select(high, low, down);
  if (first > nif_enter) {
    nif_enter = first;
    nif_enters = true;
  }
  if (last < nif_leave) {
    nif_leave = last;
    nif_leaves = true;
  }
  return true;
}

// To the start of the grid.
fn nif_begin() {
  let moved : vec3<f32> = nif_enter * nif_direction;
  let at : vec3<f32> = nif_origin + moved;
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
  nif_near = false;
  nif_count = 0u;
  nif_blocked = false;
  nif_voxels = vec3<u32>(nif_header(10u), nif_header(11u), nif_header(12u));
  nif_levels = nif_header(9u);
  nif_voxel_words = nif_object + nif_header(13u);
  nif_children = nif_object + nif_header(14u);
  let corner : vec3<f32> = vec3<f32>(nif_number(4u), nif_number(5u), nif_number(6u));
  let scale : f32 = nif_number(7u);
  let relative : vec3<f32> = origin - corner;
  let grid_origin : vec3<f32> = relative * scale;
  let grid_direction : vec3<f32> = direction * scale;
  if (nif_is_nan(tmin) || nif_is_nan(tmax)) {
    return false;
  }
  if (!(tmin <= tmax)) {
    nif_near = true;  // no points
    return false;
  }
  let reach : f32 = nif_largest(grid_origin);
  let steepest : f32 = nif_largest(grid_direction);
  if (!nif_all_finite(grid_origin) || !nif_all_finite(grid_direction)) {
    return false;
  }
  if (!(steepest >= 8.67361737988403547e-19 && steepest <= 1.152921504606846976e18)) {  // 2^-60, 2^60
    return false;
  }
  nif_near = reach <= NIF_CERTAIN_REACH;
  let least : f32 = steepest * 9.094947017729282379150390625e-13;  // 2^-40
  for (var a : i32 = 0; a < 3; a++) {
    nif_flat[a] = abs(grid_direction[a]) < least;
    let moving : f32 = select(grid_direction[a], 1.0, nif_flat[a]);
    let inverse : f32 = 1.0 / moving;
    nif_inverse[a] = select(inverse, 0.0, nif_flat[a]);
    nif_direction[a] = select(grid_direction[a], 0.0, nif_flat[a]);
    nif_down[a] = nif_direction[a] < 0.0;
  }
  nif_origin = grid_origin;
  nif_enter = tmin;
  nif_leave = tmax;
  nif_enters = false;
  nif_leaves = false;
  for (var a : i32 = 0; a < 3; a++) {
    if (!nif_clip(nif_origin[a], nif_inverse[a], nif_flat[a], nif_down[a], nif_voxels[a])) {
      return false;
    }
  }
  return nif_enter <= nif_leave && nif_enter <= 3.402823466e+38;
}

// ---- Sample points

// Feature pairs i and i + 1, the first in the lower half.
fn nif_two_pairs(i : u32) -> u32 {
  let word : u32 = nif_table(17u, i >> 1);
  if ((i & 1u) == 0u) {
    return word;
  }
  let next : u32 = nif_table(17u, (i >> 1) + 1u);
  return (word >> 16) | (next << 16);
}

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

// The features of one corner, in whichever brick it is; 0 if it has none.
fn nif_corner(corner : vec3<u32>) -> u32 {
  let bricks : vec3<u32> = (nif_voxels + 3u) / 4u;
  let first : vec3<u32> = (max(corner, vec3<u32>(1u)) - 1u) / 4u;
  let last : vec3<u32> = min(corner / 4u, bricks - 1u);
  for (var k : u32 = 0u; k < 8u; k++) {
    let at : vec3<u32> = first + vec3<u32>(k & 1u, (k >> 1) & 1u, k >> 2);
    if (at.x <= last.x && at.y <= last.y && at.z <= last.z) {
      let brick : u32 = nif_brick(at);
      let layer : u32 = nif_table(16u, brick + 1u + corner.z - 4u * at.z);
      let bit : u32 = corner.x - 4u * at.x + 5u * (corner.y - 4u * at.y);
      if (((layer >> bit) & 1u) != 0u) {
        let below : u32 = u32(countOneBits(layer & ((1u << bit) - 1u)));
        return nif_two_pairs(nif_table(16u, brick) + (layer >> 25) + below) & 0xffffu;
      }
    }
  }
  return 0u;
}

fn nif_feature(sum : i32) -> u32 { return u32((sum + (127 << 21) + (1 << 21)) >> 22); }

// The two inputs of a point: trilinear interpolation of the features of its voxel's corners, in integers.
fn nif_features(voxel : vec3<u32>, fraction : vec3<i32>) -> u32 {
  let brick : u32 = nif_brick(voxel / 4u);
  let bit : u32 = (voxel.x & 3u) + 5u * (voxel.y & 3u);
  let four : u32 = 0x63u << bit;
  let layer_0 : u32 = nif_table(16u, brick + 1u + (voxel.z & 3u));
  let layer_1 : u32 = nif_table(16u, brick + 2u + (voxel.z & 3u));
  let together : bool = (layer_0 & layer_1 & four) == four;
  let first_pair : u32 = nif_table(16u, brick);
  let rest : vec3<i32> = 128 - fraction;
  var sum_0 : i32 = 0;
  var sum_1 : i32 = 0;
  for (var k : u32 = 0u; k < 4u && together; k++) {
    let dy : u32 = k & 1u;
    let dz : u32 = k >> 1;
    let layer : u32 = select(layer_1, layer_0, dz == 0u);
    let below : u32 = u32(countOneBits(layer & ((1u << (bit + 5u * dy)) - 1u)));
    let row : u32 = nif_two_pairs(first_pair + (layer >> 25) + below);
    let across : i32 = (select(fraction.y, rest.y, dy == 0u)) * (select(fraction.z, rest.z, dz == 0u));
    sum_0 += across * (rest.x * nif_byte(row, 0u) + fraction.x * nif_byte(row, 2u));
    sum_1 += across * (rest.x * nif_byte(row, 1u) + fraction.x * nif_byte(row, 3u));
  }
  // Rounding has moved the point out of the surface voxels: other bricks may have its corners. The same sum.
  let others : u32 = select(8u, 0u, together);
  for (var k : u32 = 0u; k < others; k++) {
    let to : vec3<u32> = vec3<u32>(k & 1u, (k >> 1) & 1u, k >> 2);
    let pair : u32 = nif_corner(voxel + to);
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
  let voxels_per_cell : f32 = nif_number(8u);
  let length : f32 = end - begin;
  for (; nif_placed < samples; nif_placed++) {
    let number : f32 = f32(nif_placed);
    let middle : f32 = number + 0.5;
    let s : f32 = middle * nif_spacing;
    let interval_end : f32 = nif_start + length;
    if (!last && s > interval_end) {
      nif_start = interval_end;
      return;
    }
    let along : f32 = s - nif_start;
    let t_along : f32 = begin + along;
    let t : f32 = nif_smaller(t_along, end);
    // Between the planes; 0 for an interval without length.
    let past : f32 = t - begin;
    let share : f32 = past / (select(1.0, length, length > 0.0));
    let rise : f32 = end_height - begin_height;
    let raised : f32 = rise * share;
    let height : f32 = begin_height + raised;
    let rounded : f32 = height + 0.5;
    let height_input : i32 = select(0, nif_to_index(rounded, 127), length > 0.0);
    let moved : vec3<f32> = t * nif_direction;
    let cell : vec3<f32> = nif_origin + moved;
    let at : vec3<f32> = cell * voxels_per_cell;
    var voxel : vec3<u32>;
    var fraction : vec3<i32>;
    for (var a : i32 = 0; a < 3; a++) {
      let index : i32 = nif_to_index(at[a], i32(nif_voxels[a]) - 1);
      let low : f32 = f32(index);
      let beyond : f32 = at[a] - low;
      let scaled : f32 = beyond * 128.0;
      let nearest : f32 = scaled + 0.5;
      voxel[a] = u32(index);
      fraction[a] = nif_to_index(nearest, 128);
    }
    let word : u32 = nif_features(voxel, fraction) | (u32(height_input) << 16);
    nif_put(select(nif_placed, samples - 1u - nif_placed, nif_reversed), word);
  }
}

// ---- Traversal

// The segment from t = nif_now to t = left in a cell with planes.
fn nif_pass_cell(word : u32, middle : vec3<f32>, size : f32, left : f32) {
  let u : i32 = i32((word >> 4) & 63u) - 31;
  let v : i32 = i32((word >> 10) & 63u) - 31;
  let normal : vec3<f32> = vec3<f32>(vec3<i32>(u + v, u - v, 62 - 2 * max(abs(u), abs(v))));
  let relative : vec3<f32> = nif_origin - middle;
  let enter_moved : vec3<f32> = nif_now * nif_direction;
  let enter_point : vec3<f32> = relative + enter_moved;
  let enters : vec3<f32> = normal * enter_point;
  let enter_sum : f32 = enters.x + enters.y;
  let enter_height : f32 = enter_sum + enters.z;
  let leave_moved : vec3<f32> = left * nif_direction;
  let leave_point : vec3<f32> = relative + leave_moved;
  let leaves : vec3<f32> = normal * leave_point;
  let leave_sum : f32 = leaves.x + leaves.y;
  let leave_height : f32 = leave_sum + leaves.z;
  let heights : f32 = 31.0 * size;  // exact, as all are that follow from size and word alone
  let units : f32 = heights + 1.0;
  let step_size : f32 = units * 0.0078125;
  let lower_place : f32 = f32((word >> 16) & 255u) - 128.0;
  let upper_place : f32 = f32((word >> 24) + 1u) - 128.0;
  let lower : f32 = lower_place * step_size;
  let upper : f32 = upper_place * step_size;
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
  let stay : f32 = left - nif_now;
  let rate : f32 = stay / (select(1.0, climb, climb != 0.0));
  let first_rise : f32 = (select(lower, upper, enters_above)) - enter_height;
  let first_part : f32 = first_rise * rate;
  let first_t : f32 = nif_now + first_part;
  let last_rise : f32 = (select(lower, upper, leaves_above)) - enter_height;
  let last_part : f32 = last_rise * rate;
  let last_t : f32 = nif_now + last_part;
  var begin : f32 = nif_now;
  if (enters_above || enters_below) {
    begin = nif_smaller(nif_larger(first_t, nif_now), left);
  }
  var end : f32 = left;
  if (leaves_above || leaves_below) {
    end = nif_smaller(nif_larger(last_t, begin), left);
  }
  if (nif_placing) {
    let between : f32 = upper - lower;
    let scale : f32 = 127.0 / between;
    let enter_over : f32 = enter_height - lower;
    let enter_scaled : f32 = enter_over * scale;
    let enter_rounded : f32 = enter_scaled + 0.5;
    let leave_over : f32 = leave_height - lower;
    let leave_scaled : f32 = leave_over * scale;
    let leave_rounded : f32 = leave_scaled + 0.5;
    nif_place(begin, end, f32(nif_to_index(enter_rounded, 127)), f32(nif_to_index(leave_rounded, 127)));
  } else {
    if (nif_count == 0u) {
      nif_starts_open = begin == nif_enter && !nif_enters;
      nif_open_begin = nif_now;
    }
    nif_ends_open = end == nif_leave && !nif_leaves;
    nif_open_end = left;
    let length : f32 = end - begin;
    let open_t : f32 = nif_open_t + length;
    nif_open_t = open_t;
  }
  nif_count++;
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
    let child : u32 = upper.x | (upper.y << 1) | (upper.z << 2);
    let mask : u32 = (word >> 4) & 255u;
    if (((mask >> child) & 1u) != 0u) {
      word = nif_word(nif_children + (word >> 12) + u32(countOneBits(mask & ((1u << child) - 1u))));
    } else {
      word = 14u;  // no triangle, and nothing is known of its side
    }
  }

  // Where the segment leaves the box or the cell.
  let is_empty : bool = (word & 15u) == 14u;
  let box : u32 = select(0u, word, (is_empty && nif_near));
  let size : i32 = 1 << level;
  let low : vec3<i32> = (at >> vec3<u32>(level)) << vec3<u32>(level);
  var leaving : vec3<f32>;
  for (var a : i32 = 0; a < 3; a++) {
    let extent : u32 = (box >> (8u + 8u * u32(a) + (select(4u, 0u, nif_down[a])))) & 15u;
    let reach : i32 = i32(extent) * size;
    var plane : f32 = f32(select(low[a] + size + reach, low[a] - reach, nif_down[a]));
    var distance : f32 = plane - nif_origin[a];
    var crossing : f32 = distance * nif_inverse[a];
    leaving[a] = select(crossing, nif_infinity(), nif_flat[a]);
  }
  let t : f32 = nif_smaller(nif_smaller(leaving.x, leaving.y), leaving.z);
  let ends : bool = !(t < nif_leave);
  let left : f32 = nif_larger(select(t, nif_leave, ends), nif_now);
  if (is_empty) {
    nif_seen |= (word >> 4) & 3u;
  } else {
    let half_size : f32 = 0.5 * f32(size);
    let middle : vec3<f32> = vec3<f32>(low) + half_size;  // exact
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
  let by_0 : bool = leaving.x == t;
  let by_1 : bool = leaving.y == t;
  let moved : vec3<f32> = nif_direction * t;
  let reached : vec3<f32> = nif_origin + moved;
  var cell : vec3<i32> = nif_cell;
  if (nif_near) {
    for (var a : i32 = 0; a < 3; a++) {
      let upward : f32 = select(reached[a], -reached[a], nif_down[a]);
      let lowered : f32 = upward - 0.03125;
      cell[a] = max(i32(clamp(floor(lowered), -1025.0, 1025.0)), cell[a]);
    }
  }
  var passes : vec3<bool> = vec3<bool>(true);
  for (var k : i32 = 0; k < size && (passes.x || passes.y || passes.z); k++) {
    for (var a : i32 = 0; a < 3; a++) {
      let later : bool = (a > 0 && by_0) || (a > 1 && by_1);
      let next : i32 = cell[a] + 1;
      let plane : f32 = f32(select(next, -next, nif_down[a]));
      let distance : f32 = plane - nif_origin[a];
      let crossing : f32 = distance * nif_inverse[a];
      let crossed : bool = passes[a] && !nif_flat[a] && (crossing < t || (crossing == t && !later));
      cell[a] = select(cell[a], next, crossed);
      passes[a] = crossed && !nif_near && (next & (size - 1)) != 0;
    }
  }
  nif_cell = cell;
  return true;
}

// ---- The network

fn nif_dot(weights : u32, inputs : u32, sum : i32) -> i32 {
  let sum_0 : i32 = sum + nif_byte(weights, 0u) * i32(inputs & 255u);
  let sum_1 : i32 = sum_0 + nif_byte(weights, 1u) * i32((inputs >> 8) & 255u);
  let sum_2 : i32 = sum_1 + nif_byte(weights, 2u) * i32((inputs >> 16) & 255u);
  return sum_2 + nif_byte(weights, 3u) * i32(inputs >> 24);
}

// The sum of one neuron, whose row of weights begins at a word.
fn nif_neuron(row : u32, words : u32) -> i32 {
  var sum : i32 = i32(nif_word(row));
  for (var k : u32 = 0u; k < u32(NIF_NETWORK_WORDS); k++) {
    if (k < words) {
      sum = nif_dot(nif_word(row + 1u + k), nif_input[k], sum);
    }
  }
  return sum;
}

// The inputs that belong to no point: direction, length, flags.
fn nif_put_globals(samples : u32) {
  let squares : vec3<f32> = nif_direction * nif_direction;
  let sum : f32 = squares.x + squares.y;
  let square : f32 = sum + squares.z;
  let length : f32 = sqrt(square);
  let unit : vec3<f32> = nif_direction / length;
  let upward : vec3<f32> = select(unit, -unit, nif_reversed);
  let scaled : vec3<f32> = 63.5 * upward;
  let shifted : vec3<f32> = 64.0 + scaled;
  let open_length : f32 = nif_open_t * length;
  let in_units : f32 = open_length * nif_number(19u);
  let rounded : f32 = in_units + 0.5;
  let x : u32 = u32(nif_to_index(shifted.x, 127));
  let y : u32 = u32(nif_to_index(shifted.y, 127));
  let z : u32 = u32(nif_to_index(shifted.z, 127));
  nif_put(samples, x | (y << 8) | (z << 16) | (u32(nif_to_index(rounded, 127)) << 24));
  let starts : bool = select(nif_starts_open, nif_ends_open, nif_reversed);
  let ends : bool = select(nif_ends_open, nif_starts_open, nif_reversed);
  let flags : u32 = (select(0u, 0x7fu, (nif_seen & 1u) != 0u)) | (select(0u, 0x7f00u, (nif_seen & 2u) != 0u));
  nif_put(samples + 1u, flags | (select(0u, 0x7f0000u, starts)) | (select(0u, 0x7f000000u, ends)));
}

// The network's output for nif_input.
fn nif_evaluate() -> i32 {
  let layers : u32 = min(nif_header(20u), 4u);
  for (var l : u32 = 0u; l < layers; l++) {
    var row : u32 = nif_object + nif_header(24u + 4u * l);
    let words : u32 = nif_header(25u + 4u * l);
    let outputs : u32 = nif_header(26u + 4u * l);
    let shift : u32 = nif_header(27u + 4u * l);
    if (l + 1u == layers) {
      return nif_neuron(row, words);
    }
    let groups : u32 = outputs >> 2;
    for (var w : u32 = 0u; w < groups; w++) {
      var four : u32 = 0u;
      for (var k : u32 = 0u; k < 4u; k++) {
        let sum : i32 = nif_neuron(row, words) + ((1 << shift) >> 1);
        four |= u32(clamp(sum >> shift, 0, 127)) << (8u * k);
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

// ---- Triangles: a tree of boxes whose nodes lie depth first, so that no stack is needed. The triangle's vectors are turned
// to end with the axis along which the ray moves most, and sheared so that the ray runs along it.

var<private> nif_steep : u32;  // that axis
var<private> nif_steepest : f32;  // the direction along it, without its sign
var<private> nif_from : vec3<f32>;  // the ray's origin, turned
var<private> nif_slope_x : f32;
var<private> nif_slope_y : f32;
var<private> nif_per_unit : f32;  // t for a unit along that axis
var<private> nif_error_share : f32;  // sheared coordinates are off by less than this share of the distance, and nif_error_least
var<private> nif_error_least : f32;
var<private> nif_in_reach : bool;  // of proofs
var<private> nif_back : vec3<bool>;  // where the direction is negative
var<private> nif_box_step : vec3<f32>;  // boxes count t by nif_steepest
var<private> nif_box_near : vec3<f32>;
var<private> nif_box_far : vec3<f32>;
var<private> nif_box_enter : f32;
var<private> nif_box_leave : f32;
var<private> nif_tmin : f32;
var<private> nif_tmax : f32;
var<private> nif_looks_for_first : bool;  // else for any triangle
var<private> nif_met : bool;  // one, as single precision says
var<private> nif_met_surely : bool;
var<private> nif_doubtful : bool;  // there is a triangle of which rounding decides whether it is met
var<private> nif_found : bool;  // no other triangle matters
var<private> nif_hit_surely : bool;  // the nearest one
var<private> nif_hit_t : f32;
var<private> nif_hit_low : f32;  // it is met from here
var<private> nif_hit_high : f32;  // to here
var<private> nif_hit_u : f32;
var<private> nif_hit_v : f32;
var<private> nif_hit_triangle : u32;
var<private> nif_hit_corners : u32;  // their word
var<private> nif_hit_vertex : u32;  // the first of the leaf
var<private> nif_hit_object : u32;
var<private> nif_hit_instance : u32;  // its first word, or NIF_NONE
var<private> nif_others_low : f32;  // none of the others is met before

fn nif_vector(at : u32) -> vec3<f32> {
  return vec3<f32>(bitcast<f32>(nif_word(at)), bitcast<f32>(nif_word(at + 1u)), bitcast<f32>(nif_word(at + 2u)));
}
fn nif_turn(v : vec3<f32>) -> vec3<f32> { return select((select(v.zxy, v.yzx, nif_steep == 0u)), v, nif_steep == 2u); }
fn nif_least(v : vec3<f32>) -> f32 { return nif_smaller(v.z, nif_smaller(v.y, v.x)); }
fn nif_most(v : vec3<f32>) -> f32 { return nif_larger(v.z, nif_larger(v.y, v.x)); }

// Prepares a ray for the object's triangles. Returns false if it meets none, without a look at them. `moved`: the sum of
// magnitudes from which an instance's transform has made the origin, or negative.
fn nif_enter_tree(origin : vec3<f32>, direction : vec3<f32>, tmin : f32, tmax : f32, moved : f32) -> bool {
  let extent : f32 = nif_number(53u);
  let far : f32 = nif_largest(origin);
  let reach : f32 = nif_larger(far, extent);
  nif_steepest = nif_largest(direction);
  let farthest : f32 = extent * 4294967296.0;
  // From 2^-60 to 2^60, and to 2^61 for the reach.
  let moves : bool = nif_steepest >= 8.67361737988403547e-19 && nif_steepest <= 1.152921504606846976e18;
  if (!nif_all_finite(origin) || !nif_all_finite(direction) || !moves || far > farthest || nif_is_nan(tmin) || nif_is_nan(tmax) || !(tmin <= tmax) || !(reach <= 2.305843009213693952e18)) {
    return false;
  }
  let steep : vec3<f32> = abs(direction);
  nif_steep = select(0u, 1u, steep.y > steep.x);
  nif_steep = select(nif_steep, 2u, steep.z > nif_larger(steep.x, steep.y));
  nif_from = nif_turn(origin);
  let turned : vec3<f32> = nif_turn(direction);
  let slope_x : f32 = turned.x / turned.z;
  let slope_y : f32 = turned.y / turned.z;
  let per_unit : f32 = 1.0 / turned.z;
  nif_slope_x = slope_x;
  nif_slope_y = slope_y;
  nif_per_unit = per_unit;
  nif_tmin = tmin;
  nif_tmax = tmax;

  // How far rounding may move it, and what is too far away, too small or too large for that bound (docs/shaders.md).
  let is_moved : bool = moved >= 0.0;
  nif_error_share = select(9.5367431640625e-7, 3.814697265625e-6, is_moved);  // 2^-18, 2^-20
  let error_least : f32 = reach * 9.31322574615478515625e-10;  // 2^-30
  let error_moved : f32 = moved * 1.9073486328125e-6;  // 2^-19
  let error_both : f32 = error_least + error_moved;
  nif_error_least = select(error_least, error_both, is_moved);
  let near : f32 = extent * 1024.0;
  let proves : bool = NIF_PROVES && (nif_header(3u) & 2u) != 0u;
  // At most 1024 extents away; from 2^-30 to 2^36; a direction from 2^-40 to 2^40.
  let near_enough : bool = reach <= near && reach <= 6.8719476736e10 && extent >= 9.31322574615478515625e-10;
  let steep_enough : bool = nif_steepest <= 1.099511627776e12 && nif_steepest >= 9.094947017729282379e-13;
  nif_in_reach = proves && near_enough && steep_enough;

  // Boxes grow by more than any of that, up to where they would no longer be of use.
  let useful : f32 = extent * 2048.0;
  let counted : f32 = nif_smaller(reach, useful);
  let rounding : f32 = counted * 3.814697265625e-6;
  let share : f32 = nif_error_share * 4.0;
  let growth : f32 = counted * share;
  let grown : f32 = rounding + growth;
  let twice : f32 = nif_error_least * 2.0;
  let padding : f32 = grown + twice;
  var outward : vec3<f32> = vec3<f32>(padding);
  var way : vec3<f32>;
  for (var a : i32 = 0; a < 3; a++) {
    nif_back[a] = direction[a] < 0.0;
    let share_of : f32 = steep[a] / nif_steepest;
    let size : f32 = nif_larger(share_of, 9.31322574615478515625e-10);  // 2^-30
    way[a] = select(size, -size, nif_back[a]);
    outward[a] = select(padding, -padding, nif_back[a]);
  }
  let inverse : vec3<f32> = 1.0 / way;
  let box_step : vec3<f32> = nif_vector(nif_object + 57u) * inverse;
  nif_box_step = box_step;
  let corner : vec3<f32> = nif_vector(nif_object + 54u);
  let near_origin : vec3<f32> = origin + outward;
  let near_corner : vec3<f32> = corner - near_origin;
  let box_near : vec3<f32> = near_corner * inverse;
  nif_box_near = box_near;
  let far_origin : vec3<f32> = origin - outward;
  let far_corner : vec3<f32> = corner - far_origin;
  let box_far : vec3<f32> = far_corner * inverse;
  nif_box_far = box_far;
  let distance : f32 = reach * 4.0;  // nothing is met beyond
  let last : f32 = distance / nif_steepest;
  let enter : f32 = nif_larger(tmin, -last) * nif_steepest;
  let until : f32 = nif_smaller(tmax, nif_hit_high);
  let leave : f32 = nif_smaller(until, last) * nif_steepest;
  nif_box_enter = enter;
  nif_box_leave = leave;
  return true;
}

// Does the ray perhaps meet something in a node's box?
fn nif_meets_box(at : u32) -> bool {
  let words : vec3<u32> = vec3<u32>(nif_word(at), nif_word(at + 1u), nif_word(at + 2u));
  let low : vec3<f32> = vec3<f32>(words & vec3<u32>(65535u));
  let high : vec3<f32> = vec3<f32>(words >> vec3<u32>(16u));
  let first : vec3<f32> = vec3<f32>(select(low.x, high.x, nif_back.x), select(low.y, high.y, nif_back.y), select(low.z, high.z, nif_back.z));
  let last : vec3<f32> = vec3<f32>(select(high.x, low.x, nif_back.x), select(high.y, low.y, nif_back.y), select(high.z, low.z, nif_back.z));
  let to_first : vec3<f32> = first * nif_box_step;
  let enters : vec3<f32> = to_first + nif_box_near;
  let to_last : vec3<f32> = last * nif_box_step;
  let leaves : vec3<f32> = to_last + nif_box_far;
  return nif_larger(nif_most(enters), nif_box_enter) <= nif_smaller(nif_least(leaves), nif_box_leave);
}

// Does the ray meet a triangle? Both triangles of an edge see it by the same numbers, so that no ray passes between them.
// Returns false if it certainly does not; then nothing else is set.
fn nif_meet_triangle(p : vec3<f32>, q : vec3<f32>, r : vec3<f32>, triangle : u32) -> bool {
  let to_p : vec3<f32> = nif_turn(p) - nif_from;
  let to_q : vec3<f32> = nif_turn(q) - nif_from;
  let to_r : vec3<f32> = nif_turn(r) - nif_from;
  let depths : vec3<f32> = vec3<f32>(to_p.z, to_q.z, to_r.z);
  let shift_x : vec3<f32> = depths * nif_slope_x;
  let shift_y : vec3<f32> = depths * nif_slope_y;
  let x : vec3<f32> = vec3<f32>(to_p.x, to_q.x, to_r.x) - shift_x;
  let y : vec3<f32> = vec3<f32>(to_p.y, to_q.y, to_r.y) - shift_y;
  let plus : vec3<f32> = x.zxy * y.yzx;
  let minus : vec3<f32> = y.zxy * x.yzx;
  let sides : vec3<f32> = plus - minus;

  // Bounds of their errors: e (|x| + |y| of both ends of the edge + e) 2, where e is that of a sheared coordinate.
  let distance : f32 = nif_larger(nif_largest(to_p), nif_larger(nif_largest(to_q), nif_largest(to_r)));
  let error_far : f32 = distance * nif_error_share;
  let error : f32 = error_far + nif_error_least;
  let error_2 : f32 = error * 2.0;
  let sizes : vec3<f32> = abs(x) + abs(y);
  let spans : vec3<f32> = sizes.zxy + sizes.yzx;
  let grown : vec3<f32> = spans + error;
  let bounds : vec3<f32> = grown * error_2;
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

  var inside : bool = nif_least(sides) >= 0.0 || nif_most(sides) <= 0.0;
  let sum_2 : f32 = sides.x + sides.y;
  let sum : f32 = sum_2 + sides.z;
  inside = inside && sum != 0.0;
  var surely : bool = (sides.x > bounds.x && sides.y > bounds.y && sides.z > bounds.z) || (sides.x < -bounds.x && sides.y < -bounds.y && sides.z < -bounds.z);
  let per_sum : f32 = 1.0 / (select(1.0, sum, sum != 0.0));
  let weights : vec3<f32> = sides * per_sum;
  let parts : vec3<f32> = weights * depths;
  let parts_2 : f32 = parts.x + parts.y;
  let depth : f32 = parts_2 + parts.z;
  let t : f32 = depth * nif_per_unit;
  if (surely) {
    let bounds_2 : f32 = bounds.x + bounds.y;
    let bounds_3 : f32 = bounds_2 + bounds.z;
    let off : f32 = bounds_3 * abs(per_sum);
    let range : f32 = nif_most(arrivals) - nif_least(arrivals);
    let moved : f32 = range * off;
    let slack_2 : f32 = slack * 2.0;
    let slack_3 : f32 = moved + slack_2;
    let t_low : f32 = t - slack_3;
    let t_high : f32 = t + slack_3;
    low = t_low;
    high = t_high;
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

// ---- Queries

// Not where a number is not finite (tmin and tmax may be infinite), the origin is 2^126 or more, the direction is 0 or too
// small or large to compute with, or tmin > tmax.
fn nif_is_valid(origin : vec3<f32>, direction : vec3<f32>, tmin : f32, tmax : f32) -> bool {
  let enlarged : vec3<f32> = origin * 4.0;
  let steepest : f32 = nif_largest(direction);
  let moves : bool = steepest >= 8.67361737988403547e-19 && steepest <= 1.152921504606846976e18;
  return nif_all_finite(enlarged) && nif_all_finite(direction) && moves && !nif_is_nan(tmin) && !nif_is_nan(tmax) && tmin <= tmax;
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

// By planes, and if `learned` by the network about what they leave open, if there is one.
fn nif_ask_planes(origin : vec3<f32>, direction : vec3<f32>, tmin : f32, tmax : f32, learned : bool) -> NifAnswer {
  var answer : NifAnswer = NifAnswer(false, false, -1, 0.5, tmin, tmax, NIF_NONE);
  let flags : u32 = nif_header(3u);
  let samples : u32 = nif_header(18u);
  let has_network : bool = learned && (flags & 1u) != 0u && nif_header(21u) <= u32(NIF_NETWORK_WORDS);
  var over : bool = true;
  nif_placing = false;
  if (nif_enter_grid(origin, direction, tmin, tmax)) {
    nif_begin();
    over = false;
    // Each step goes at least one cell along an axis, and a ray is traversed at most twice.
    for (var k : i32 = 0; k < 2 * (3 * 1024 + 2); k++) {
      if (nif_next()) {
        continue;
      }
      if (nif_placing || nif_blocked || nif_count == 0u || !has_network) {
        over = true;
        break;
      }
      // From the end that makes the direction point up.
      let d : vec3<f32> = nif_direction;
      nif_reversed = d.z < 0.0 || (d.z == 0.0 && (d.y < 0.0 || (d.y == 0.0 && d.x < 0.0)));
      for (var w : u32 = 0u; w < u32(NIF_NETWORK_WORDS); w++) {
        nif_input[w] = 0u;
        nif_output[w] = 0u;
      }
      nif_put_globals(samples);
      let spacing : f32 = nif_open_t / f32(samples);
      nif_spacing = spacing;
      nif_last = nif_count - 1u;
      nif_placed = 0u;
      nif_start = 0.0;
      nif_placing = true;
      nif_begin();
    }
  }
  if (!over) {
    return answer;
  }
  if (nif_blocked || nif_count == 0u) {
    answer.visible = !nif_blocked;
    answer.certain = NIF_PROVES && nif_near && (flags & 2u) != 0u;
    answer.logit = select(NIF_CERTAIN_LOGIT, -NIF_CERTAIN_LOGIT, nif_blocked);
    answer.probability = select(1.0, 0.0, nif_blocked);
    return answer;
  }

  // The interval in which the caller's own triangles can decide: a voxel longer at each end.
  let reach : f32 = nif_largest(nif_origin);
  let culling_reach : f32 = 0.25 * NIF_CERTAIN_REACH;
  if (reach <= culling_reach) {
    let voxel : f32 = f32(1u << nif_levels) / nif_largest(nif_direction);
    let begin : f32 = nif_open_begin - voxel;
    let end : f32 = nif_open_end + voxel;
    answer.open_begin = nif_larger(begin, tmin);
    answer.open_end = nif_smaller(end, tmax);
  }
  if (nif_placing) {
    answer.logit = nif_evaluate();
    answer.visible = answer.logit >= 0;
    let odds : f32 = f32(answer.logit + i32(nif_header(23u))) * nif_number(22u);
    let against : f32 = 1.0 + exp(-odds);
    let probability : f32 = 1.0 / against;
    answer.probability = probability;
  }
  return answer;
}

// What the triangles between the planes say. nif_enter_tree() has prepared the ray.
fn nif_ask_triangles(by_planes : NifAnswer) -> NifAnswer {
  var answer : NifAnswer = by_planes;
  if ((nif_header(3u) & 8u) != 0u) {
    nif_leave_boxes_outside(answer.open_begin, answer.open_end);
  }
  nif_walk_tree(NIF_NONE);
  answer.visible = !nif_met;
  answer.certain = nif_in_reach && (nif_met_surely || !nif_doubtful);
  answer.logit = select(-1, 0, answer.visible);
  answer.probability = 0.5;
  if (answer.certain) {
    answer.logit = select(-NIF_CERTAIN_LOGIT, NIF_CERTAIN_LOGIT, answer.visible);
    answer.probability = select(0.0, 1.0, answer.visible);
  }
  return answer;
}

// The whole of it. `moved`: as for nif_enter_tree(). Planes are asked in one place, because compilers that copy each function
// to its callers would otherwise have that traversal twice.
fn nif_ask(object : u32, origin : vec3<f32>, direction : vec3<f32>, tmin : f32, tmax : f32, learned : bool, moved : f32) -> NifAnswer {
  nif_object = object;
  let flags : u32 = nif_header(3u);
  let has_triangles : bool = (flags & 4u) != 0u;
  var answer : NifAnswer = NifAnswer(false, false, -1, 0.5, tmin, tmax, NIF_NONE);
  if (nif_header(0u) != 0x5346494eu || nif_header(1u) != 2u || (has_triangles && !NIF_TRIANGLES)) {
    return answer;  // not tables that this file reads
  }
  let by_triangles : bool = NIF_TRIANGLES && has_triangles;
  if (by_triangles) {
    nif_forget_triangles(false);
    if (!nif_enter_tree(origin, direction, tmin, tmax, moved)) {
      let proves : bool = NIF_PROVES && (flags & 2u) != 0u;
      let no_points : bool = !nif_is_nan(tmin) && !nif_is_nan(tmax) && tmin > tmax;
      return NifAnswer(true, proves && no_points, NIF_CERTAIN_LOGIT, 1.0, tmin, tmax, NIF_NONE);
    }
  }
  if (!by_triangles || (flags & 8u) != 0u) {
    answer = nif_ask_planes(origin, direction, tmin, tmax, learned && !by_triangles);
  }
  if (by_triangles && !answer.certain) {
    answer = nif_ask_triangles(answer);
  }
  return answer;
}

// ---- Scenes

// The sum of three products, in the CPU's order.
fn nif_row(row : vec3<f32>, v : vec3<f32>) -> f32 {
  let products : vec3<f32> = row * v;
  let two : f32 = products.x + products.y;
  let three : f32 = two + products.z;
  return three;
}

// Whether a ray may meet a box from `low` to `high` along one axis: narrows nif_enter and nif_leave.
fn nif_slab(low : f32, high : f32, origin : f32, direction : f32) -> bool {
  if (!(abs(direction) >= 1.17549435082228751e-38)) {  // 2^-126
    return low < origin && origin < high;
  }
  let inverse : f32 = 1.0 / direction;
  let to_low : f32 = low - origin;
  let t_low : f32 = to_low * inverse;
  let to_high : f32 = high - origin;
  let t_high : f32 = to_high * inverse;
  nif_enter = nif_larger(nif_smaller(t_low, t_high), nif_enter);
  nif_leave = nif_smaller(nif_larger(t_high, t_low), nif_leave);
  return true;
}

// Whether a valid ray may meet the box of an instance. A ray that does not certainly misses it, from anywhere.
fn nif_may_meet(box : u32, origin : vec3<f32>, direction : vec3<f32>, tmin : f32, tmax : f32) -> bool {
  let low : vec3<f32> = nif_vector(box);
  let high : vec3<f32> = nif_vector(box + 3u);
  nif_enter = -nif_infinity();
  nif_leave = nif_infinity();
  if (!nif_slab(low.x, high.x, origin.x, direction.x) || !nif_slab(low.y, high.y, origin.y, direction.y) || !nif_slab(low.z, high.z, origin.z, direction.z)) {
    return false;
  }
  let enter_less : f32 = nif_enter * 0.9999847412109375;  // 1 - 2^-16
  let enter_more : f32 = nif_enter * 1.0000152587890625;
  let first : f32 = nif_smaller(enter_less, enter_more) - 7.34683969e-40;  // 2^-130
  let leave_less : f32 = nif_leave * 0.9999847412109375;
  let leave_more : f32 = nif_leave * 1.0000152587890625;
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

// Takes a ray to the space of an instance whose words begin at `at`: sets nif_local_origin and what follows it.
fn nif_enter_instance(scene : u32, at : u32, origin : vec3<f32>, direction : vec3<f32>, tmin : f32, tmax : f32) {
  let word : u32 = nif_word(at + 21u);
  nif_local_object = scene + (word & 0x1fffffffu);
  nif_local_origin = origin;
  nif_local_direction = direction;
  nif_local_moved = -1.0;
  var stays : bool = true;
  if ((word & 0x20000000u) == 0u) {  // not the identity
    let row_x : vec3<f32> = nif_vector(at);
    let row_y : vec3<f32> = nif_vector(at + 3u);
    let row_z : vec3<f32> = nif_vector(at + 6u);
    let remainder : vec3<f32> = nif_vector(at + 12u);
    let moved : vec3<f32> = origin - nif_vector(at + 9u);
    let relative : vec3<f32> = moved - remainder;
    nif_local_origin = vec3<f32>(nif_row(row_x, relative), nif_row(row_y, relative), nif_row(row_z, relative));
    nif_local_direction = vec3<f32>(nif_row(row_x, direction), nif_row(row_y, direction), nif_row(row_z, direction));
    // Whether a proof for the ray in object space holds in the world: rounding must move it little.
    let far : vec3<f32> = abs(relative);
    let steep : vec3<f32> = abs(direction);
    let reaches : vec3<f32> = vec3<f32>(nif_row(abs(row_x), far), nif_row(abs(row_y), far), nif_row(abs(row_z), far));
    let spreads : vec3<f32> = vec3<f32>(nif_row(abs(row_x), steep), nif_row(abs(row_y), steep), nif_row(abs(row_z), steep));
    let reach : f32 = nif_largest(reaches);
    let remains : bool = remainder.x != 0.0 || remainder.y != 0.0 || remainder.z != 0.0;
    let longer : f32 = reach * 1.25;
    nif_local_moved = select(reach, longer, remains);
    let cells : f32 = nif_local_moved * bitcast<f32>(nif_word(nif_local_object + 47u));
    let most : f32 = NIF_CERTAIN_REACH * 0.125;
    let times : f32 = NIF_CERTAIN_REACH * 0.000244140625;  // 4 for the CPU's reach
    let wide : f32 = times * nif_largest(nif_local_direction);
    stays = tmin > tmax || ((word & 0x40000000u) != 0u && cells <= most && nif_largest(spreads) <= wide);
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

// The answers of all instances joined: one that blocks the ray is enough.
fn nif_ask_scene(scene : u32, origin : vec3<f32>, direction : vec3<f32>, tmin : f32, tmax : f32, mask : u32, learned : bool) -> NifAnswer {
  var joined : NifAnswer = NifAnswer(false, false, -1, 0.5, tmin, tmax, NIF_NONE);
  if (nif_word(scene) != 0x4346494eu || nif_word(scene + 1u) != 2u) {
    return joined;  // not a scene that this file reads
  }
  let count : u32 = nif_word(scene + 4u);
  let proves : bool = NIF_PROVES && (nif_word(scene + 3u) & 2u) != 0u;
  let no_points : bool = !nif_is_nan(tmin) && !nif_is_nan(tmax) && tmin > tmax;
  let valid : bool = nif_is_valid(origin, direction, tmin, tmax);
  var all_certain : bool = proves && (valid || no_points);
  var blocked : bool = false;
  joined = NifAnswer(true, all_certain, NIF_CERTAIN_LOGIT, 1.0, tmin, tmax, NIF_NONE);
  if (proves) {  // else what proves nothing may block the ray anywhere
    joined.open_begin = nif_infinity();
    joined.open_end = -nif_infinity();
  }
  let alone : bool = count == 1u;  // then its box is not asked, as by the CPU
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

// ---- First hits

// Looks for a nearer triangle in one object. `stays`: what is proven for this ray is so in the world.
fn nif_find_first(object : u32, origin : vec3<f32>, direction : vec3<f32>, tmin : f32, tmax : f32, moved : f32, stays : bool, instance : u32) {
  nif_object = object;
  let is_known : bool = nif_header(0u) == 0x5346494eu && nif_header(1u) == 2u;
  let flags : u32 = select(0u, nif_header(3u), is_known);
  let has_planes : bool = (flags & 8u) != 0u;
  let has_triangles : bool = NIF_TRIANGLES && (flags & 4u) != 0u;
  var answer : NifAnswer = NifAnswer(false, false, -1, 0.5, tmin, tmax, NIF_NONE);
  if (has_planes) {
    answer = nif_ask_planes(origin, direction, tmin, tmax, false);
  }
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
  let squares : vec3<f32> = scaled * scaled;
  let sum_2 : f32 = squares.x + squares.y;
  let sum : f32 = sum_2 + squares.z;
  let length : f32 = sqrt(sum);
  let unit : vec3<f32> = scaled / (select(1.0, length, length > 0.0));
  return unit;
}

// What has been found.
fn nif_take_hit(direction : vec3<f32>) -> NifHit {
  var hit : NifHit = NifHit(false, !nif_doubtful, nif_infinity(), vec3<f32>(0.0), NIF_NONE, 0.0, 0.0, NIF_NONE);
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
  let way_1 : vec3<f32> = nif_unit(edge_1);
  let way_2 : vec3<f32> = nif_unit(edge_2);
  let plus : vec3<f32> = way_1.yzx * way_2.zxy;
  let minus : vec3<f32> = way_1.zxy * way_2.yzx;
  let across : vec3<f32> = plus - minus;
  var normal : vec3<f32> = across;
  if (nif_hit_instance != NIF_NONE) {
    hit.instance = nif_word(nif_hit_instance + 23u);
    if ((nif_word(nif_hit_instance + 21u) & 0x20000000u) == 0u) {
      let by_x : vec3<f32> = nif_vector(nif_hit_instance) * across.x;
      let by_y : vec3<f32> = nif_vector(nif_hit_instance + 3u) * across.y;
      let by_z : vec3<f32> = nif_vector(nif_hit_instance + 6u) * across.z;
      let by_two : vec3<f32> = by_x + by_y;
      let by_all : vec3<f32> = by_two + by_z;
      normal = by_all;
    }
  }
  let way : vec3<f32> = nif_unit(direction);
  normal = nif_unit(normal);
  let facing : f32 = nif_row(normal, way);
  normal = select(normal, -normal, facing > 0.0);
  hit.normal = select(-way, normal, nif_largest(normal) > 0.0);
  return hit;
}

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

// The same of a scene, whose words begin at `scene`, for a ray in world space. It meets the instances whose mask has a bit
// in common with `mask`.
fn nif_query_scene(scene : u32, origin : vec3<f32>, direction : vec3<f32>, tmin : f32, tmax : f32, mask : u32) -> NifAnswer {
  return nif_ask_scene(scene, origin, direction, tmin, tmax, mask, true);
}
fn nif_prove_scene(scene : u32, origin : vec3<f32>, direction : vec3<f32>, tmin : f32, tmax : f32, mask : u32) -> NifAnswer {
  let valid : bool = nif_is_valid(origin, direction, tmin, tmax);
  return nif_or_open(nif_ask_scene(scene, origin, direction, tmin, tmax, mask, false), valid);
}

// The first triangle that the ray hits, of an object or of a scene. Objects without triangles are not hit; if they may be in
// the way, the hit is not certain.
fn nif_first_hit(object : u32, origin : vec3<f32>, direction : vec3<f32>, tmin : f32, tmax : f32) -> NifHit {
  nif_forget_triangles(true);
  nif_find_first(object, origin, direction, tmin, tmax, -1.0, true, NIF_NONE);
  return nif_take_hit(direction);
}
fn nif_first_hit_scene(scene : u32, origin : vec3<f32>, direction : vec3<f32>, tmin : f32, tmax : f32, mask : u32) -> NifHit {
  nif_forget_triangles(true);
  if (nif_word(scene) != 0x4346494eu || nif_word(scene + 1u) != 2u) {
    nif_doubtful = true;
    return nif_take_hit(direction);
  }
  let alone : bool = nif_word(scene + 4u) == 1u;
  let valid : bool = nif_is_valid(origin, direction, tmin, tmax);
  let no_points : bool = !nif_is_nan(tmin) && !nif_is_nan(tmax) && tmin > tmax;
  nif_doubtful = !NIF_PROVES || (nif_word(scene + 3u) & 2u) == 0u || (!valid && !no_points);
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
