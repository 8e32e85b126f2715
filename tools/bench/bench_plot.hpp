// Draws the plot of `nif bench --plot`.
#pragma once

#include <string>

#include "tools/bench/measure.hpp"

namespace nif::tools {

/// What the lines above the bars say.
struct PlotHead {
  std::string file, measured;  ///< "dragon.nif", "871306 triangles"
  uint64_t rays, rounds;
  bool hits;
};

/// An SVG document: for each number of threads and each ray set, bars for the asset or the scene, for the
/// fastest call of each Embree build, and for other programs.
std::string bench_plot(const PlotHead& head, const BenchResult& result);

}  // namespace nif::tools
