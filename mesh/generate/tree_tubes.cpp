// Tubes are coarse for a small tree, and finer once there are enough triangles for all limbs.
#include "mesh/generate/tree_tubes.hpp"

#include <algorithm>
#include <cmath>

#include "mesh/generate/axes.hpp"
#include "mesh/generate/turn.hpp"

namespace nif::generate {
namespace {

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
  Division(const Habit& habit, double fineness, uint64_t most) : limbs(0), triangles(0) {
    bool whole = true;  // so far
    for (size_t level = 0; level < kLimbLevels; ++level) {
      tubes[level] = tube_of(level, fineness);
      const uint64_t each = tubes[level].triangle_count(), wanted = whole ? limbs_of_level(habit, level) : 0;
      const uint64_t count =
          std::clamp<uint64_t>((most - std::min(most, triangles)) / each, level == 0, wanted);
      whole = count == limbs_of_level(habit, level);
      limbs += count;
      triangles += count * each;
    }
  }

  static Division of(const Habit& habit, uint64_t triangles) {
    // Coarse tubes for a small tree, full ones from 20,000 triangles on, finer ones once there are enough
    // triangles for all limbs.
    double fineness = std::clamp(std::sqrt(double(triangles) / 20'000), 0.1, 1.0);
    Division division(habit, fineness, triangles);
    if (division.limbs < limbs_of_tree(habit)) return division;
    for (fineness = std::sqrt(double(triangles) / double(division.triangles));; fineness *= 0.97) {
      division = Division(habit, fineness, triangles);
      if (division.limbs == limbs_of_tree(habit)) return division;
    }
  }
};

}  // namespace

LimbTubes::LimbTubes(const Habit& habit, uint64_t seed, uint64_t triangles) : bark_(seed, 1) {
  const Division division = Division::of(habit, triangles);
  tubes_ = division.tubes;
  limbs_ = grow_limbs(habit, seed, division.limbs);
  for (size_t level = 0; level < kLimbLevels; ++level) {
    const uint64_t count = limbs_.first[level + 1] - limbs_.first[level];
    vertex_first_[level + 1] = vertex_first_[level] + count * tubes_[level].vertex_count();
    triangle_first_[level + 1] = triangle_first_[level] + count * tubes_[level].triangle_count();
  }
  const size_t depth = limbs_.depth();
  leafy_ = limbs_.first[depth > 1 ? depth - 1 : depth];
  double sum = 0;
  for (uint64_t i = leafy_; i < limbs_.all.size(); ++i) length_before_.push_back(sum += limbs_.all[i].length);
}

Double3 LimbTubes::vertex(uint64_t index) const {
  const size_t level = level_of(vertex_first_, index);
  const uint64_t within = index - vertex_first_[level], each = tubes_[level].vertex_count();
  return limb_vertex(limbs_.all[limbs_.first[level] + within / each], level, within % each);
}

mesh::Triangle LimbTubes::triangle(uint64_t index) const {
  const size_t level = level_of(triangle_first_, index);
  const uint64_t within = index - triangle_first_[level], each = tubes_[level].triangle_count();
  return tubes_[level].triangle(within % each,
                                vertex_first_[level] + within / each * tubes_[level].vertex_count());
}

const Limb& LimbTubes::leafy(double part) const {
  const double way = part * length_before_.back();
  const auto found = std::upper_bound(length_before_.begin(), length_before_.end() - 1, way);
  return limbs_.all[leafy_ + uint64_t(found - length_before_.begin())];
}

size_t LimbTubes::level_of(const Firsts& firsts, uint64_t index) {
  size_t level = 0;
  while (index >= firsts[level + 1]) ++level;
  return level;
}

Double3 LimbTubes::limb_vertex(const Limb& limb, size_t level, uint64_t index) const {
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

}  // namespace nif::generate
