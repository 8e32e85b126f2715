// scene_rays [--rays N] [--seed N] [--threads N] [--scenes FIRST COUNT] [--log FILE]
//
// Compares answers in random scenes of 2 to 6,000 instances: by every instruction set of the processor, in calls
// of any size and with any number of threads, with those of a plain loop over the instances by the reference. All
// calls, to the bit, until this many rays are compared (1,000,000). Scenes have numbers, and are the same in every
// run with the same seed; --scenes: no others than these. --threads: scenes at a time (1). Prints each scene with
// a ray that differs. The last line has counts. --log adds a line to a file, with tabs: the day, scenes, rays,
// rays that differ. Ends with 1 if a ray differed.
#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <mutex>
#include <stdexcept>
#include <thread>

#include "tests/exact/compare_scene.hpp"
#include "tests/exact/program.hpp"

namespace {

using namespace nif::test;

struct Options {
  uint64_t rays = 1'000'000, seed = 1, first = 0, count = UINT64_MAX;
  uint32_t threads = 1;
  std::string log;
};

Options parse(int argc, char** argv) {
  Options options;
  for (Arguments arguments(argc, argv); arguments.more();) {
    const std::string key = arguments.key();
    if (key == "--rays") {
      options.rays = arguments.number();
    } else if (key == "--seed") {
      options.seed = arguments.number();
    } else if (key == "--threads") {
      options.threads = std::max(1u, uint32_t(arguments.number()));
    } else if (key == "--scenes") {
      options.first = arguments.number();
      options.count = arguments.number();
      options.rays = UINT64_MAX;
    } else if (key == "--log") {
      options.log = arguments.value();
    } else {
      throw std::invalid_argument("unknown option '" + key + "'");
    }
  }
  return options;
}

class Run {
 public:
  explicit Run(const Options& options) : options_(options) {}

  int operator()() {
    const auto start = std::chrono::steady_clock::now();
    std::vector<std::thread> threads;
    for (uint32_t i = 0; i < options_.threads; ++i) threads.emplace_back([this] { work(); });
    for (std::thread& thread : threads) thread.join();
    if (!error_.empty()) throw std::runtime_error(error_);
    const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
    std::printf(
        "seed %llu: %llu scenes in %.0f s; %llu rays, %llu of them certain, %llu hit something, %llu open; "
        "%llu answers; %llu rays differ\n",
        to_print(options_.seed), to_print(scenes_), seconds.count(), to_print(tally_.rays),
        to_print(tally_.certain), to_print(tally_.hit), to_print(tally_.open), to_print(tally_.answers),
        to_print(tally_.differing));
    if (!options_.log.empty()) add_to_log(options_.log, {scenes_, tally_.rays, tally_.differing});
    return tally_.differing != 0;
  }

 private:
  void work() try {
    const std::vector<std::vector<Way>> ways = make_scene_ways();
    for (;;) {
      const uint64_t nth = next_++;
      if (nth >= options_.count || asked_ >= options_.rays) return;
      const RandomScene scene(options_.seed, options_.first + nth);
      asked_ += scene.rays().size();
      const SceneTally tally = compare(scene, ways, options_.first + nth);
      const std::lock_guard lock(mutex_);
      for (const std::string& finding : tally.findings) std::printf("%s\n", finding.c_str());
      std::fflush(stdout);
      tally_ += tally;
      ++scenes_;
    }
  } catch (const std::exception& error) {
    const std::lock_guard lock(mutex_);
    error_ = error.what();
  }

  const Options options_;
  std::mutex mutex_;
  std::atomic<uint64_t> next_{0}, asked_{0};
  SceneTally tally_;
  uint64_t scenes_ = 0;
  std::string error_;
};

}  // namespace

int main(int argc, char** argv) {
  return run_program("scene_rays", [&] { return Run(parse(argc, argv))(); });
}
