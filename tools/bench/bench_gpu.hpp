// `nif bench --device gpu`: compares an asset with an exact BVH of the same mesh on the same GPU.
#pragma once

#include <array>
#include <nlohmann/json_fwd.hpp>

#include "bake/ground_truth/evaluate.hpp"
#include "nif/nif.h"
#include "tools/bench/bench_rounds.hpp"
#include "tools/common/progress.hpp"

namespace nif::tools {

struct GpuBenchOptions {
  std::string asset, mesh;
  std::string against;  ///< another asset of the same mesh, used instead of a BVH built from it; may be empty
  std::vector<bake::RaySet> sets;
  uint64_t rays, seed;
  size_t rounds;
  bool half;     ///< `spherical` objects in half precision, which only the pipeline supports
  bool stages;   ///< also time the pipeline's stages
  bool batches;  ///< also time smaller batches
};

/// The contestants: the asset by one kernel and by the pipeline, the other side, and, if that is a BVH, the
/// same BVH with triangles in single precision.
enum GpuSide : size_t { kOneKernel, kPipeline, kOther, kSingleBvh, kGpuSides };

/// A number of rays per query, and for each side the median rate in million rays per second.
struct GpuBatch {
  uint64_t rays;
  std::array<double, kGpuSides> rates;
};

struct GpuSetSpeeds {
  bake::RaySet set;
  bake::Accuracy accuracy, other_accuracy;
  std::array<std::vector<double>, kGpuSides> rates;             ///< million rays per second by round
  std::vector<std::array<double, NIF_MEASURED_STAGES>> stages;  ///< nanoseconds per ray by round
  std::vector<GpuBatch> batches;

  Spread rate(GpuSide side) const { return spread_of(rates[side]); }
  /// The faster way of the asset, which the runtime would choose.
  GpuSide way() const;
  /// The faster one of the other sides.
  GpuSide bar() const;
  /// Speed of way() as a multiple of bar(): ratio of the medians, with the spread over rounds.
  Spread ratio() const;
};

struct GpuBenchResult {
  std::string gpu;
  uint64_t triangles = 0;
  size_t objects = 0;
  uint64_t file_bytes = 0, gpu_bytes = 0, other_gpu_bytes = 0;
  std::vector<GpuSetSpeeds> sets;
};

/// Throws nif::Error; Error(usage) with the reason if there is no GPU.
GpuBenchResult measure_gpu(const GpuBenchOptions& options, Progress& progress);

inline constexpr const char* kGpuBenchSchema = "nifkit.bench-gpu/3";

/// docs/benchmark.md explains the fields of the schema.
nlohmann::ordered_json to_json(const GpuBenchOptions& options, const GpuBenchResult& result);
std::string gpu_bench_table(const GpuBenchOptions& options, const GpuBenchResult& result);

}  // namespace nif::tools
