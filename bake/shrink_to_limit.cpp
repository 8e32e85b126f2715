// The third step of a bake: grids as fine as the limit of bytes allows, the same scale for all objects.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "bake/steps.hpp"

namespace nif::bake {

void shrink_to_limit(BakeRun& run) {
  if (run.fits()) return;
  const uint64_t most = *run.options.max_bytes;
  // Bytes fall with the square of the scale, or a little faster.
  const auto step = [&] {
    return std::clamp(std::pow(double(most) / double(run.bytes()), 1 / 2.5), 0.6, 0.95);
  };
  for (double scale = step(); !run.fits(); scale *= step()) {
    bool smaller = false;
    for (Candidate& candidate : run.candidates) {
      if (!candidate.encoder().has_scale(scale)) continue;
      candidate.lay_out(candidate.chosen(), scale);
      smaller = true;
    }
    if (!smaller) break;
  }
  for (Candidate& candidate : run.candidates)
    if (!run.fits() && candidate.kind() == AnswerKind::exact) candidate.choose(*candidate.smallest_exact());
  if (run.fits()) return;
  const bool holes = std::any_of(run.candidates.begin(), run.candidates.end(),
                                 [](const Candidate& candidate) { return candidate.prepared.has_holes(); });
  throw TargetNotMet(TargetNotMet::Limit::bytes,
                     fmt::format("with {} the asset takes {} bytes, more than the limit of {}{}",
                                 run.candidates.front().encoder().smallest(), run.bytes(), most,
                                 holes ? "; --alpha-resolution makes pictures of holes smaller" : ""));
}

}  // namespace nif::bake
