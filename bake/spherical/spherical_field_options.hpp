// Options for making `spherical` fields.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "bake/spherical/spherical_trainer_kernels.hpp"
#include "formats/base/status.hpp"
#include "kernels/reference/ray.hpp"

namespace nif::bake {

/// Shape of a field and settings of its training. The defaults are the paper's.
struct SphericalOptions {
  /// For rays that start outside the AABB.
  struct Outer {
    uint32_t resolution = 256, features = 3;  ///< of both grids
    uint32_t width = 64, hidden_layers = 2;
    uint32_t batch = 2048;  ///< rays per step, a multiple of kSphericalBatchUnit
  } outer;
  /// For rays that start inside.
  struct Inner {
    uint32_t resolution = 128, features = 5;  ///< of the two grids over angles
    uint32_t distance_resolution = 128, distance_features = 3;
    uint32_t width = 48, hidden_layers = 3;
    uint32_t batch = 4096;
  } inner;
  /// For primary rays, if they are learned; like the outer field's.
  Outer primary;
  float slope = 0.01f;         ///< of the leaky ReLU below 0
  float latent_reach = 1e-4f;  ///< latent vectors start uniform in +-this
  /// Weights start uniform in +-sqrt(6 / n), with n inputs (He et al. 2015), or inputs and outputs together
  /// (Glorot and Bengio 2010, which the paper names Xavier).
  bool he_weights = false;
  SphericalLoss loss = SphericalLoss::squared;
  float learning_rate = 0.005f;  ///< of Adam, with the next three
  float beta1 = 0.9f, beta2 = 0.999f, epsilon = 1e-15f;
  /// How values are stored. The bytes that the paper states follow from these.
  bool half_grids = true, half_networks = false;
  uint64_t seed = 1;
};
inline constexpr uint32_t kSphericalBatchUnit = 512;

/// A value that check() refuses.
class InvalidOption : public Error {
 public:
  /// `option` is the metadata's name, after that of its group: "outer.resolution", "slope".
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

/// Training rays that do not come from the named sets.
struct MeshRays {
  std::vector<kernels::Segment> segments;  ///< each in the space of its mesh
  std::vector<uint32_t> meshes;            ///< [segment]: index into the scene's meshes
};
struct GivenRays {
  std::string name;  ///< their name in the asset's metadata
  uint64_t rounds = 0;
  std::function<MeshRays(uint64_t round)> draw;  ///< for 0 .. rounds - 1; the same each time
  /// The same for fields for primary rays; empty: there are no such fields.
  std::function<MeshRays(uint64_t round)> draw_primary;
};

/// How `spherical` objects are baked. `fields` has the fields' own options; their seed is the bake's.
struct SphericalBakeOptions {
  SphericalOptions fields;
  bool shared_network = false;  ///< one pair of networks for all objects, instead of one for each
  /// Rays that are drawn for an object of kFullTriangles or more; fewer for smaller ones.
  uint64_t rays = 64'000'000;
  uint32_t passes = 3;  ///< how often each is learned from
  /// Replaces rays drawn by the mix; each is learned from once, as in the paper.
  std::optional<GivenRays> given;
};

}  // namespace nif::bake
