// Derives sides by union-find over the regions of all cells. Where two cells share a face, two regions are
// joined if a point of the face lies beyond both planes. All in integers, so baker and loader always agree.
#include "formats/nif/planes/cell_sides.hpp"

#include <algorithm>
#include <array>
#include <bit>

#include "formats/base/disjoint_sets.hpp"
#include "kernels/reference/planes/grid_traversal.hpp"

namespace nif::format {
namespace {

using kernels::PlanesField;

/// A voxel, a child of one, or what lies beyond the grid.
struct Cell {
  uint32_t word;
  uint32_t node;  ///< the first of its regions
  std::array<int32_t, 3> low;
  int32_t size;
};

/// A square on a plane across an axis, where two cells meet.
struct Face {
  int axis;
  std::array<int32_t, 3> low;
  int32_t size;
};

/// How far the corners of a face are beyond a plane, all on the same scale; above 0 is strictly beyond.
/// Corner c: bit 0 along the next axis, bit 1 along the one after.
using Beyond = std::array<int32_t, 4>;

bool all_positive(const Beyond& f) { return f[0] > 0 && f[1] > 0 && f[2] > 0 && f[3] > 0; }
bool any_positive(const Beyond& f) { return f[0] > 0 || f[1] > 0 || f[2] > 0 || f[3] > 0; }

/// Is a point between two corners beyond both planes? Both distances are linear in between.
bool meet_on_edge(int64_t f0, int64_t f1, int64_t g0, int64_t g1) {
  if ((f0 > 0 && g0 > 0) || (f1 > 0 && g1 > 0)) return true;
  if (f0 > 0 && g1 > 0) return -g0 * (f0 - f1) < f0 * (g1 - g0);  // f until f0/(f0-f1), g from -g0/(g1-g0) on
  if (f1 > 0 && g0 > 0) return -g1 * (f1 - f0) < f1 * (g0 - g1);
  return false;
}

/// Is a point of the face beyond both planes? The region beyond both is unbounded within the face's plane, so
/// if it contains a point of the face, it contains one on the face's border.
bool meet(const Beyond& f, const Beyond& g) {
  if (!any_positive(f) || !any_positive(g)) return false;
  if (all_positive(f) || all_positive(g)) return true;
  return meet_on_edge(f[0], f[1], g[0], g[1]) || meet_on_edge(f[2], f[3], g[2], g[3]) ||
         meet_on_edge(f[0], f[2], g[0], g[2]) || meet_on_edge(f[1], f[3], g[1], g[3]);
}

class Joiner {
 public:
  static constexpr uint32_t kOutside = 0, kInside = 1, kFirst = 2, kNone = 0xffffffffu;

  explicit Joiner(const PlanesField& field) : field_(field), nodes_(number(field)), sets_(nodes_.back()) {}

  uint32_t node(uint32_t record) const { return nodes_[record]; }
  DisjointSets& sets() { return sets_; }

  void join_all() {
    for (int32_t z = 0; z < int32_t(field_.voxels[2]); ++z)
      for (int32_t y = 0; y < int32_t(field_.voxels[1]); ++y)
        for (int32_t x = 0; x < int32_t(field_.voxels[0]); ++x) {
          const Cell cell = voxel({x, y, z});
          const bool surface = is_surface(cell);
          if (surface) join_within(cell);
          for (int axis = 0; axis < 3; ++axis) {
            std::array<int32_t, 3> beside = {x, y, z};
            const size_t a = size_t(axis);
            if (beside[a] == 0 && surface) join(beyond(), cell, low_face(cell, axis));
            Face face = low_face(cell, axis);
            face.low[a] += cell.size;
            const bool last = ++beside[a] == int32_t(field_.voxels[a]);
            if (last && !surface) continue;
            const Cell other = last ? beyond() : voxel(beside);
            // Empty voxels have the state in the file; which of them touch does not matter.
            if (surface || is_surface(other)) join(cell, other, face);
          }
        }
  }

