// judge_rays [--seconds N] [--seed N] [--cases FIRST COUNT] [--rays N] [--threads N]
//            [--gpu MODULE [--gpu-rays N]] [--keep FOLDER] [--log FILE] [--first]
//
// Judges answers in exact arithmetic: hostile meshes, rays and transforms, in every encoding, by every call,
// instruction set and batch size, until this many cases are judged or the time is over (60 s). Cases have
// numbers, and are the same in every run with the same seed. --gpu: also by a GPU, through this module; only
// this many rays of each case (16), because the emulator is slow. Prints each case with a wrong answer.
// --keep also writes it as a file, reduced to one ray and a few triangles: moved to tests/exact/cases it
// becomes a test. --first: stops at the first wrong answer. The last line has counts. --log adds a line to a
// file, with tabs: the day, rays judged, certain ones, answers, wrong answers. Ends with 1 if an answer was
// wrong.
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <mutex>
#include <stdexcept>
#include <thread>

#include "tests/exact/cases.hpp"
#include "tests/exact/judge.hpp"
#include "tests/exact/program.hpp"

namespace {

using namespace nif::test;

struct Options {
  double seconds = 60;
  uint64_t seed = 1, first = 0, count = UINT64_MAX;
  uint32_t rays = 1000, threads = 2, gpu_rays = 16, most_findings = 20;
  std::string module, keep, log;
  bool until_wrong = false;
};

Options parse(int argc, char** argv) {
  Options options;
  for (Arguments arguments(argc, argv); arguments.more();) {
    const std::string key = arguments.key();
    if (key == "--seconds") {
      options.seconds = std::atof(arguments.value());
    } else if (key == "--seed") {
      options.seed = arguments.number();
    } else if (key == "--cases") {
      options.first = arguments.number();
      options.count = arguments.number();
    } else if (key == "--rays") {
      options.rays = uint32_t(arguments.number());
    } else if (key == "--threads") {
      options.threads = uint32_t(arguments.number());
    } else if (key == "--first") {
      options.until_wrong = true;
    } else if (key == "--gpu") {
      options.module = arguments.value();
    } else if (key == "--gpu-rays") {
      options.gpu_rays = uint32_t(arguments.number());
    } else if (key == "--log") {
      options.log = arguments.value();
    } else if (key == "--keep") {
      options.keep = arguments.value();
    } else {
      throw std::invalid_argument("unknown option '" + key + "'");
    }
  }
  return options;
}

class Run {
 public:
  explicit Run(const Options& options) : options_(options), end_(now() + options.seconds) {
    if (!options_.keep.empty()) std::filesystem::create_directories(options_.keep);
  }

  int operator()() {
    const double start = now();
    std::vector<std::thread> threads;
    for (uint32_t i = 0; i < options_.threads; ++i) threads.emplace_back([this] { work(); });
    for (std::thread& thread : threads) thread.join();
    std::printf(
        "seed %llu: %llu cases in %.0f s, %llu meshes refused; %llu rays judged, %llu of them certain; "
        "%llu answers; %llu wrong\n",
        to_print(options_.seed), to_print(cases_), now() - start, to_print(tally_.refused),
        to_print(tally_.rays), to_print(tally_.certain), to_print(tally_.answers), to_print(wrong_));
    if (!options_.log.empty())
      add_to_log(options_.log, {tally_.rays, tally_.certain, tally_.answers, wrong_});
    return wrong_ != 0;
  }

 private:
  static double now() {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
  }

  void work() {
    const std::vector<Way> ways = make_ways(options_.module);
    for (;;) {
      const uint64_t nth = next_++;
      if (nth >= options_.count || now() > end_ || (options_.until_wrong && found_)) return;
      const Case one = draw_case(options_.seed, options_.first + nth, options_.rays);
      Tally tally;
      const std::vector<Finding> findings = judge(one, ways, options_.gpu_rays, tally);
      if (!findings.empty()) found_ = true;
      if (!findings.empty()) report(one, options_.first + nth, findings, ways);
      const std::lock_guard lock(mutex_);
      tally_ += tally;
      wrong_ += findings.size();
      ++cases_;
    }
  }

  void report(const Case& one, uint64_t number, const std::vector<Finding>& findings,
              const std::vector<Way>& ways) {
    const Finding& first = findings[0];
    bool cut;
    {
      const std::lock_guard lock(mutex_);
      std::printf("case %llu (%s): %zu wrong. %s, %s: %s: %s\n", to_print(number), one.name.c_str(),
                  findings.size(), name_of(first.placed), first.way.c_str(), first.what.c_str(),
                  in_hex(first.ray).c_str());
      std::fflush(stdout);
      cut = !options_.keep.empty() && kept_++ < options_.most_findings;
    }
    if (!cut) return;
    const Case least = minimise(one, first, ways);
    const std::string name =
        "seed" + std::to_string(options_.seed) + "_case" + std::to_string(number) + ".txt";
    std::ofstream(std::filesystem::path(options_.keep) / name)
        << to_text(least, {std::string(name_of(first.placed)) + ", " + first.way + ": " + first.what});
  }

  const Options options_;
  const double end_;
  std::mutex mutex_;
  std::atomic<uint64_t> next_{0};
  std::atomic<bool> found_{false};
  Tally tally_;
  uint64_t cases_ = 0, wrong_ = 0, kept_ = 0;
};

}  // namespace

int main(int argc, char** argv) {
  return run_program("judge_rays", [&] { return Run(parse(argc, argv))(); });
}
