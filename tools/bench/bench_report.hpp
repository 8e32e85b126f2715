// Formats the results of `nif bench` as tables for people and as JSON.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "tools/bench/measure.hpp"

namespace nif::tools {

inline constexpr const char* kBenchSchema = "nifkit.bench/1";

/// Printed by both reports for a race of first hits.
inline constexpr const char* kFirstHitsLine =
    "First hits: nifIntersect (hit, t, normal, triangle) and rtcIntersect. Errors are of hit or miss.\n";

/// docs/benchmark.md explains the fields of the schema.
nlohmann::ordered_json to_json(const BenchOptions& options, const BenchResult& result);

std::string bench_tables(const BenchOptions& options, const BenchResult& result);

/// What the reports of an asset and of a scene share for one number of threads: by ray set, as
/// docs/benchmark.md explains; and as tables, with the bytes of `result`.
nlohmann::ordered_json sets_json(const ThreadRun& run, const BenchResult& result);
std::string run_tables(const ThreadRun& run, const BenchResult& result);
/// The results of the other asset, whose file is `against`; empty if there is none.
std::string other_table(const ThreadRun& run, const std::string& against, const BenchResult& result);
/// By Embree build.
nlohmann::ordered_json embree_bytes_json(const BenchResult& result);

/// How much more threads speed up both sides, by set.
std::string gain_line(const ThreadRun& first, const ThreadRun& more);

/// A median with the lowest and the highest in parentheses.
std::string with_spread(const Spread& spread);

/// " on NAME" with the processor's name; empty if the system does not report one.
std::string on_processor();

/// Three digits, for people: "0.87", "13.2", "104".
std::string format_rate(double rate);

/// The processor's name as the system reports it, or "".
std::string processor_name();

}  // namespace nif::tools
