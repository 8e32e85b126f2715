// What is known inside a surface voxel: 32 bits that hold two planes, or a link to the children that the
// voxel is cut into.
//
// All triangles that come within kSurfacePadding of a cell lie between its two planes there. The region above
// the upper plane is convex and touched by no triangle, and so is the region below the lower one: each side
// may be proven outside or inside, like a voxel's state. A wall separates both: whatever passes from above to
// below within the padded cell meets a triangle.
//
// Like grid_traversal.hpp, this header defines the answer, in the same arithmetic.
#pragma once

#include "kernels/reference/arithmetic.hpp"
#include "kernels/reference/planes/planes_field.hpp"

namespace nif::kernels {

/// How far voxels and cells are padded when the baker tests which triangles they meet, in finest cells.
inline constexpr double kSurfacePadding = 1.0 / 64;

/// Sides that a traversal has been on, as bits; a side of a cell is one of these, or 0 if nothing is proven.
enum SeenBits : uint32_t { kSeenOutside = 1, kSeenInside = 2, kSeenBoth = 3 };

/// Bits 0..3 of a word: kinds of planes below kEmptyVoxel.
enum WordKind : uint32_t {
  kPlaneKinds = 14,
  kEmptyVoxel = 14,  ///< not a surface voxel; only in packed tables, never in a file
  kLink = 15
};

/// What the planes of a cell prove besides misses.
struct CellKind {
  uint32_t above, below;  ///< SeenBits of the sides
  bool wall;
};
/// Not every combination has a kind: one that has none is stored as a kind that says less (kind_of()).
inline constexpr CellKind kCellKinds[kPlaneKinds] = {
    {0, 0, false}, {0, 1, false}, {1, 0, false}, {0, 2, false}, {2, 0, false}, {1, 1, false}, {1, 2, false},
    {2, 1, false}, {0, 0, true},  {0, 1, true},  {1, 0, true},  {0, 2, true},  {2, 0, true},  {1, 1, true}};

/// The kind that says most about a cell. A wall between outside and inside adds nothing.
constexpr uint32_t kind_of(CellKind known) {
  if (known.above == kSeenInside && known.below == kSeenInside) known.below = 0;
  if ((known.above | known.below) == kSeenBoth) known.wall = false;
  for (uint32_t kind = 0; kind < kPlaneKinds; ++kind)
    if (kCellKinds[kind].above == known.above && kCellKinds[kind].below == known.below &&
        kCellKinds[kind].wall == known.wall)
      return kind;
  return 0;
}

// Normals are integers whose absolute values sum to kNormalSum, with z at least 0. Two 6-bit numbers encode
// one (a hemisphere mapped to a square by way of an octahedron; Cigolle et al. 2014).
inline constexpr int32_t kNormalSum = 62, kNormalHalf = kNormalSum / 2;

/// A height is a point's position along the normal, measured from the middle of its cell: one finest cell is
/// at most kNormalSum units. The planes of a cell of `size` finest cells stand at plane_height(offset, size),
/// with offset 0 to kPlaneOffsets. Every point of a padded cell lies below the last and above the first.
inline constexpr uint32_t kPlaneOffsets = 256;
NIF_HOST_DEVICE constexpr float plane_step(float size) {
  return (static_cast<float>(kNormalHalf) * size + 1) * (1.0f / (kPlaneOffsets / 2));
}
NIF_HOST_DEVICE constexpr float plane_height(uint32_t offset, float size) {
  return (static_cast<float>(offset) - static_cast<float>(kPlaneOffsets / 2)) * plane_step(size);
}
/// Distance kept between planes and triangles, in units of height: more than the error of a computed height
/// (docs/encodings/segment.md).
inline constexpr double kHeightMargin = 0.5;

/// Packs planes; u and v are 0..kNormalSum, `lower` 0..255, `upper` 1..256 (offsets).
constexpr uint32_t make_planes(uint32_t kind, uint32_t u, uint32_t v, uint32_t lower, uint32_t upper) {
  return kind | u << 4 | v << 10 | lower << 16 | (upper - 1) << 24;
}
constexpr uint32_t make_link(uint32_t mask, uint32_t first) { return kLink | mask << 4 | first << 12; }
/// The word of a voxel without surface, in packed tables.
NIF_HOST_DEVICE constexpr uint32_t make_empty(uint32_t side) { return kEmptyVoxel | side << 4; }

/// Planes that prove nothing: they leave every segment open.
inline constexpr uint32_t kBareCell = make_planes(0, kNormalHalf, kNormalHalf, 0, kPlaneOffsets);

NIF_HOST_DEVICE constexpr uint32_t word_kind(uint32_t word) { return word & 15; }
/// SeenBits of a voxel without surface.
NIF_HOST_DEVICE constexpr uint32_t empty_side(uint32_t word) { return word >> 4 & 3; }
/// Child c of a cell (bit 0: the upper half along x, bit 1: y, bit 2: z) exists if bit c is set. No triangle
/// touches a missing child.
NIF_HOST_DEVICE constexpr uint32_t link_mask(uint32_t word) { return word >> 4 & 255; }
/// Index of the first existing child; the others follow.
NIF_HOST_DEVICE constexpr uint32_t link_first(uint32_t word) { return word >> 12; }
NIF_HOST_DEVICE constexpr uint32_t link_child(uint32_t word, uint32_t child) {
  return link_first(word) + count_bits(link_mask(word) & ((1u << child) - 1));
}
NIF_HOST_DEVICE constexpr uint32_t lower_offset(uint32_t word) { return word >> 16 & 255; }
NIF_HOST_DEVICE constexpr uint32_t upper_offset(uint32_t word) { return (word >> 24) + 1; }

struct CellNormal {
  int32_t x, y, z;
};
NIF_HOST_DEVICE constexpr CellNormal cell_normal(uint32_t word) {
  const int32_t u = int32_t(word >> 4 & 63) - kNormalHalf, v = int32_t(word >> 10 & 63) - kNormalHalf;
  const int32_t width = (u < 0 ? -u : u) > (v < 0 ? -v : v) ? (u < 0 ? -u : u) : (v < 0 ? -v : v);
  return {u + v, u - v, kNormalSum - 2 * width};
}

// kCellKinds as bits, because GPUs would keep a table in memory: two bits for each kind, or one.
constexpr uint32_t pack_kinds(uint32_t CellKind::*side) {
  uint32_t packed = 0;
  for (uint32_t kind = 0; kind < kPlaneKinds; ++kind) packed |= kCellKinds[kind].*side << 2 * kind;
  return packed;
}
constexpr uint32_t pack_walls() {
  uint32_t packed = 0;
  for (uint32_t kind = 0; kind < kPlaneKinds; ++kind) packed |= uint32_t(kCellKinds[kind].wall) << kind;
  return packed;
}
inline constexpr uint32_t kSidesAbove = pack_kinds(&CellKind::above),
                          kSidesBelow = pack_kinds(&CellKind::below), kWallKinds = pack_walls();

/// Result of a segment's passage through one cell.
struct CellPassage {
  bool open;         ///< it may meet a triangle
  bool blocked;      ///< it meets one
  uint32_t seen;     ///< SeenBits of the sides in which it enters or leaves
  float begin, end;  ///< if open: the part between the planes, as t; approximate, not a bound
  uint32_t heights;  ///< heights at both ends, see make_heights()
};

/// Height of a point between the planes of a cell: 0 at the lower plane, kTopHeight at the upper one.
inline constexpr int32_t kTopHeight = 127;
NIF_HOST_DEVICE constexpr uint32_t make_heights(int32_t begin, int32_t end) {
  return uint32_t(begin) | uint32_t(end) << 8;
}
NIF_HOST_DEVICE constexpr int32_t begin_height(uint32_t heights) { return int32_t(heights & 255); }
NIF_HOST_DEVICE constexpr int32_t end_height(uint32_t heights) { return int32_t(heights >> 8); }

/// The part of a passage through a cell that lies between its planes, as t.
struct PartBetween {
  float begin, end;
};
/// For an open cell that is passed from t = enter to t = leave, at these heights.
NIF_HOST_DEVICE inline PartBetween part_between(float enter, float leave, float enter_height,
                                                float leave_height, float lower, float upper) {
  const bool enters_above = enter_height > upper, enters_below = enter_height < lower;
  const bool leaves_above = leave_height > upper, leaves_below = leave_height < lower;
  // If the cell is open and one end lies beyond a plane, the heights differ.
  const float rate = (leave - enter) / (leave_height - enter_height);
  const float first = (enters_above ? upper : lower) - enter_height,
              last = (leaves_above ? upper : lower) - enter_height;
  PartBetween part;
  part.begin = enters_above || enters_below ? min_of(max_of(enter + first * rate, enter), leave) : enter;
  part.end = leaves_above || leaves_below ? min_of(max_of(enter + last * rate, part.begin), leave) : leave;
  return part;
}

/// A segment, in finest cells, from t = enter to t = leave through a cell with planes. `middle` is the exact
/// centre of the cell.
NIF_HOST_DEVICE inline CellPassage pass_cell(uint32_t word, const float (&middle)[3], float size,
                                             const float (&origin)[3], const float (&direction)[3],
                                             float enter, float leave) {
  const CellNormal normal = cell_normal(word);
  const float n[3] = {static_cast<float>(normal.x), static_cast<float>(normal.y),
                      static_cast<float>(normal.z)};
  float enters[3], leaves[3];
  NIF_UNROLL
  for (int a = 0; a < 3; ++a) {
    const float from = origin[a] - middle[a];
    enters[a] = n[a] * (from + enter * direction[a]);
    leaves[a] = n[a] * (from + leave * direction[a]);
  }
  const float enter_height = enters[0] + enters[1] + enters[2],
              leave_height = leaves[0] + leaves[1] + leaves[2];
  const float step = plane_step(size);
  const float half = static_cast<float>(kPlaneOffsets / 2);
  const float lower = (static_cast<float>(lower_offset(word)) - half) * step,
              upper = (static_cast<float>(upper_offset(word)) - half) * step;
  const bool enters_above = enter_height > upper, enters_below = enter_height < lower;
  const bool leaves_above = leave_height > upper, leaves_below = leave_height < lower;
  const uint32_t kind = word_kind(word);
  CellPassage passage;
  passage.open = !((enters_above && leaves_above) || (enters_below && leaves_below));
  passage.blocked =
      (kWallKinds >> kind & 1) != 0 && ((enters_above && leaves_below) || (enters_below && leaves_above));
  passage.seen = (enters_above || leaves_above ? kSidesAbove >> 2 * kind & 3 : 0u) |
                 (enters_below || leaves_below ? kSidesBelow >> 2 * kind & 3 : 0u);
  const PartBetween part = part_between(enter, leave, enter_height, leave_height, lower, upper);
  passage.begin = part.begin;
  passage.end = part.end;
  const float scale = static_cast<float>(kTopHeight) / (upper - lower);
  passage.heights = make_heights(to_index((enter_height - lower) * scale + 0.5f, kTopHeight),
                                 to_index((leave_height - lower) * scale + 0.5f, kTopHeight));
  return passage;
}

/// Whether any surface voxel has planes that prove something.
inline bool has_planes(const PlanesField& field) {
  for (uint32_t i = 0; i < field.surface_voxels; ++i)
    if (field.voxel_records[i] != kBareCell) return true;
  return false;
}

}  // namespace nif::kernels
