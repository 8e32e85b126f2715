// Runs a manifest on a Slurm cluster: array jobs that bake it in parts, and a last job for the summary.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "tools/batch/baking.hpp"

namespace nif::tools {

/// Assets that need about the same memory and time per task: one array job.
struct TaskClass {
  uint64_t memory;   ///< bytes per task
  uint32_t cores;    ///< per task
  uint32_t minutes;  ///< time limit per task
  uint32_t tasks;    ///< at most the number of assets; if fewer, a task bakes several, one after another
  std::vector<std::string> names;  ///< BatchAsset::name
};

struct SlurmOptions {
  uint32_t cores = 0;               ///< per task; 0: depends on the asset's size
  uint32_t minutes = 0;             ///< time limit per task; 0: from the asset's size or the last bake
  uint32_t most_tasks = 1000;       ///< per array job; clusters have a limit (MaxArraySize)
  std::vector<std::string> sbatch;  ///< extra options for sbatch, such as --partition=night
  std::string report;               ///< HTML that the last job writes; may be empty
};

/// Groups the assets to bake by need. Memory is rounded up to a power of two, so that there are few classes.
/// Ordered by memory.
std::vector<TaskClass> classify(const Manifest& manifest, std::span<const BatchItem> items,
                                const SlurmOptions& options);

struct Submitted {
  std::vector<std::string> arrays;  ///< numbers of the array jobs, in the order of the classes
  std::string merge;                ///< number of the job that writes the summary
  std::filesystem::path folder;     ///< folder of scripts, logs and summaries; summary.json is written last
};

/// Writes the scripts into a new folder of the manifest's state folder, and submits them with sbatch. If one
/// is refused, those submitted before it are cancelled. Throws nif::Error: farm_failed if there is no sbatch
/// or it refuses; output_not_writable.
Submitted submit(const Manifest& manifest, std::span<const TaskClass> classes, const SlurmOptions& options);

}  // namespace nif::tools
