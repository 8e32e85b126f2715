// Fits planes to the triangles of each cell, and finds walls and sides. docs/encodings/segment.md proves why
// they hold.
#include "bake/planes/fit_cells.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <limits>
#include <string>

#include "bake/planes/clipped_polygon.hpp"
#include "bake/planes/thinnest.hpp"
#include "formats/base/disjoint_sets.hpp"
#include "formats/base/random.hpp"
#include "formats/base/status.hpp"
#include "formats/nif/planes/cell_sides.hpp"
#include "kernels/reference/planes/cells.hpp"

namespace nif::bake {
namespace {

using kernels::kSurfacePadding;

/// When triangles are clipped and edges tested, cells grow by this much more than the padding: above all
/// rounding in double precision of coordinates below 2^11, and below kRoundingRoom.
constexpr double kClipRoom = 1e-9;

/// Added to heights in double precision for their rounding and that of clipping.
constexpr double kHeightRoom = 1e-6;

/// How often another path is tried if signs are in doubt.
constexpr uint64_t kMostPaths = 16;

/// A cube of finest cells.
struct Cell {
  std::array<int32_t, 3> low;
  int32_t size;

  Double3 middle() const { return {low[0] + 0.5 * size, low[1] + 0.5 * size, low[2] + 0.5 * size}; }
};

/// A triangle that touches a voxel.
struct Face {
  Double3 corners[3];  ///< in finest cells
  mesh::Triangle vertices;
  bool sliver;
  bool holes;
};

/// Does a part of the edge lie in a cube around the origin? Uses separating axes; if in doubt, yes. The
/// result is the same for either order of its ends.
bool edge_overlaps(const Double3& from, const Double3& to, double half) {
  const Double3 middle = (from + to) * 0.5, reach = (to - from) * 0.5;
  const Double3 size{std::abs(reach[0]), std::abs(reach[1]), std::abs(reach[2])};
  for (size_t a = 0; a < 3; ++a) {
    if (std::abs(middle[a]) > half + size[a]) return false;
    const size_t b = (a + 1) % 3, c = (a + 2) % 3;
    if (std::abs(middle[b] * reach[c] - middle[c] * reach[b]) > half * (size[b] + size[c])) return false;
  }
  return true;
}

double largest(const Double3& v) { return std::max({std::abs(v[0]), std::abs(v[1]), std::abs(v[2])}); }

/// The sign of the determinant of three differences of points, or 0 if rounding may decide it, including that
/// of the points' coordinates: those are below 2^11, so their error is below 2^-40.
int certain_sign(const Double3& a, const Double3& b, const Double3& c) {
  const double determinant = dot(a, cross(b, c));
  const double la = largest(a), lb = largest(b), lc = largest(c);
  // A determinant has 6 products. Each difference has an error below 1e-12, and what is computed from them
  // one of less than 8 roundings.
  const double bound = 1e-11 * (la * lb + lb * lc + lc * la) + 1e-14 * la * lb * lc;
  return determinant > bound ? 1 : determinant < -bound ? -1 : 0;
}

enum class Crossing { none, once, in_doubt };

/// Does the path from `from` to `to` cross the triangle?
Crossing crossing(const Double3& from, const Double3& to, const Double3 (&triangle)[3]) {
  const auto& [p, q, r] = triangle;
  const int first = certain_sign(q - p, r - p, from - p), last = certain_sign(q - p, r - p, to - p);
  if (first != 0 && first == last) return Crossing::none;
  const Double3 along = to - from;
  const int signs[3] = {certain_sign(along, p - from, q - p), certain_sign(along, q - from, r - q),
                        certain_sign(along, r - from, p - r)};
  const auto [low, high] = std::minmax({signs[0], signs[1], signs[2]});
  if (low < 0 && high > 0) return Crossing::none;  // the line passes beside it
  if (first == 0 || last == 0 || low != high || low == 0) return Crossing::in_doubt;
  return Crossing::once;
}

/// Fits cells one after the other, reusing its memory.
class CellFitter {
 public:
  CellFitter(const Grid& grid, const mesh::CleanMesh& mesh, double thickness)
      : grid_(grid), mesh_(mesh), thickness_(thickness) {}

