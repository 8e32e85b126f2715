// Runs a manifest on a Slurm cluster: array jobs that bake it in parts, and a last job for the summary.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "tools/batch/baking.hpp"

namespace nif::tools {

/// Assets that one task each needs about as much for: one array job.
struct TaskClass {
  uint64_t memory;   ///< of a task, bytes
  uint32_t cores;    ///< of a task
  uint32_t minutes;  ///< limit of a task
  uint32_t tasks;    ///< at most as many as assets; then a task bakes several, one after another
  std::vector<std::string> names;  ///< BatchAsset::name
};

struct SlurmOptions {
  uint32_t cores = 0;               ///< of each task; 0: by the asset's size
  uint32_t minutes = 0;             ///< limit of each task; 0: by size, or what the last bake took
  uint32_t most_tasks = 1000;       ///< of an array job; clusters have a limit (MaxArraySize)
  std::vector<std::string> sbatch;  ///< further options of sbatch, such as --partition=night
  std::string report;               ///< HTML that the last job writes; may be empty
};

/// What has to be baked, by need: memory is rounded up to a power of two, so that there are few classes.
/// Ordered by memory.
std::vector<TaskClass> classify(const Manifest& manifest, std::span<const BatchItem> items,
                                const SlurmOptions& options);

struct Submitted {
  std::vector<std::string> arrays;  ///< numbers of the array jobs, in the order of the classes
  std::string merge;                ///< of the job that sums up
  std::filesystem::path folder;     ///< where scripts, logs and summaries lie; summary.json comes last
};

/// Writes the scripts into a new folder of the manifest's state folder, and submits them by sbatch. Where one
/// is refused, those before it are cancelled. Throws nif::Error(farm_failed) where there is no sbatch or it
/// refuses; (output_not_writable).
Submitted submit(const Manifest& manifest, std::span<const TaskClass> classes, const SlurmOptions& options);

}  // namespace nif::tools
