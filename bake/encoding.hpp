// Which encoding is the better one for an object: `segment`, small and fast, or `bvh`, exact.
//
// The choice weighs bytes, counted work and measured error. Nothing is timed, so that a bake's bytes depend
// on no machine; how well counted work foretells times is measured in docs/results/encoding.md.
#pragma once

#include <optional>
#include <string>

#include "bake/oracle/evaluate.hpp"
#include "formats/nif/asset.hpp"

namespace nif::bake {

/// What an encoding costs an object.
struct EncodingCost {
  uint64_t bytes = 0;           ///< in a file
  double work = 0;              ///< of a ray, in nanoseconds of the machine that the weights were measured on
  std::optional<double> error;  ///< share of wrong answers on the worst ray set, where it was measured
};

/// Bytes alone: of a field whose network has so many bytes of weights, and of a BVH.
EncodingCost cost_of_field(const format::SegmentData& data, uint64_t network_bytes);
EncodingCost cost_of_bvh(const format::Bvh& bvh);

/// Mean work of a ray over `outer-lines` and `inner-surface`, a part of them drawn for this. Features and
/// network do not matter to it. The same for any number of threads.
double work_of(const kernels::SegmentField& field, const RaySource& source, uint64_t seed);
double work_of(const kernels::BvhField& field, const RaySource& source, uint64_t seed);

/// A field's error on the worst of the random ray sets (all but `sun`), on rays drawn for this.
struct WorstError {
  double error = 0;
  RaySet set = RaySet::outer_lines;
};
WorstError worst_error(const Answerer& answer, const RaySource& source, uint64_t seed);

/// A field's gain over a BVH: how many times fewer bytes, times how many times less work.
double gain_of(const EncodingCost& field, const EncodingCost& bvh);

/// Each percent of wrong answers must be paid for with so much gain. On the meshes of
/// docs/results/encoding.md BVHs then give way to fields near 100,000 triangles, where Fujieda et al. see the
/// change: earlier on smooth ones, later where fields are often wrong.
inline constexpr double kGainPerPercent = 100;
/// With less gain than this no field is trained: it would pay for 0.2 % of wrong answers, and objects with
/// little gain are small ones, whose fields have more.
inline constexpr double kLeastGain = 20;

/// "1/5.5 as large and 1.2 times as fast"
std::string describe_gain(const EncodingCost& field, const EncodingCost& bvh);

}  // namespace nif::bake