  /// Adds a voxel's word to words[0], those of its children to words[1] and so on, in the order of the links
  /// that lead to them. Links have no first child yet, and planes with a wall have the kind without sides.
  void fit_voxel(const std::array<int32_t, 3>& voxel, std::span<const uint32_t> touching,
                 std::span<std::vector<uint32_t>> words) {
    Cell cell{{}, int32_t(grid_.cells())};
    for (size_t a = 0; a < 3; ++a) cell.low[a] = voxel[a] * cell.size;
    faces_.clear();
    lists_[0].clear();
    for (const uint32_t t : touching) {
      const bool sliver = t >= mesh_.triangles.size();
      Face& face = faces_.emplace_back();
      face.vertices = sliver ? mesh_.slivers[t - mesh_.triangles.size()] : mesh_.triangles[t];
      face.sliver = sliver;
      face.holes = t < mesh_.holes.size() && mesh_.holes[t].any();
      for (size_t c = 0; c < 3; ++c) face.corners[c] = grid_.to_cells(mesh_.positions[face.vertices[c]]);
      lists_[0].push_back(uint32_t(lists_[0].size()));
    }
    words[0].push_back(0);
    fit(cell, 0, words, words[0].size() - 1);
  }

 private:
  /// Writes the word of a cell, which the triangles in lists_[level] touch, to words[level][at].
  void fit(const Cell& cell, size_t level, std::span<std::vector<uint32_t>> words, size_t at) {
    bool cut = false;
    const uint32_t word = planes_of(cell, lists_[level], cell.size > 1, cut);
    if (!cut) {
      words[level][at] = word;
      return;
    }
    const int32_t size = cell.size / 2;
    const auto child_of = [&](uint32_t octant) {
      Cell child{cell.low, size};
      for (size_t a = 0; a < 3; ++a)
        if (octant >> a & 1) child.low[a] += size;
      return child;
    };
    uint32_t mask = 0;
    for (uint32_t octant = 0; octant < 8; ++octant)
      if (list_of(child_of(octant), lists_[level], nullptr)) mask |= 1u << octant;
    words[level][at] = kernels::make_link(mask, 0);
    size_t next = words[level + 1].size();
    words[level + 1].resize(next + size_t(std::popcount(mask)));
    for (uint32_t octant = 0; octant < 8; ++octant) {
      if (!(mask >> octant & 1)) continue;
      const Cell child = child_of(octant);
      list_of(child, lists_[level], &lists_[level + 1]);
      fit(child, level + 1, words, next++);
    }
  }

  /// Copies those of `from` that touch the cell to `list`, if not null. Returns true if a triangle does.
  bool list_of(const Cell& cell, const std::vector<uint32_t>& from, std::vector<uint32_t>* list) const {
    const Double3 middle = cell.middle();
    const double reach = 0.5 * cell.size + kSurfacePadding + kRoundingRoom;
    const Double3 half{reach, reach, reach};
    if (list) list->clear();
    bool any = false;
    for (const uint32_t f : from) {
      const Face& face = faces_[f];
      if (!list && face.sliver) continue;
      if (!overlaps(face.corners, middle, half)) continue;
      any = any || !face.sliver;
      if (!list) return true;
      list->push_back(f);
    }
    return any;
  }

  /// The word of a cell that is not cut. Sets `cut` if it should be.
  uint32_t planes_of(const Cell& cell, std::span<const uint32_t> list, bool may_cut, bool& cut) {
    const Double3 middle = cell.middle();
    const double half = 0.5 * cell.size + kSurfacePadding + kClipRoom;
    thinnest_.clear();
    for (const uint32_t f : list) {
      const Face& face = faces_[f];
      if (face.sliver) continue;
      const Double3 moved[3] = {face.corners[0] - middle, face.corners[1] - middle, face.corners[2] - middle};
      Polygon polygon(moved);
      polygon.clip(half);
      if (!polygon.corners().empty()) thinnest_.add(polygon.corners(), polygon.normal());
    }
    // No planes around an empty set: they would prove everything.
    if (thinnest_.empty()) return kernels::kBareCell;

    const Slab slab = thinnest_.find();
    const kernels::CellNormal normal = kernels::cell_normal(slab.normal);
    const Double3 n{double(normal.x), double(normal.y), double(normal.z)};
    const double step = kernels::plane_step(float(cell.size));
    const double half_places = kernels::kPlaneOffsets / 2;
    constexpr double room = kernels::kHeightMargin + kHeightRoom;
    int32_t lower = int32_t(std::floor((slab.lowest - room) / step) + half_places),
            upper = int32_t(std::ceil((slab.highest + room) / step) + half_places);
    lower = std::clamp(lower, 0, int32_t(kernels::kPlaneOffsets) - 1);
    upper = std::clamp(upper, lower + 1, int32_t(kernels::kPlaneOffsets));
    const double apart = (upper - lower) * step / length(n);
    if (may_cut && apart > thickness_) {
      cut = true;
      return 0;
    }
    const bool wall = is_wall(cell, list, n, (lower - half_places) * step, (upper - half_places) * step);
    cut = may_cut && !wall && apart > thickness_ / 2;
    return kernels::make_planes(kernels::kind_of({0, 0, wall}), slab.normal >> 4 & 63, slab.normal >> 10 & 63,
                                uint32_t(lower), uint32_t(upper));
  }

