// Steps of a bake that do not depend on encodings.
#pragma once

#include "bake/bake.hpp"
#include "bake/oracle/prepare.hpp"

namespace nif::bake {

/// Seeds that differ from the default of `nif eval`, from training's streams and from each other.
inline constexpr uint64_t kMeasuringSeed = 0x6d65617375726564, kChoosingSeed = 0x63686f6f73696e67,
                          kLeaningSeed = 0x6c65616e696e67;

/// Bytes reserved for the metadata's figures, which exist only once accuracy has been measured.
inline constexpr uint64_t kMetadataBytes = 1024, kMetadataBytesPerObject = 2368;
/// And for the figures of an object with a decision threshold.
inline constexpr uint64_t kMetadataBytesOfLean = 768;

/// Objects with at least this many triangles get the preset's resolution and rays.
inline constexpr double kFullTriangles = 150'000;

/// Everything that is the same for an object in any encoding; the report gets what is known so far.
format::Object describe(const Prepared& prepared, ObjectReport& report);

/// The instances of what was prepared, named and placed as in the scene.
std::vector<format::Instance> instances_of(const mesh::Scene& scene, const PreparedScene& prepared);

/// The accuracy of one of several objects on each ray set, with its share of options.evaluation_rays. Calls
/// `begin` before each set.
SetAccuracies measure_sets(const RaySource& source, const Answerer& answer, const BakeOptions& options,
                           size_t objects, const std::function<void(RaySet)>& begin);

/// The same for first hits, on kHitSets, with a tenth of these rays: finding a hit takes longer than finding
/// out whether there is one. An object without planes is not measured in voxels.
SetHits measure_hits(const RaySource& source, const kernels::AnyField& field, double diagonal,
                     const BakeOptions& options, size_t objects, const std::function<void(RaySet)>& begin);

/// The ray set whose error may be largest: its Accuracy::error_bound() and error().
struct ErrorBound {
  double bound = 0, error = 0;
  RaySet set = RaySet::outer_lines;
};
ErrorBound error_bound(const SetAccuracies& sets);

/// Throws TargetNotMet if options.max_error is given and not met.
void check_error(const BakeOptions& options, const SetAccuracies& sets);

/// Progress of a bake of several objects; an object's training is assumed to take time in proportion to its
/// triangles, within bounds.
class BakeClock {
 public:
  BakeClock(std::span<const Prepared> objects, const BakeCallback& callback);
  /// `share` of the object at `index` is done.
  void report(BakeProgress::Stage stage, std::string_view name, size_t index, double share, double loss = 0,
              double error = 0) const;

 private:
  const BakeCallback& callback_;
  std::vector<double> weights_;
};

/// Throws Error(interrupted) once `cancel` is set.
void stop_if(const std::atomic<bool>& cancel);

}  // namespace nif::bake
