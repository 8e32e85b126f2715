// Writes what a race asks as a folder of raw arrays, so that any other program can take part in it.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "tools/bench/measure.hpp"
#include "tools/bench/scene_measure.hpp"

namespace nif::tools {

inline constexpr const char* kRaceSchema = "nifkit.race/1";

/// Checks that an export can go to this folder: it does not exist, is empty, or has an earlier export and
/// nothing else. Throws Error(usage), Error(output_folder_missing) or Error(output_not_writable).
void check_export(const std::string& folder);

/// Draws the rays that measure() and measure_scene() would race, and writes them with their meshes; whole, or
/// not at all: an earlier export stays until the new one is complete. Returns the content of race.json.
/// docs/benchmark.md describes it. Throws nif::Error; Error(interrupted) soon after a signal arrives.
nlohmann::ordered_json export_race(const BenchOptions& options, const std::string& folder,
                                   Progress& progress);
nlohmann::ordered_json export_race(const SceneBenchOptions& options, const std::string& folder,
                                   Progress& progress);

/// For people.
std::string export_summary(const nlohmann::ordered_json& race, const std::string& folder);

}  // namespace nif::tools
