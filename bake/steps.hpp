// The steps of a bake in their order, and what they share. Each step has a file of its own, and all that it
// knows about encodings is bake/encoder.hpp.
#pragma once

#include "bake/bake_clock.hpp"
#include "bake/candidate.hpp"

namespace nif::bake {

/// A bake, as far as it has come.
struct BakeRun : BakeRequest {
  PreparedScene prepared = {};
  std::vector<Candidate> candidates = {};  ///< one per object
  format::FileSize size = {};              ///< without metadata; candidates keep it up to date
  uint64_t metadata_bytes = 0;             ///< the most that metadata may take
  std::optional<BakeClock> clock = {};
  SetHits hits = {};  ///< of all objects so far
  BakeResult result = {};

  /// The largest size that the file may have.
  uint64_t bytes() const { return size.bytes() + metadata_bytes; }
  /// Whether that is within the limit, if there is one.
  bool fits() const { return !options.max_bytes || bytes() <= *options.max_bytes; }
  void show(BakeProgress::Stage stage, const Candidate& candidate, double share, double loss = 0,
            double error = 0) const {
    clock->report(stage, candidate.report.name, candidate.index, share, loss, error);
  }
};

/// 1. Prepares the meshes, and makes a candidate of each object (prepare_objects.cpp).
void prepare_objects(BakeRun& run);

/// 2. Chooses encodings, and lays the objects out in them (choose_forms.cpp). Trained parts stay blank.
void choose_forms(BakeRun& run);

/// 3. Makes grids coarser until the file is within options.max_bytes (shrink_to_limit.cpp). Throws
/// TargetNotMet.
void shrink_to_limit(BakeRun& run);

/// 4. Completes and measures the objects, one after the other, or together if they share a network
/// (encode_objects.cpp).
void encode_objects(BakeRun& run);

// The parts of that step which are files of their own:

/// The end of the reason of an exact object if bytes are preferred, which keeps it from having planes
/// (choose_exact.cpp); else empty.
std::string_view why_without_planes(const BakeOptions& options);
/// Chooses, among the exact forms that fit, the one with the least counted work (choose_exact.cpp). There
/// must be two at least.
void choose_least_work(BakeRun& run, Candidate& candidate, const RaySource& source);
/// Makes an object exact instead of learned, for the reason `why` (choose_exact.cpp). Returns false, and
/// leaves the choice, if it cannot be exact or does not fit.
bool make_exact(BakeRun& run, Candidate& candidate, const RaySource& source, const std::string& why);
/// Trains forms together. Returns why that failed, see Encoder::train() (encode_objects.cpp).
std::string train(BakeRun& run, std::span<const Lesson> lessons);
/// Finds the smallest form of a trained and measured object whose error is within options.max_error
/// (meet_error.cpp). If there is none, makes the object exact if possible.
void meet_error(BakeRun& run, Candidate& candidate, const RaySource& source);

/// The accuracy of an object in its chosen form, on each ray set (measure_objects.cpp).
SetAccuracies measure_answers(const BakeRun& run, const Candidate& candidate, const RaySource& source);
/// The same of its first hits, on kHitSets.
SetHits measure_hits(const BakeRun& run, const Candidate& candidate, const RaySource& source);

/// The ray set whose error may be largest: its Accuracy::error_bound() and error().
struct ErrorBound {
  double bound = 0, error = 0;
  RaySet set = RaySet::outer_lines;
};
ErrorBound error_bound(const SetAccuracies& sets);

/// 5. Throws TargetNotMet if the error of learned objects is above options.max_error (measure_objects.cpp).
void check_error(const BakeRun& run);

/// 6. Writes asset and metadata, and sums up the report (bake.cpp).
BakeResult assemble(BakeRun& run);

}  // namespace nif::bake
