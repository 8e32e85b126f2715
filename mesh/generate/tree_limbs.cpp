// Grows the tree level by level: all first children, then all second ones, so that even few limbs leave no
// part bare. The golden ratio spreads children along and around their parent.
#include "mesh/generate/tree_limbs.hpp"

#include <algorithm>
#include <cmath>

#include "formats/base/random.hpp"
#include "mesh/generate/axes.hpp"
#include "mesh/generate/turn.hpp"

namespace nif::generate {
namespace {

constexpr uint64_t kLimbStream = 0x74726565;  // "tree"
/// Between limbs and the limbs on them, in turns.
constexpr Habit::Fall kFurtherAngle{0.15, 0.05, 0};

/// A curve from `start` in direction `way` that then bends towards `later`; both have length 1.
Limb limb(const Double3& start, const Double3& way, const Double3& later, double size, double base,
          double tip) {
  const Double3 middle = start + way * (size / 2), end = middle + later * (size / 2);
  return {{start, middle, end}, perpendicular(unit(end - start)), base, tip, size};
}

Limb trunk(const Habit& habit, uint64_t seed) {
  Random random(seed, kLimbStream, 0);
  const Double3 up{0, 1, 0};
  return limb({0, 0, 0}, up, unit(up + random.direction() * habit.lean), habit.height, habit.base, habit.tip);
}

/// The child of this rank; `number` is its own number, which seeds its random numbers.
Limb child(const Habit& habit, const Limb& parent, size_t level, uint64_t rank, uint64_t seed,
           uint64_t number) {
  Random random(seed, kLimbStream, number);
  // Ranks fill the parent evenly, whatever their number, and turn around it like leaves on a stem.
  const double even = 0.3 + double(rank) * kGolden, within = even - std::floor(even);
  const double lowest = level == 1 ? habit.lowest : 0.22, t = lowest + (0.98 - lowest) * within;
  const Double3 along = parent.tangent(t), x = perpendicular(along), y = cross(along, x);
  const Turn about = turn(double(rank) * habit.around + random.uniform(0, level == 1 ? 0.1 : 0.3));
  const Turn away = turn((level == 1 ? habit.angle : kFurtherAngle).at(within) + random.uniform(-0.03, 0.03));
  Double3 way = along * away.cos + (x * about.cos + y * about.sin) * away.sin;
  if (way[1] < habit.steepest) way = unit({way[0], habit.steepest, way[2]});
  const Double3 later = unit(way + Double3{0, habit.lift[level], 0} + random.direction() * 0.35);
  const double share = (level == 1 ? habit.length : habit.further).at(within);
  const double size = parent.length * share * random.uniform(0.8, 1.15);
  const double base = std::fmin(0.62 * parent.radius(t), size * 0.035);
  return limb(parent.at(t), way, later, size, base, base * 0.25);
}

}  // namespace

Double3 Limb::at(double t) const {
  return control[0] * ((1 - t) * (1 - t)) + control[1] * (2 * t * (1 - t)) + control[2] * (t * t);
}

Double3 Limb::tangent(double t) const {
  return unit((control[1] - control[0]) * (1 - t) + (control[2] - control[1]) * t);
}

size_t Limbs::depth() const {
  size_t level = kLimbLevels - 1;
  while (first[level] == first[level + 1]) --level;
  return level;
}

uint64_t limbs_of_level(const Habit& habit, size_t level) {
  uint64_t count = 1;
  for (size_t i = 0; i < level; ++i) count *= habit.children[i];
  return count;
}

uint64_t limbs_of_tree(const Habit& habit) {
  uint64_t count = 0;
  for (size_t level = 0; level < kLimbLevels; ++level) count += limbs_of_level(habit, level);
  return count;
}

Limbs grow_limbs(const Habit& habit, uint64_t seed, uint64_t count) {
  Limbs limbs;
  limbs.all.reserve(count);
  limbs.all.push_back(trunk(habit, seed));
  for (size_t level = 1; level < kLimbLevels; ++level) {
    const uint64_t begin = limbs.first[level - 1], end = limbs.all.size();
    limbs.first[level] = end;
    // All first children, then all second ones: if limbs run out, no part of the crown stays bare.
    for (uint64_t rank = 0; rank < habit.children[level - 1]; ++rank)
      for (uint64_t parent = begin; parent < end && limbs.all.size() < count; ++parent)
        limbs.all.push_back(child(habit, limbs.all[parent], level, rank, seed, limbs.all.size()));
  }
  limbs.first[kLimbLevels] = limbs.all.size();
  return limbs;
}

}  // namespace nif::generate
