// The limbs of a tree as closed, tapered tubes with bark: as many as a number of triangles allows.
#pragma once

#include <array>
#include <cstdint>

#include "formats/base/vector.hpp"
#include "formats/mesh/mesh_scene.hpp"
#include "mesh/generate/noise.hpp"
#include "mesh/generate/tree_limbs.hpp"
#include "mesh/generate/tube.hpp"

namespace nif::generate {

class LimbTubes {
 public:
  /// At most `triangles`, but at least those of a trunk.
  LimbTubes(const Habit& habit, uint64_t seed, uint64_t triangles);

  uint64_t vertex_count() const { return vertex_first_.back(); }
  uint64_t triangle_count() const { return triangle_first_.back(); }
  Double3 vertex(uint64_t index) const;
  mesh::Triangle triangle(uint64_t index) const;

  /// The limb that carries a leaf: leaves grow on the two finest levels, with the same number per metre. `part` is 0 to
  /// 1, and runs over all of these limbs.
  const Limb& leafy(double part) const;
  const Limb& trunk() const { return limbs_.all[0]; }

 private:
  using Firsts = std::array<uint64_t, kLimbLevels + 1>;

  static size_t level_of(const Firsts& firsts, uint64_t index);
  Double3 limb_vertex(const Limb& limb, size_t level, uint64_t index) const;

  Noise bark_;
  Limbs limbs_;
  std::array<Tube, kLimbLevels> tubes_;
  Firsts vertex_first_{}, triangle_first_{};
  uint64_t leafy_ = 0;                 ///< number of the first limb with leaves
  std::vector<double> length_before_;  ///< total length of leafy limbs up to and including each one
};

}  // namespace nif::generate
