// Times all sides on one ray set, to compare them fairly.
#pragma once

#include <tbb/global_control.h>

#include <array>
#include <chrono>
#include <ctime>
#include <functional>
#include <memory>
#include <vector>

#include "tools/bench/measure.hpp"
#include "tools/common/runtime_handles.hpp"

namespace nif::tools {

/// The unit of a query, an object or a whole scene, and its rays.
struct Subject {
  std::vector<Scene> scenes;   ///< by number of threads
  std::vector<Scene> against;  ///< of the other asset, if there is one
  std::array<std::unique_ptr<bake::EmbreeScene>, kEmbreeBuilds.size()> embree;
  std::vector<bake::RaysWithTruth> sets;
  std::vector<bake::Accuracy> accuracies, against_accuracies;  ///< for the same sets
  /// Embree's scenes have instances. Then no call gets the coherence hint: with it, rtcOccluded16 of Embree
  /// 3.13.5 may never return.
  bool instances = false;
  bool fallback = false;  ///< query only proofs in `scenes`, and Embree for open rays
  bool hits = false;      ///< query all sides for first hits
  bool proves = true;     ///< false: there are no proofs, so a program would query Embree alone
};

/// Times work by the clock, and sums up the processor time that it got.
class Stopwatch {
 public:
  template <class Work>
  double time(Work&& work) {
    const auto start = std::chrono::steady_clock::now();
    const std::clock_t before = std::clock();
    work();
    processor_ += double(std::clock() - before) / CLOCKS_PER_SEC;
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    wall_ += seconds;
    return seconds;
  }
  double cores() const { return wall_ > 0 ? processor_ / wall_ : 0; }

 private:
  double wall_ = 0, processor_ = 0;
};

/// Races on several sets: every side with every number of threads in the same rounds. Results are by number
/// of threads; a set without rays is left out. `progress` gets the fraction done and a description of the
/// current step; it may throw to end everything.
std::vector<ThreadRun> race_sets(const std::vector<Subject>& subjects, const std::vector<bake::RaySet>& sets,
                                 const std::vector<uint32_t>& threads, const Schedule& schedule,
                                 const std::function<void(double, const std::string&)>& progress);

/// Lets arenas of `count` threads have them, during its lifetime.
class EnoughThreads {
 public:
  explicit EnoughThreads(const std::vector<uint32_t>& threads);

 private:
  tbb::global_control control_;
};

}  // namespace nif::tools
