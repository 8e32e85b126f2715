// Times all sides on one ray set.
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

/// What is asked by itself, an object or a whole scene, and the rays that are asked of it.
struct Subject {
  std::vector<Scene> scenes;   ///< by number of threads
  std::vector<Scene> against;  ///< of the other asset, where there is one
  std::array<std::unique_ptr<bake::EmbreeScene>, kEmbreeBuilds.size()> embree;
  std::vector<bake::LabelledRays> sets;
  std::vector<bake::Accuracy> accuracies, against_accuracies;  ///< of the same sets
  /// Embree's scenes have instances. Then no call is told that rays are coherent: Embree 3.13.5 may not
  /// return from rtcOccluded16 with that hint.
  bool instances = false;
  bool fallback = false;  ///< proofs alone are asked of `scenes`, and Embree about the rest
  bool hits = false;      ///< all sides are asked for first hits
  bool proves = true;     ///< false: there are none, so that a program would ask Embree alone
};

/// Times work by the clock, and adds up how much of the processor it got.
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

/// The races of some sets: every side with every number of threads in the same rounds. Results by number of
/// threads; a set without rays is left out. `progress` is told the share of all that is done and what is
/// going on; it may throw to end it all.
std::vector<ThreadRun> race_sets(const std::vector<Subject>& subjects, const std::vector<bake::RaySet>& sets,
                                 const std::vector<uint32_t>& threads, const Schedule& schedule,
                                 const std::function<void(double, const std::string&)>& progress);

/// Lets arenas of so many threads have them, as long as it lives.
class EnoughThreads {
 public:
  explicit EnoughThreads(const std::vector<uint32_t>& threads);

 private:
  tbb::global_control control_;
};

}  // namespace nif::tools
