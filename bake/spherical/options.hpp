// How `spherical` fields are made.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "bake/spherical/trainer_kernels.hpp"
#include "formats/base/status.hpp"
#include "kernels/reference/ray.hpp"

namespace nif::bake {

/// What a field and its training are made of. The defaults are the paper's.
struct SphericalOptions {
  /// For rays that start outside of the AABB.
  struct Outer {
    uint32_t resolution = 256, features = 3;  ///< of both grids
    uint32_t width = 64, hidden_layers = 2;
    uint32_t batch = 2048;  ///< rays of a step, a multiple of kSphericalBatchUnit
  } outer;
  /// For rays that start inside.
  struct Inner {
    uint32_t resolution = 128, features = 5;  ///< of the two grids over angles
    uint32_t distance_resolution = 128, distance_features = 3;
    uint32_t width = 48, hidden_layers = 3;
    uint32_t batch = 4096;
  } inner;
  /// For primary rays, where they are learned: as the outer field's.
  Outer primary;
  float slope = 0.01f;         ///< of the leaky ReLU below 0
  float latent_reach = 1e-4f;  ///< latent vectors start uniform in +-this
  /// Weights start uniform in +-sqrt(6 / n), with n inputs (He et al. 2015), or inputs and outputs together
  /// (Glorot and Bengio 2010, which the paper names Xavier).
  bool he_weights = false;
  SphericalLoss loss = SphericalLoss::squared;
  float learning_rate = 0.005f;  ///< of Adam, with the next three
  float beta1 = 0.9f, beta2 = 0.999f, epsilon = 1e-15f;
  /// How values are stored. That is how the bytes that the paper states come about.
  bool half_grids = true, half_networks = false;
  uint64_t seed = 1;
};
inline constexpr uint32_t kSphericalBatchUnit = 512;

/// A value that check() refuses.
class InvalidOption : public Error {
 public:
  /// `option` as the metadata names it, with the group before it: "outer.resolution", "slope".
  InvalidOption(std::string option, const std::string& what)
      : Error(Status::usage, option + " " + what), option_(std::move(option)), problem_(what) {}
  const std::string& option() const { return option_; }
  /// "0 is not in the range 2 to 1024"
  const std::string& problem() const { return problem_; }

 private:
  std::string option_, problem_;
};

/// Throws InvalidOption for the first value that is out of range.
void check(const SphericalOptions& options);

/// Rays to learn from that are not the named sets'.
struct MeshRays {
  std::vector<kernels::Segment> segments;  ///< each in the space of its mesh
  std::vector<uint32_t> meshes;            ///< [segment]: index into the scene's meshes
};
struct GivenRays {
  std::string name;  ///< what the asset's metadata says they are
  uint64_t rounds = 0;
  std::function<MeshRays(uint64_t round)> draw;  ///< for 0 .. rounds - 1; the same each time
  /// Likewise those that fields for primary rays learn from; empty: there are no such fields.
  std::function<MeshRays(uint64_t round)> draw_primary;
};

/// How `spherical` objects are baked; what the fields are made of is in `fields`, whose seed is the bake's.
struct SphericalBakeOptions {
  SphericalOptions fields;
  bool shared_network = false;  ///< one pair of networks for all objects, in place of one for each
  /// Rays that are drawn and labelled for an object of kFullTriangles or more; fewer for smaller ones.
  uint64_t rays = 64'000'000;
  uint32_t passes = 3;  ///< times that each is learned from
  /// In place of rays that are drawn by the mix; each is learned from once, as the paper does.
  std::optional<GivenRays> given;
};

}  // namespace nif::bake