 private:
  static bool is_surface(const Cell& cell) { return kernels::word_kind(cell.word) != kernels::kEmptyVoxel; }

  /// The first node of each record, and at the end the number of nodes: two for planes, and one for each
  /// child of a link that no triangle touches.
  static std::vector<uint32_t> number(const PlanesField& field) {
    std::vector<uint32_t> nodes;
    nodes.reserve(size_t(field.surface_voxels) + field.child_count + 1);
    uint32_t next = kFirst;
    const auto add = [&](const uint32_t* words, uint32_t count) {
      for (uint32_t i = 0; i < count; ++i) {
        nodes.push_back(next);
        next += kernels::word_kind(words[i]) == kernels::kLink
                    ? 8 - uint32_t(std::popcount(kernels::link_mask(words[i])))
                    : 2;
      }
    };
    add(field.voxel_records, field.surface_voxels);
    add(field.children, field.child_count);
    nodes.push_back(next);
    return nodes;
  }

  static Cell beyond() { return {kernels::make_empty(kernels::kSeenOutside), kOutside, {}, 0}; }

  static Face low_face(const Cell& cell, int axis) { return {axis, cell.low, cell.size}; }

  Cell voxel(const std::array<int32_t, 3>& at) const {
    Cell cell{0, kNone, {}, 1 << field_.levels};
    for (size_t a = 0; a < 3; ++a) cell.low[a] = at[a] << field_.levels;
    const kernels::VoxelAddress place = kernels::voxel_address(field_, at.data());
    if (place.entry >= kernels::kFirstMixedBrick) {
      const uint32_t brick = place.entry - kernels::kFirstMixedBrick;
      const kernels::BrickStates& states = field_.brick_states[brick];
      if (kernels::state_in(states, place.bit) == kernels::VoxelState::surface) {
        const uint64_t below = states.surface & ~states.aux & ((uint64_t{1} << place.bit) - 1);
        const uint32_t record = field_.voxel_base[brick] + uint32_t(std::popcount(below));
        cell.word = field_.voxel_records[record];
        cell.node = nodes_[record];
        return cell;
      }
    }
    cell.word = kernels::voxel_word(field_, at.data());
    const uint32_t side = kernels::empty_side(cell.word);
    cell.node = side == kernels::kSeenOutside ? kOutside : side == kernels::kSeenInside ? kInside : kNone;
    return cell;
  }

  /// Part `child` of a cell that is cut.
  Cell child_of(const Cell& cell, uint32_t octant) const {
    const uint32_t mask = kernels::link_mask(cell.word);
    Cell child{kernels::kEmptyChild, 0, cell.low, cell.size / 2};
    for (size_t a = 0; a < 3; ++a)
      if (octant >> a & 1) child.low[a] += child.size;
    if (mask >> octant & 1) {
      const uint32_t index = kernels::link_child(cell.word, octant);
      child.word = field_.children[index];
      child.node = nodes_[field_.surface_voxels + index];
    } else {
      child.node = cell.node + uint32_t(std::popcount(~mask & ((1u << octant) - 1)));
    }
    return child;
  }

  static bool is_cut(const Cell& cell) { return kernels::word_kind(cell.word) == kernels::kLink; }

  /// Joins the children of a cell with each other.
  void join_within(const Cell& cell) {
    if (!is_cut(cell)) return;
    for (uint32_t octant = 0; octant < 8; ++octant) {
      const Cell child = child_of(cell, octant);
      join_within(child);
      for (int axis = 0; axis < 3; ++axis) {
        if (octant >> axis & 1) continue;
        const Cell other = child_of(cell, octant | 1u << axis);
        join(child, other, low_face(other, axis));
      }
    }
  }

