// Entrants: other programs that answered the rays of an export (race_export.hpp) and timed themselves. Their
// files are not trusted, and their answers are compared with the ground truth.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "tools/bench/measure.hpp"
#include "tools/bench/race_data.hpp"

namespace nif::tools {

inline constexpr const char* kEntrantSchema = "nifkit.entrant/1";

/// A difference of first hits, as a fraction of the larger of t and the diagonal of everything in units of
/// the ray's direction. Two sound programs in single precision stay below it unless a ray grazes a surface.
inline constexpr double kSameHit = 1e-5;

/// What one entrant states about one ray set, with one number of threads.
struct EntrantResult {
  bake::RaySet set;
  std::string hash, variant;
  uint32_t threads;
  bool hits;  ///< first hits, not visibility
  std::vector<double> seconds;
  std::optional<uint64_t> bytes;
  std::string place;                           ///< in the file, for messages: "/results/2"
  std::string visible, t, triangle, instance;  ///< paths of files; empty: there is none
};

struct EntrantFile {
  std::string path, program, version, processor;
  std::vector<EntrantResult> results;
};

/// Reads what `--compare` names. docs/benchmark.md describes the schema. Throws nif::Error with a sentence that
/// names the file and the member: malformed_results, or as a file that cannot be read.
std::vector<EntrantFile> read_entrants(const std::vector<std::string>& paths);

/// An entrant in a race.
struct JudgedEntrant {
  bake::RaySet set;
  uint32_t threads;
  EntrantSpeed speed;
};

/// Compares with the ground truth the answers of all results for the race's sets, one of `threads`, and
/// visibility or first hits. Throws Error(malformed_results) if a file has no such result, or if a result is
/// of other rays, has the wrong size, or has answers that are not answers. `step` gets what is being done; it
/// may throw to end everything.
std::vector<JudgedEntrant> judge_entrants(const std::vector<EntrantFile>& files, const RaceData& race,
                                          const std::vector<uint32_t>& threads, bool hits,
                                          const std::function<void(const std::string&)>& step);

/// Puts them among the results of the race.
void add_entrants(const std::vector<JudgedEntrant>& judged, std::vector<ThreadRun>& runs);

/// A sentence for each file that states another processor than this one.
std::vector<std::string> entrant_notes(const std::vector<EntrantFile>& files);

}  // namespace nif::tools
