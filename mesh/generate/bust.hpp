// The shape that a statue is carved from: a head on a bust on a foot, as a distance field.
#pragma once

#include <cstdint>

#include "formats/base/vector.hpp"

namespace nif::generate {

/// y is up, and the face looks towards +z, apart from a turn of the head; from kFoot to a height of about
/// 1.3. The axis x = 0, z = kAxisZ lies inside it from foot to crown.
class Bust {
 public:
  static constexpr double kFoot = -3.0, kAxisZ = -0.15;

  /// The seed determines the head's turn and proportions.
  explicit Bust(uint64_t seed);

  /// Approximate distance to the surface, negative inside. Continuous near the surface.
  double distance(const Double3& p) const;

  /// Rotates a point as if the head looked towards +z.
  Double3 unturned(const Double3& p) const;
  /// How much a point on the surface belongs to the hair or the cloth; 0 to 1.
  double hair(const Double3& unturned) const;
  double cloth(const Double3& p) const;

 private:
  double head(const Double3& unturned) const;
  double face(double skull, const Double3& p) const;
  double eye(const Double3& p) const;
  double torso(const Double3& p) const;

  double turn_;               ///< of the head, in turns
  double width_;              ///< of the head, a factor
  double nose_, jaw_, brow_;  ///< lengths that are added
};

}  // namespace nif::generate