  struct Use {
    uint64_t edge;  // its two vertices, without direction
    uint32_t face;  // index into wall_faces_
    bool operator<(const Use& other) const {
      return edge != other.edge ? edge < other.edge : face < other.face;
    }
  };

  /// Does every path within the padded cell from above `upper` to below `lower` meet a triangle? False if
  /// that could not be shown.
  bool is_wall(const Cell& cell, std::span<const uint32_t> list, const Double3& normal, double lower,
               double upper) {
    // The ends of paths need room above and below. For the highest corner; the lowest is opposite.
    const double reach = 0.5 * cell.size + 0.9 * kSurfacePadding;
    Double3 top;
    for (size_t a = 0; a < 3; ++a) top[a] = std::copysign(reach, normal[a]);
    const double top_height = dot(normal, top);
    if (top_height - upper < 1e-3 || lower + top_height < 1e-3) return false;

    const Double3 middle = cell.middle();
    find_sets(list, middle, 0.5 * cell.size + kSurfacePadding + kClipRoom);
    for (uint64_t attempt = 0; attempt < kMostPaths; ++attempt) {
      Random random(uint64_t(cell.low[0]) << 40 | uint64_t(cell.low[1]) << 20 | uint64_t(cell.low[2]),
                    uint64_t(cell.size), attempt);
      Double3 through;
      for (double& x : through) x = random.uniform(-0.25, 0.25) * cell.size;
      const Double3 from = moved_towards(through, top, normal, 0.5 * (upper + top_height)),
                    to = moved_towards(through, top * -1.0, normal, 0.5 * (lower - top_height));
      bool doubtful = false;
      if (crosses(from, to, middle, doubtful)) return true;
      if (!doubtful) return false;
    }
    return false;
  }

  /// A point between `p` and `corner` at `height`, or `p` if that is beyond the height already.
  static Double3 moved_towards(const Double3& p, const Double3& corner, const Double3& normal,
                               double height) {
    const double from = dot(normal, p), to = dot(normal, corner);
    const double share = std::max((height - from) / (to - from), 0.0);
    return p + (corner - p) * share;
  }

  /// Finds sets of triangles that are connected over edges within the padded cell, and whether each uses
  /// every such edge an even number of times. Takes only one of several triangles on the same three vertices,
  /// and none with holes, which paths may pass.
  void find_sets(std::span<const uint32_t> list, const Double3& middle, double half) {
    wall_faces_.assign(list.begin(), list.end());
    find_ignored();
    uses_.clear();
    for (uint32_t i = 0; i < wall_faces_.size(); ++i) {
      if (ignored_[i]) continue;
      const Face& face = faces_[wall_faces_[i]];
      for (size_t c = 0; c < 3; ++c) {
        size_t from = c, to = c == 2 ? 0 : c + 1;
        if (face.vertices[from] > face.vertices[to]) std::swap(from, to);
        if (edge_overlaps(face.corners[from] - middle, face.corners[to] - middle, half))
          uses_.push_back({uint64_t{face.vertices[from]} << 32 | face.vertices[to], i});
      }
    }
    std::sort(uses_.begin(), uses_.end());
    DisjointSets sets(wall_faces_.size());
    qualified_.assign(wall_faces_.size(), 1);
    odd_.clear();
    for (size_t begin = 0, end; begin < uses_.size(); begin = end) {
      for (end = begin; end < uses_.size() && uses_[end].edge == uses_[begin].edge; ++end)
        sets.unite(uses_[end].face, uses_[begin].face);
      if ((end - begin) % 2 != 0) odd_.push_back(uses_[begin].face);
    }
    set_of_.resize(wall_faces_.size());
    for (uint32_t i = 0; i < wall_faces_.size(); ++i) set_of_[i] = sets.find(i);
    for (const uint32_t i : odd_) qualified_[set_of_[i]] = 0;
  }

