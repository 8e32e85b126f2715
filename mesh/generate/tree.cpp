// `tree`: limbs as tapered tubes, with at most a fifth of the triangles, and leaves of four triangles each:
// two halves that are folded along the rib, and two below them that close the leaf.
#include <algorithm>
#include <array>
#include <cmath>

#include "formats/base/random.hpp"
#include "mesh/generate/axes.hpp"
#include "mesh/generate/computed.hpp"
#include "mesh/generate/noise.hpp"
#include "mesh/generate/shapes.hpp"
#include "mesh/generate/tree_limbs.hpp"
#include "mesh/generate/tube.hpp"
#include "mesh/generate/turn.hpp"

namespace nif::generate {
namespace {

constexpr uint64_t kLeafStream = 0x6c656166;  // "leaf"
constexpr double kLongestLeaf = 0.6;

/// How finely a limb of a level is tessellated.
Tube tube_of(size_t level, double fineness) {
  constexpr std::array<Tube, kLimbLevels> kTubes{{{24, 32}, {8, 8}, {6, 5}, {4, 4}, {3, 3}, {3, 2}}};
  return {std::max<uint64_t>(3, uint64_t(double(kTubes[level].sides) * fineness + 0.5)),
          std::max<uint64_t>(2, uint64_t(double(kTubes[level].rings) * fineness + 0.5))};
}

/// The tubes of each level, and the number of limbs that get one.
struct Division {
  std::array<Tube, kLimbLevels> tubes;
  uint64_t limbs, triangles;

  /// As many limbs as `most` triangles allow, but at least one; no tubes for limbs that do not exist.
  Division(double fineness, uint64_t most) : limbs(0), triangles(0) {
    bool whole = true;  // so far
    for (size_t level = 0; level < kLimbLevels; ++level) {
      tubes[level] = tube_of(level, fineness);
      const uint64_t each = tubes[level].triangle_count(), wanted = whole ? limbs_of_level(level) : 0;
      const uint64_t count =
          std::clamp<uint64_t>((most - std::min(most, triangles)) / each, level == 0, wanted);
      whole = count == limbs_of_level(level);
      limbs += count;
      triangles += count * each;
    }
  }

