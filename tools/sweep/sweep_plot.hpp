// Draws the plot of `nif sweep`.
#pragma once

#include <string>
#include <vector>

#include "bake/ground_truth/evaluate.hpp"
#include "tools/bench/measure.hpp"

namespace nif::tools {

/// One size of an asset.
struct SweepPoint {
  double scale = 1;  ///< factor on the preset's grids
  std::string file;
  double seconds = 0;  ///< duration of its bake
  uint64_t file_bytes = 0, resident_bytes = 0;
  bake::SetAccuracies sets{};
  std::vector<SetSpeeds> speeds;  ///< on one thread; empty if none were measured
};

/// An SVG document: error, share of certain answers, and speed relative to Embree, each against the bytes of
/// the file.
std::string sweep_plot(const std::string& title, const std::vector<SweepPoint>& points);

}  // namespace nif::tools