  /// Marks triangles with holes, and all but the first of others on the same three vertices.
  void find_ignored() {
    order_.clear();
    ignored_.assign(wall_faces_.size(), 0);
    for (uint32_t i = 0; i < wall_faces_.size(); ++i) {
      const Face& face = faces_[wall_faces_[i]];
      ignored_[i] = face.holes;
      if (face.holes) continue;
      order_.emplace_back(face.vertices, i);
      std::ranges::sort(order_.back().first);
    }
    std::ranges::sort(order_);
    for (size_t i = 1; i < order_.size(); ++i)
      if (order_[i].first == order_[i - 1].first) ignored_[order_[i].second] = 1;
  }

  /// Does the path certainly cross one of the sets an odd number of times? Sets `doubtful` if it may.
  bool crosses(const Double3& from, const Double3& to, const Double3& middle, bool& doubtful) {
    crossed_.assign(qualified_.size(), 0);
    in_doubt_.assign(qualified_.size(), 0);
    for (size_t i = 0; i < wall_faces_.size(); ++i) {
      const uint32_t set = set_of_[i];
      if (ignored_[i] || !qualified_[set] || in_doubt_[set]) continue;
      const Face& face = faces_[wall_faces_[i]];
      const Double3 moved[3] = {face.corners[0] - middle, face.corners[1] - middle, face.corners[2] - middle};
      switch (crossing(from, to, moved)) {
        case Crossing::none:
          break;
        case Crossing::once:
          crossed_[set] ^= 1;
          break;
        case Crossing::in_doubt:
          in_doubt_[set] = 1;
          doubtful = true;
          break;
      }
    }
    for (size_t set = 0; set < qualified_.size(); ++set)
      if (qualified_[set] && !in_doubt_[set] && crossed_[set]) return true;
    return false;
  }

  const Grid& grid_;
  const mesh::CleanMesh& mesh_;
  const double thickness_;