  static Division of(uint64_t triangles) {
    // Coarse tubes for a small tree, full ones from 20,000 triangles on, finer ones once there are enough
    // triangles for all limbs.
    double fineness = std::clamp(std::sqrt(double(triangles) / 20'000), 0.1, 1.0);
    Division division(fineness, triangles);
    if (division.limbs < limbs_of_tree()) return division;
    for (fineness = std::sqrt(double(triangles) / double(division.triangles));; fineness *= 0.97) {
      division = Division(fineness, triangles);
      if (division.limbs == limbs_of_tree()) return division;
    }
  }
};

class Tree {
 public:
  explicit Tree(const Request& request) : seed_(request.seed), bark_(request.seed, 1) {
    const Division division = Division::of(request.triangles / 5);
    tubes_ = division.tubes;
    limbs_ = grow_limbs(seed_, division.limbs);
    for (size_t level = 0; level < kLimbLevels; ++level) {
      const uint64_t count = limbs_.first[level + 1] - limbs_.first[level];
      vertex_first_[level + 1] = vertex_first_[level] + count * tubes_[level].vertex_count();
      triangle_first_[level + 1] = triangle_first_[level] + count * tubes_[level].triangle_count();
    }
    leaves_ = (request.triangles - triangle_first_.back()) / 4;
    // Leaves cover the same total area, whatever their number.
    leaf_ = std::min(kLongestLeaf, 26 / std::sqrt(double(leaves_)));
    // They grow on the two finest levels, with the same number per metre of limb.
    const size_t depth = limbs_.depth();
    leafy_ = limbs_.first[depth > 1 ? depth - 1 : depth];
    double sum = 0;
    for (uint64_t i = leafy_; i < limbs_.all.size(); ++i)
      length_before_.push_back(sum += limbs_.all[i].length);
  }

  uint64_t vertex_count() const { return vertex_first_.back() + 4 * leaves_; }
  uint64_t triangle_count() const { return triangle_first_.back() + 4 * leaves_; }

  Double3 vertex(uint64_t index) const {
    if (index >= vertex_first_.back()) {
      index -= vertex_first_.back();
      return leaf_vertex(index / 4, index % 4);
    }
    const size_t level = level_of(vertex_first_, index);
    const uint64_t within = index - vertex_first_[level], each = tubes_[level].vertex_count();
    return limb_vertex(limbs_.all[limbs_.first[level] + within / each], level, within % each);
  }

  mesh::Triangle triangle(uint64_t index) const {
    if (index >= triangle_first_.back()) {
      index -= triangle_first_.back();
      const auto rib = uint32_t(vertex_first_.back() + index / 4 * 4);
      const uint32_t end = rib + 1, left = rib + 2, right = rib + 3;
      constexpr size_t kHalves = 2;
      if (index % 4 < kHalves)
        return index % 4 == 0 ? mesh::Triangle{rib, end, left} : mesh::Triangle{rib, right, end};
      return index % 4 == kHalves ? mesh::Triangle{rib, left, right} : mesh::Triangle{end, right, left};
    }
    const size_t level = level_of(triangle_first_, index);
    const uint64_t within = index - triangle_first_[level], each = tubes_[level].triangle_count();
    return tubes_[level].triangle(within % each,
                                  vertex_first_[level] + within / each * tubes_[level].vertex_count());
  }

 private:
  using Firsts = std::array<uint64_t, kLimbLevels + 1>;

  static size_t level_of(const Firsts& firsts, uint64_t index) {
    size_t level = 0;
    while (index >= firsts[level + 1]) ++level;
    return level;
  }

  Double3 limb_vertex(const Limb& limb, size_t level, uint64_t index) const {
    const Tube& tube = tubes_[level];
    if (index == 0) return limb.at(0) - limb.tangent(0) * (0.1 * limb.base);
    if (index == tube.vertex_count() - 1) return limb.at(1) + limb.tangent(1) * limb.tip;
    const double t = double((index - 1) / tube.sides) / double(tube.rings - 1);
    const Turn about = turn(double((index - 1) % tube.sides) / double(tube.sides));
    const Double3 along = limb.tangent(t), x = unit(limb.aside - along * dot(limb.aside, along)),
                  outwards = x * about.cos + cross(along, x) * about.sin;
    double radius = limb.radius(t);
    if (level == 0) {  // roots
      const double near_ground = smoothstep(0.16, 0, t);
      radius *= 1 + near_ground * near_ground * (0.7 + 0.5 * bark_(outwards * 2));
    }
    const Double3 smooth = limb.at(t) + outwards * radius;
    return smooth + outwards * (radius * 0.16 *
                                bark_.octaves(Double3{smooth[0] * 9, smooth[1] * 3, smooth[2] * 9}, 3, 0.6));
  }

  /// Base and end of the rib, left and right.
  Double3 leaf_vertex(uint64_t leaf, uint64_t corner) const {
    Random random(seed_, kLeafStream, leaf);
    const double way = (double(leaf) + random.uniform()) / double(leaves_) * length_before_.back();
    const auto found = std::upper_bound(length_before_.begin(), length_before_.end() - 1, way);
    const Limb& limb = limbs_.all[leafy_ + uint64_t(found - length_before_.begin())];
    const double t = random.uniform(0.15, 1);
    const Double3 along = limb.tangent(t), stem = limb.at(t);
    // Around the limb, farther away if no finer limbs carry leaves.
    const double reach = 0.3 * leaf_ + 0.22 * limb.length * random.uniform();
    const Double3 away = random.direction();
    const Double3 base = stem + (away - along * (0.7 * dot(away, along))) * reach;
    Double3 rib = along * 0.5 + away + Double3{0, -0.15, 0} + random.direction() * 0.5;
    rib = rib * (1 / std::fmax(length(rib), 0.05));
    if (corner == 0) return base;
    const double size = leaf_ * random.uniform(0.7, 1.15);
    if (corner == 1) return base + rib * size;
    // The upper side faces roughly upwards.
    const Double3 up = Double3{0, 1, 0} + random.direction() * 0.6;
    Double3 left = cross(up, rib);
    const double flat = length(left);
    left = flat > 0.05 ? left * (1 / flat) : perpendicular(unit(rib));
    const Double3 above = cross(rib, left);
    return base + (rib * 0.42 + left * (corner == 2 ? 0.26 : -0.26) - above * 0.08) * size;
  }

  uint64_t seed_;
  Noise bark_;
  Limbs limbs_;
  std::array<Tube, kLimbLevels> tubes_;
  Firsts vertex_first_{}, triangle_first_{};
  uint64_t leaves_ = 0;
  double leaf_ = 0;                    ///< length
  uint64_t leafy_ = 0;                 ///< number of the first limb with leaves
  std::vector<double> length_before_;  ///< total length of leafy limbs up to and including each one
};

}  // namespace

std::unique_ptr<mesh::MeshSource> make_tree(const Request& request) { return computed(Tree(request)); }

}  // namespace nif::generate
