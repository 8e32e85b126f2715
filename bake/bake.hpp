// Bakes a scene of meshes into an asset: prepares, lays out, trains, measures.
#pragma once

#include <array>
#include <atomic>
#include <functional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "bake/bake_encodings.hpp"
#include "bake/choice.hpp"
#include "bake/ground_truth/evaluate.hpp"
#include "bake/ground_truth/evaluate_hits.hpp"
#include "bake/options.hpp"
#include "formats/base/status.hpp"
#include "formats/mesh/clean.hpp"
#include "formats/nif/asset.hpp"

namespace nif::bake {

/// Progress of a bake, for a bar or a line. Fractions run from 0 to 1 over the whole bake.
struct BakeProgress {
  enum class Stage { preparing, choosing, training, measuring } stage;
  std::string_view object;
  size_t object_index, object_count;
  double fraction;
  double loss, error;  ///< while training: over recent open rays
};
using BakeCallback = std::function<void(const BakeProgress&)>;

/// The ray sets whose first hits a bake measures: camera rays and bounces.
inline constexpr std::array kHitSets{RaySet::outer_lines, RaySet::inner_surface};

class TrainingLog;

struct ObjectReport {
  std::string name;
  uint64_t triangles = 0;  ///< after cleaning
  mesh::CleanReport cleaned;
  std::string_view encoding;  ///< its name
  std::string reason;         ///< for the encoding, as words
  /// By names of encodings: the costs that were compared, as far as needed; empty if none were.
  std::vector<std::pair<std::string_view, EncodingCost>> compared;
  size_t closed_components = 0, open_components = 0;
  uint64_t turned = 0;         ///< triangles turned so that the inside is known
  AnyReport own;               ///< specific to its encoding
  uint64_t training_rays = 0;  ///< of a field
  uint32_t recoveries = 0;     ///< of all trainings
  SetAccuracies sets{};
  SetHitFigures hits{};  ///< of kHitSets
  /// If a maximum error was given: the bytes of each form that was tried, and its error_bound().
  std::vector<std::pair<uint64_t, double>> bakes;

  /// The cost of an encoding that was compared; null if it was not.
  const EncodingCost* cost_of(std::string_view which) const;
};

struct BakeResult {
  format::Asset asset;
  std::vector<ObjectReport> objects;  ///< one per object of the asset
  std::vector<uint32_t> placed;       ///< [instance of the asset]: its instance in the scene
  SetAccuracies sets{};               ///< of all objects together
  SetHitFigures hits{};               ///< the same for kHitSets
  uint64_t triangles = 0;             ///< of all objects, each counted once
  std::vector<std::string> notes;     ///< what preparation changed or left out, one sentence each
};

/// A limit in the options that cannot be met. what() states only facts: advice is left to those who know how
/// the options were given.
class TargetNotMet : public Error {
 public:
  enum class Limit { bytes, error };
  TargetNotMet(Limit limit, const std::string& sentence)
      : Error(Status::target_not_met, sentence), limit_(limit) {}
  Limit limit() const { return limit_; }

 private:
  Limit limit_;
};

/// Bakes every mesh once, however many instances it has; meshes with equal content become one object. Uses
/// all threads that TBB gives; the result does not depend on their number. `callback` is called from the
/// calling thread. Throws TargetNotMet; nif::Error: usage (options out of range, see InvalidOption),
/// all_degenerate, needs_repair, too_large (also if an encoding requested by name cannot compute with an
/// object's coordinates), training_failed, interrupted (once `cancel` is set). With a `log`
/// (bake/checkpoint.hpp), it resumes from what is stored there, with the same result; checkpoint_refused if
/// that belongs to another bake.
BakeResult bake(const mesh::Scene& scene, const BakeOptions& options, const BakeCallback& callback,
                const std::atomic<bool>& cancel, TrainingLog* log = nullptr);

}  // namespace nif::bake