  std::vector<Face> faces_;                               // of the voxel
  std::vector<uint32_t> lists_[kernels::kMaxLevels + 1];  // by level: those that touch the cell
  ThinnestSlab thinnest_;
  std::vector<uint32_t> wall_faces_, set_of_, odd_;  // set_of_: by wall face
  std::vector<Use> uses_;
  std::vector<std::pair<mesh::Triangle, uint32_t>> order_;
  std::vector<uint8_t> qualified_, crossed_, in_doubt_;  // by set
  std::vector<uint8_t> ignored_;                         // by wall face
};

/// A surface voxel, numbered as in the format.
struct SurfaceVoxel {
  std::array<int32_t, 3> at;
  size_t number;  ///< index in SurfaceVoxels
};

/// The surface voxels in the order of their records. Sets voxel_base.
std::vector<SurfaceVoxel> voxels_in_order(const Grid& grid, const SurfaceVoxels& surface,
                                          format::PlanesData& data) {
  std::vector<SurfaceVoxel> voxels;
  voxels.reserve(surface.voxels.size());
  data.voxel_base.clear();
  constexpr uint32_t kSide = kernels::kBrickSide;
  const uint16_t* entry = data.brick_table.data();
  for (uint32_t z = 0; z < format::bricks_for(grid.voxels[2]); ++z)
    for (uint32_t y = 0; y < format::bricks_for(grid.voxels[1]); ++y)
      for (uint32_t x = 0; x < format::bricks_for(grid.voxels[0]); ++x, ++entry) {
        if (*entry < kernels::kFirstMixedBrick) continue;
        const kernels::BrickStates& states = data.brick_states[*entry - kernels::kFirstMixedBrick];
        data.voxel_base.push_back(uint32_t(voxels.size()));
        for (uint64_t rest = states.surface & ~states.aux; rest != 0; rest &= rest - 1) {
          const uint32_t bit = uint32_t(std::countr_zero(rest));
          const uint32_t at[3] = {x * kSide + (bit & 3), y * kSide + (bit >> 2 & 3), z * kSide + (bit >> 4)};
          const auto found = std::ranges::lower_bound(surface.voxels, grid.index(at[0], at[1], at[2]));
          voxels.push_back(
              {{int32_t(at[0]), int32_t(at[1]), int32_t(at[2])}, size_t(found - surface.voxels.begin())});
        }
      }
  return voxels;
}

/// Fits all voxels. Returns false if that makes more than `most_children`.
bool fit_all(const Grid& grid, const mesh::CleanMesh& mesh, const SurfaceVoxels& surface,
             std::span<const SurfaceVoxel> voxels, double thickness, size_t most_children,
             format::PlanesData& data) {
  constexpr size_t kVoxelsAtOnce = 64;
  using Words = std::array<std::vector<uint32_t>, kernels::kMaxLevels + 1>;
  std::vector<Words> blocks((voxels.size() + kVoxelsAtOnce - 1) / kVoxelsAtOnce);
  std::atomic<size_t> children{0};
  tbb::parallel_for(size_t{0}, blocks.size(), [&](size_t b) {
    CellFitter fitter(grid, mesh, thickness);
    const size_t end = std::min((b + 1) * kVoxelsAtOnce, voxels.size());
    for (size_t i = b * kVoxelsAtOnce; i < end && children <= most_children; ++i)
      fitter.fit_voxel(voxels[i].at, surface.touching_voxel(voxels[i].number), blocks[b]);
    for (size_t level = 1; level < blocks[b].size(); ++level) children += blocks[b][level].size();
  });
  if (children > most_children) return false;

  data.voxel_records.clear();
  data.children.clear();
  for (size_t level = 0; level <= kernels::kMaxLevels; ++level)
    for (const Words& words : blocks) {
      std::vector<uint32_t>& to = level == 0 ? data.voxel_records : data.children;
      to.insert(to.end(), words[level].begin(), words[level].end());
    }
  return true;
}

/// Calls visit(word, number) for each word, the records first.
template <class Visit>
void visit_words(format::PlanesData& data, const Visit& visit) {
  uint32_t number = 0;
  for (uint32_t& word : data.voxel_records) visit(word, number++);
  for (uint32_t& word : data.children) visit(word, number++);
}

bool is_link(uint32_t word) { return kernels::word_kind(word) == kernels::kLink; }

void set_links(format::PlanesData& data) {
  uint32_t next = 0;
  visit_words(data, [&](uint32_t& word, uint32_t) {
    if (!is_link(word)) return;
    const uint32_t mask = kernels::link_mask(word);
    word = kernels::make_link(mask, next);
    next += uint32_t(std::popcount(mask));
  });
}

}  // namespace

CellCounts set_sides(std::string_view name, format::PlanesData& data) {
  const format::SideRegions sides(format::field_of(data));
  if (sides.contradictory())
    throw Error(Status::internal, "in object '" + std::string(name) +
                                      "', planes join what is outside with what is inside: a defect");
  CellCounts counts;
  counts.children = data.children.size();
  visit_words(data, [&](uint32_t& word, uint32_t number) {
    if (is_link(word)) return;
    const bool wall = kernels::kCellKinds[kernels::word_kind(word)].wall;
    ++counts.planes;
    counts.walls += wall;
    counts.bare += word == kernels::kBareCell;
    word = (word & ~15u) | kernels::kind_of({sides.above(number), sides.below(number), wall});
  });
  return counts;
}

CellCounts fit_cells(const Grid& grid, const mesh::CleanMesh& mesh, const SurfaceVoxels& surface,
                     double thickness, std::string_view name, format::PlanesData& data,
                     size_t most_children) {
  const std::vector<SurfaceVoxel> voxels = voxels_in_order(grid, surface, data);
  while (!fit_all(grid, mesh, surface, voxels, thickness, most_children, data)) thickness *= 2;
  set_links(data);
  return set_sides(name, data);
}

}  // namespace nif::bake
