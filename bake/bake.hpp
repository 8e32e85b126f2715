// The whole way from a scene of meshes to an asset: prepare, classify, train, measure.
#pragma once

#include <atomic>
#include <functional>
#include <optional>
#include <string>

#include "bake/encoding.hpp"
#include "bake/oracle/evaluate.hpp"
#include "bake/segment/trainer.hpp"
#include "bake/spherical/trainer.hpp"
#include "formats/mesh/clean.hpp"
#include "formats/nif/asset.hpp"

namespace nif::bake {

enum class Preset {
  fast,
  balanced,
  high,
  paper,  ///< of EncodingOption::spherical, the only one: the others are for `segment` fields
};
std::string_view name_of(Preset preset);
std::optional<Preset> preset_named(std::string_view name);

/// What each object becomes.
enum class EncodingOption {
  automatic,  ///< whichever is better for it, see bake/encoding.hpp
  segment,
  bvh,        ///< nothing is trained; preset, resolution, mix and effort have no meaning
  spherical,  ///< the paper's; resolution has no meaning
};
std::string_view name_of(EncodingOption option);
std::optional<EncodingOption> encoding_named(std::string_view name);

/// Rays to learn from that are not the named sets'.
struct MeshRays {
  std::vector<Segment> segments;  ///< each in the space of its mesh
  std::vector<uint32_t> meshes;   ///< [segment]: index into the scene's meshes
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

struct BakeOptions {
  EncodingOption encoding = EncodingOption::automatic;
  Preset preset = Preset::balanced;
  SphericalBakeOptions spherical;  ///< where that is the encoding
  uint64_t seed = 1;
  bool strict = false;  ///< refuse what preparation would change
  /// Of the whole file: the finest grids up to the preset's that fit, and BVHs where there is room for them.
  std::optional<uint64_t> max_bytes;
  std::optional<double> max_error;        ///< of every stated ray set; else Error(target_not_met)
  std::optional<uint32_t> resolution;     ///< voxels along the longest side, in place of the preset's choice
  std::optional<Mix> mix;                 ///< in place of the preset's
  std::optional<double> effort;           ///< factor on the preset's training rays, > 0
  uint64_t evaluation_rays = 1'000'000;   ///< of each set, spread over the objects
  uint64_t spoil_at_step = ~uint64_t{0};  ///< for tests, see TrainingOptions
};

/// What the options come to for an object of some 150,000 triangles or more; smaller ones get a coarser grid.
struct ResolvedOptions {
  uint32_t resolution;
  uint32_t samples, features_per_corner;
  float length_scale;
  NetworkOptions network;
  Mix mix;
  double rays_per_corner;  ///< training rays for each corner that has features
  uint64_t max_rays;
};
ResolvedOptions resolve(const BakeOptions& options);

/// What the work is at, for a bar or a line. Fractions run from 0 to 1 over the whole bake.
struct BakeProgress {
  enum class Stage { preparing, choosing, training, measuring } stage;
  std::string_view object;
  size_t object_index, object_count;
  double fraction;
  double loss, error;  ///< while training: of recent ambiguous rays
};
using BakeCallback = std::function<void(const BakeProgress&)>;

struct ObjectReport {
  std::string name;
  uint64_t triangles = 0;  ///< after cleaning
  mesh::CleanReport cleaned;
  std::string_view encoding;                       ///< its name in texts
  std::string reason;                              ///< for the encoding: what is known, as words
  std::optional<EncodingCost> as_segment, as_bvh;  ///< what was compared, as far as it was needed
  size_t closed_components = 0, open_components = 0;
  uint64_t turned = 0;               ///< triangles, for the inside to be known
  std::array<uint32_t, 3> voxels{};  ///< of a field's grid, as the rest; also where it was not chosen
  size_t surface_voxels = 0, inside_voxels = 0, unknown_voxels = 0;
  uint64_t training_rays = 0, primary_rays = 0;  ///< the latter of a field for primary rays
  uint32_t recoveries = 0;                       ///< of all training
  SetAccuracies sets{};
};

struct BakeResult {
  format::Asset asset;
  std::vector<ObjectReport> objects;  ///< one for each of the asset's
  std::vector<uint32_t> placed;       ///< of each of the asset's instances, that of the scene
  SetAccuracies sets{};               ///< of all objects together
  uint64_t triangles = 0;             ///< of all objects, each once
  std::vector<std::string> notes;     ///< what preparation changed or left out, a sentence each
};

/// Bakes every mesh once, however many instances it has; meshes of equal content become one object. Uses all
/// threads that TBB gives; the result does not depend on their number. `callback` is called from the calling
/// thread. Throws nif::Error: all_degenerate, needs_repair, too_large (also where EncodingOption::bvh meets
/// coordinates that a BVH cannot compute with), target_not_met, training_failed, interrupted (once `cancel`
/// is set).
BakeResult bake(const mesh::Scene& scene, const BakeOptions& options, const BakeCallback& callback,
                const std::atomic<bool>& cancel);

}  // namespace nif::bake
