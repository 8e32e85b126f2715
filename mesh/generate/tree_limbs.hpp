// The skeleton of a tree: trunk, limbs on it, limbs on those, down to twigs.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "formats/base/vector.hpp"

namespace nif::generate {

inline constexpr size_t kLimbLevels = 6;  ///< trunk to twigs
inline constexpr double kGolden = 0.6180339887498949;

/// How a kind of tree grows. The default is a broad crown. In metres and turns.
struct Habit {
  double height = 6.2, base = 0.3, tip = 0.06;  ///< of the trunk; the latter two are radii
  double lean = 0.25;                           ///< how far it may bend
  std::array<uint64_t, kLimbLevels - 1> children{14, 10, 8, 7, 8};  ///< of each limb, by level
  /// Upward component of the outer half of limbs, by level.
  std::array<double, kLimbLevels> lift{0, 0.45, 0.3, 0.1, -0.1, -0.2};
  double steepest = -0.15;  ///< limit of the initial downward direction of a limb
  double lowest = 0.36;     ///< where the first limb leaves the trunk, as a part of its length

  /// A value that falls from the foot of the parent (0) to its tip (1).
  struct Fall {
    double first, linear, square;
    double at(double t) const { return first - linear * t - square * t * t; }
  };
  /// From one limb to the next, around their parent, in turns. With the default they wind along it as a helix.
  double around = 2 * (1 - kGolden);
  Fall angle{0.21, 0.09, 0};   ///< between the trunk and its limbs
  Fall length{0.56, 0, 0.32};  ///< of the trunk's limbs, as a part of its own
  Fall further{0.52, 0.2, 0};  ///< the same for limbs of limbs
};

/// A limb around a quadratic curve, thinner towards its tip. In metres; y is up.
struct Limb {
  std::array<Double3, 3> control;  ///< control points of the Bezier curve
  Double3 aside;                   ///< a unit vector that is never parallel to the curve
  double base, tip;                ///< radii
  double length;                   ///< of the control polygon

  Double3 at(double t) const;       ///< point at t, from 0 at the base to 1 at the tip
  Double3 tangent(double t) const;  ///< direction at t, of length 1
  double radius(double t) const { return base + t * (tip - base); }
};

struct Limbs {
  std::vector<Limb> all;                          ///< level after level
  std::array<uint64_t, kLimbLevels + 1> first{};  ///< number of the first limb of each level, and the end

  size_t depth() const;  ///< the deepest level that has a limb
};

/// Number of limbs of a level of a full tree, and of all levels together.
uint64_t limbs_of_level(const Habit& habit, size_t level);
uint64_t limbs_of_tree(const Habit& habit);

/// The tree of this seed with `count` limbs, 1 to limbs_of_tree(). A smaller count gives a part of the same
/// tree: the finest level lacks limbs, evenly over the crown.
Limbs grow_limbs(const Habit& habit, uint64_t seed, uint64_t count);

}  // namespace nif::generate
