// Draws the plot of `nif bench --plot`.
#pragma once

#include <string>

#include "tools/bench/measure.hpp"

namespace nif::tools {

/// An SVG document: for each number of threads and each ray set, bars for the asset and for the fastest call
/// of each Embree build.
std::string bench_plot(const BenchOptions& options, const BenchResult& result);

}  // namespace nif::tools
