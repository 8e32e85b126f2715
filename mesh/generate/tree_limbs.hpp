// The skeleton of a tree: trunk, limbs on it, limbs on those, down to twigs.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "formats/base/vector.hpp"

namespace nif::generate {

inline constexpr size_t kLimbLevels = 6;  ///< trunk to twigs

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
uint64_t limbs_of_level(size_t level);
uint64_t limbs_of_tree();

/// The tree of this seed with `count` limbs, 1 to limbs_of_tree(). A smaller count gives a part of the same
/// tree: the finest level lacks limbs, evenly over the crown.
Limbs grow_limbs(uint64_t seed, uint64_t count);

}  // namespace nif::generate