  /// Joins what meets on a face, `low` on its lower side.
  void join(const Cell& low, const Cell& high, const Face& face) {
    if (!is_cut(low) && !is_cut(high)) {
      join_whole(low, high, face);
      return;
    }
    const size_t b = size_t(face.axis + 1) % 3, c = size_t(face.axis + 2) % 3;
    for (uint32_t q = 0; q < 4; ++q) {
      Face quarter{face.axis, face.low, face.size / 2};
      if (q & 1) quarter.low[b] += quarter.size;
      if (q & 2) quarter.low[c] += quarter.size;
      const uint32_t octant = (q & 1) << b | (q >> 1) << c;
      join(is_cut(low) ? child_of(low, octant | 1u << face.axis) : low,
           is_cut(high) ? child_of(high, octant) : high, quarter);
    }
  }

  struct Region {
    uint32_t node;
    Beyond beyond;
  };

  /// The regions of a cell that is not cut.
  static uint32_t regions_of(const Cell& cell, const Face& face, Region (&regions)[2]) {
    if (!is_surface(cell)) {
      if (cell.node == kNone) return 0;
      regions[0] = {cell.node, {1, 1, 1, 1}};
      return 1;
    }
    // Positions from the middle are doubled, so that they are integers; heights and planes are times 256.
    const kernels::CellNormal normal = kernels::cell_normal(cell.word);
    const int32_t n[3] = {normal.x, normal.y, normal.z};
    const int32_t step = 2 * (kernels::kNormalHalf * cell.size + 1), half = kernels::kPlaneOffsets / 2;
    const int32_t upper = (int32_t(kernels::upper_offset(cell.word)) - half) * step,
                  lower = (int32_t(kernels::lower_offset(cell.word)) - half) * step;
    int32_t corner = 0;
    for (size_t a = 0; a < 3; ++a) corner += n[a] * (2 * (face.low[a] - cell.low[a]) - cell.size);
    const int32_t along[2] = {2 * face.size * n[(face.axis + 1) % 3], 2 * face.size * n[(face.axis + 2) % 3]};
    for (uint32_t k = 0; k < 4; ++k) {
      const int32_t height = half * (corner + (k & 1 ? along[0] : 0) + (k & 2 ? along[1] : 0));
      regions[0].beyond[k] = height - upper;
      regions[1].beyond[k] = lower - height;
    }
    regions[0].node = cell.node;
    regions[1].node = cell.node + 1;
    return 2;
  }

  void join_whole(const Cell& low, const Cell& high, const Face& face) {
    Region below[2], above[2];
    const uint32_t low_count = regions_of(low, face, below), high_count = regions_of(high, face, above);
    for (uint32_t i = 0; i < low_count; ++i)
      for (uint32_t j = 0; j < high_count; ++j)
        if (meet(below[i].beyond, above[j].beyond)) sets_.unite(below[i].node, above[j].node);
  }

  const PlanesField& field_;
  const std::vector<uint32_t> nodes_;
  DisjointSets sets_;
};

}  // namespace

SideRegions::SideRegions(const PlanesField& field) {
  Joiner joiner(field);
  joiner.join_all();
  DisjointSets& sets = joiner.sets();
  const uint32_t outside = sets.find(Joiner::kOutside), inside = sets.find(Joiner::kInside);
  contradictory_ = outside == inside;
  const auto side = [&](uint32_t node) -> uint32_t {
    const uint32_t set = sets.find(node);
    return set == outside ? kernels::kSeenOutside : set == inside ? kernels::kSeenInside : 0u;
  };
  const auto add = [&](const uint32_t* words, uint32_t count) {
    for (uint32_t i = 0; i < count; ++i) {
      const uint32_t node = joiner.node(uint32_t(sides_.size()));
      const bool planes = kernels::word_kind(words[i]) != kernels::kLink;
      sides_.push_back(planes ? uint8_t(side(node) | side(node + 1) << 2) : uint8_t{0});
    }
  };
  sides_.reserve(size_t(field.surface_voxels) + field.child_count);
  add(field.voxel_records, field.surface_voxels);
  add(field.children, field.child_count);
}

}  // namespace nif::format
