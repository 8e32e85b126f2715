// Results of `nif bench`, as tables for people and as JSON.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "tools/bench/measure.hpp"

namespace nif::tools {

inline constexpr const char* kBenchSchema = "nifkit.bench/1";

/// docs/benchmark.md explains the fields of the schema.
nlohmann::ordered_json to_json(const BenchOptions& options, const BenchResult& result);

std::string bench_tables(const BenchOptions& options, const BenchResult& result);

/// Three digits, for people: "0.87", "13.2", "104".
std::string format_rate(double rate);

/// The processor's name as the system gives it, "" where it gives none.
std::string processor_name();

}  // namespace nif::tools
