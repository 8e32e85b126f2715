// The skeleton of a tree: trunk, limbs on it, limbs on those, down to twigs.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "formats/base/vector.hpp"

namespace nif::generate {

inline constexpr size_t kLimbLevels = 6;  ///< trunk to twigs

/// A limb about a quadratic curve, thinner towards its tip. Metres; y is up.
struct Limb {
  std::array<Double3, 3> control;  ///< of the curve, as Bezier has them
  Double3 aside;                   ///< a unit vector that is nowhere along the curve
  double base, tip;                ///< radii
  double length;                   ///< of the control polygon

  Double3 at(double t) const;       ///< 0 at the base to 1 at the tip
  Double3 tangent(double t) const;  ///< there, of length 1
  double radius(double t) const { return base + t * (tip - base); }
};

struct Limbs {
  std::vector<Limb> all;                          ///< level after level
  std::array<uint64_t, kLimbLevels + 1> first{};  ///< of each level, and the end

  size_t depth() const;  ///< the deepest level that has a limb
};

/// How many limbs a level of a whole tree has, and all levels together.
uint64_t limbs_of_level(size_t level);
uint64_t limbs_of_tree();

/// The tree of this seed up to `count` limbs, 1 to limbs_of_tree(). A smaller count is a part of the same
/// tree: the finest level lacks limbs, evenly over the crown.
Limbs grow_limbs(uint64_t seed, uint64_t count);

}  // namespace nif::generate
