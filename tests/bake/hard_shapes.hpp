// Meshes on which a proof could go wrong: intact ones, and ones broken as by scanners, artists and programs.
#pragma once

#include <cmath>

#include "formats/base/random.hpp"
#include "formats/mesh/mesh_scene.hpp"

namespace nif::test {

enum Shape {
  kSphere,
  kTorus,
  kNested,
  kCube,
  kBowl,
  kFar,
  kBroken,
  kCracked,
  kDoubled,
  kNearFaces,
  kPockets,
  kSlivers,
  kSoup,
  kShapes
};

/// Voxels along the longest side for cells that are cut `levels` times: 0, 2 or 4.
uint32_t resolution_of(Shape shape, uint32_t levels);

mesh::Mesh make_shape(Shape shape, uint32_t levels);

/// A number between `low` and `high`, of either sign, as often near one power of two as near another.
inline double random_size(nif::Random& random, double low, double high) {
  const double size = low * std::pow(high / low, random.uniform());
  return random.below(2) ? size : -size;
}

}  // namespace nif::test
