// The shape that a statue is carved from: a head on a bust on a foot, as a distance field.
#pragma once

#include <cstdint>

#include "formats/base/vector.hpp"

namespace nif::generate {

/// y is up, the face looks towards +z, give or take a turn of the head; from kFoot to about 1.3 high. The
/// axis x = 0, z = kAxisZ lies within it from foot to crown.
class Bust {
 public:
  static constexpr double kFoot = -3.0, kAxisZ = -0.15;

  /// The seed draws the head's turn and proportions.
  explicit Bust(uint64_t seed);

  /// About the distance to the surface, negative inside. Continuous near the surface.
  double distance(const Double3& p) const;

  /// A point as if the head looked towards +z.
  Double3 unturned(const Double3& p) const;
  /// How far a point on the surface belongs to the hair, and to the cloth; 0 to 1.
  double hair(const Double3& unturned) const;
  double cloth(const Double3& p) const;

 private:
  double head(const Double3& unturned) const;
  double face(double skull, const Double3& p) const;
  double eye(const Double3& p) const;
  double torso(const Double3& p) const;

  double turn_;               ///< of the head, in turns
  double width_;              ///< of the head, times
  double nose_, jaw_, brow_;  ///< lengths, added
};

}  // namespace nif::generate
