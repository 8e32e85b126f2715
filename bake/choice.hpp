// What an encoding costs an object, and whether a learned one is worth its errors beside an exact one.
//
// The choice weighs bytes, counted work and measured error. Nothing is timed, so that a bake's bytes depend
// on no machine; how well counted work foretells times is measured in docs/results/encoding.md.
#pragma once

#include <optional>
#include <string>

#include "bake/oracle/evaluate.hpp"

namespace nif::bake {

/// What an encoding costs an object.
struct EncodingCost {
  uint64_t bytes = 0;           ///< in a file
  double work = 0;              ///< of a ray, in nanoseconds of the machine that the weights were measured on
  std::optional<double> error;  ///< share of wrong answers on the worst ray set, where it was measured
};

/// The error on the worst of the random ray sets (all but `sun`), on rays drawn for this.
struct WorstError {
  double error = 0;
  RaySet set = RaySet::outer_lines;
};
WorstError worst_error(const Answerer& answer, const RaySource& source, uint64_t seed);

/// A learned encoding's gain over an exact one: how many times fewer bytes, times how many times less work.
double gain_of(const EncodingCost& learned, const EncodingCost& exact);

/// Each percent of wrong answers must be paid for with so much gain. On the meshes of
/// docs/results/encoding.md BVHs then give way to fields near 10,000 triangles: later where fields are often
/// wrong.
inline constexpr double kGainPerPercent = 100;
/// With less gain than this no field is trained: it would pay for 0.2 % of wrong answers, and objects with
/// little gain are small ones, whose fields have more.
inline constexpr double kLeastGain = 20;

/// "1/5.5 as large and 1.2 times as fast"
std::string describe_gain(const EncodingCost& learned, const EncodingCost& exact);

}  // namespace nif::bake
