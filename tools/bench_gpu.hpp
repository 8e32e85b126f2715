// `nif bench --device hip`: an asset on a GPU beside an exact BVH of the same mesh on the same card.
#pragma once

#include <nlohmann/json.hpp>

#include "bake/evaluate.hpp"
#include "tools/progress.hpp"
#include "tools/rounds.hpp"

namespace nif::tools {

struct GpuBenchOptions {
  std::string asset, mesh;
  std::string
      against;  ///< another asset of the same mesh, in place of a BVH that is made of it; may be empty
  std::vector<bake::RaySet> sets;
  uint64_t rays, seed;
  size_t rounds;
};

/// One side of a race. Rates are in millions of rays a second.
struct GpuSpeed {
  bake::Accuracy accuracy;
  std::vector<double> rates;  ///< by round
  Spread rate() const { return spread_of(rates); }
};

struct GpuSetSpeeds {
  bake::RaySet set;
  GpuSpeed nif, other;
  /// How many times as fast as the other: of the medians, with the spread of the rounds.
  Spread ratio() const;
};

struct GpuBenchResult {
  std::string card;
  uint64_t triangles = 0;
  size_t objects = 0;
  uint64_t file_bytes = 0, card_bytes = 0, other_card_bytes = 0;
  std::vector<GpuSetSpeeds> sets;
};

/// Throws nif::Error; Error(usage) with the reason where there is no GPU.
GpuBenchResult measure_gpu(const GpuBenchOptions& options, Progress& progress);

/// docs/benchmark.md explains the fields (nifkit.bench-gpu/1).
nlohmann::ordered_json to_json(const GpuBenchOptions& options, const GpuBenchResult& result);
std::string gpu_bench_table(const GpuBenchOptions& options, const GpuBenchResult& result);

}  // namespace nif::tools
