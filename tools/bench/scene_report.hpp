// Formats the results of `nif bench SCENE` as tables for people and as JSON.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "tools/bench/scene_measure.hpp"

namespace nif::tools {

inline constexpr const char* kSceneBenchSchema = "nifkit.bench-scene/1";

/// docs/benchmark.md explains the fields of the schema.
nlohmann::ordered_json to_json(const SceneBenchOptions& options, const SceneBenchResult& result);

std::string scene_bench_tables(const SceneBenchOptions& options, const SceneBenchResult& result);

}  // namespace nif::tools
