#include "bake/choice.hpp"

#include <fmt/format.h>

namespace nif::bake {
namespace {

constexpr size_t kErrorRays = 50'000;

/// "12", "1.2": two digits at least.
std::string digits(double value) { return fmt::format("{:.{}f}", value, value < 9.95 ? 1 : 0); }

}  // namespace

WorstError worst_error(const Answerer& answer, const RaySource& source, uint64_t seed) {
  WorstError worst;
  for (RaySet set : kRaySets) {
    if (set == RaySet::sun) continue;
    const double error = evaluate(make_ray_set(source, set, kErrorRays, seed), answer, source.oracle).error();
    if (error > worst.error) worst = {error, set};
  }
  return worst;
}

double gain_of(const EncodingCost& learned, const EncodingCost& exact) {
  const double faster = learned.work > 0 && exact.work > 0 ? exact.work / learned.work : 1;
  return double(exact.bytes) / double(learned.bytes) * faster;
}

std::string describe_gain(const EncodingCost& learned, const EncodingCost& exact) {
  const double smaller = double(exact.bytes) / double(learned.bytes);
  return fmt::format("1/{} as large and {} times as fast", digits(smaller),
                     digits(gain_of(learned, exact) / smaller));
}

}  // namespace nif::bake
