// A study, not a test: how much a device gains from a second thread, compared with two processes of one
// thread each, which share no memory that is written. docs/results/threads.sh runs it.
//
//   two_threads ASSET MESH ROUNDS RAYS
//
// Prints a line for each ray set and round: the set, and in million rays per second the rate of one process
// with one thread, of two such processes side by side (the sum of their rates), and of one process whose
// device has two threads.
#include <fmt/format.h>
#include <semaphore.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <new>
#include <random>

#include "tools/common/measured_asset.hpp"
#include "tools/common/progress.hpp"
#include "tools/common/runtime_handles.hpp"

namespace {

using namespace nif;

/// Queries that are timed together, so that a round is long compared with the start of a thread.
constexpr int kQueries = 4;
constexpr std::array kSets{bake::RaySet::outer_lines, bake::RaySet::inner_surface, bake::RaySet::sun};

enum Way { kOneThread, kTwoProcesses, kTwoThreads };
constexpr std::array kWays{kOneThread, kTwoProcesses, kTwoThreads};

/// Shared by the two workers and their parent. Whoever waits sleeps, and takes no processor time from the
/// others.
struct Board {
  sem_t order[2];  ///< there is work to do
  sem_t done;      ///< a worker is done
  int set = 0;
  Way way = kOneThread;
  bool over = false;
  double seconds[2] = {};
};

void wait_for(sem_t& semaphore) {
  while (sem_wait(&semaphore) != 0 && errno == EINTR) continue;
}

double ask(NifScene scene, const std::vector<NifRay>& rays, std::vector<uint8_t>& visible) {
  const auto start = std::chrono::steady_clock::now();
  for (int i = 0; i < kQueries; ++i) {
    const NifRays asked = nifMakeRays(rays.data(), rays.size());
    auto answers = nifkit::sized<NifAnswers>();
    answers.visible = visible.data();
    tools::check(nifQuery(scene, &asked, &answers));
  }
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// The devices and the copy of the rays are the worker's own; otherwise the other worker would find the rays
/// in the shared cache.
void work(Board& board, int number, const tools::MeasuredAsset& asset,
          std::vector<std::vector<NifRay>> sets) {
  const tools::Scene one = std::move(asset.each_alone(1).front()),
                     two = std::move(asset.each_alone(2).front());
  std::vector<uint8_t> visible(sets.front().size());
  for (const std::vector<NifRay>& rays : sets) {
    ask(one.handle, rays, visible);
    ask(two.handle, rays, visible);
  }
  for (;;) {
    sem_post(&board.done);
    wait_for(board.order[number]);
    if (board.over) return;
    board.seconds[number] =
        ask((board.way == kTwoThreads ? two : one).handle, sets[size_t(board.set)], visible);
  }
}

int run(const std::string& asset_path, const std::string& mesh, int rounds, uint64_t rays) {
  tools::Progress progress(true);
  const tools::MeasuredAsset asset(asset_path, mesh, "", progress);
  std::vector<std::vector<NifRay>> sets;
  const bake::GroundTruth truth(asset.objects().front());
  for (bake::RaySet set : kSets) {
    std::vector<NifRay>& list = sets.emplace_back();
    for (const kernels::Segment& s : bake::make_ray_set(truth.source(), set, rays, 2).segments)
      list.push_back({{s.origin[0], s.origin[1], s.origin[2]},
                      s.tmin,
                      {s.direction[0], s.direction[1], s.direction[2]},
                      s.tmax});
  }

  void* memory = mmap(nullptr, sizeof(Board), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  if (memory == MAP_FAILED) throw std::bad_alloc();
  auto& board = *new (memory) Board;
  for (sem_t* semaphore : {&board.order[0], &board.order[1], &board.done}) sem_init(semaphore, 1, 0);
  for (int number = 0; number < 2; ++number) {
    if (fork() != 0) continue;
    try {
      work(board, number, asset, sets);
      _exit(0);
    } catch (const std::exception& error) {
      fmt::print(stderr, "two_threads: {}\n", error.what());
      kill(getppid(), SIGTERM);  // it would wait for ever
      _exit(1);
    }
  }
  for (int number = 0; number < 2; ++number) wait_for(board.done);

  std::mt19937 order(1);
  for (int round = 0; round < rounds; ++round) {
    for (size_t set = 0; set < kSets.size(); ++set) {
      std::array ways = kWays;
      std::shuffle(ways.begin(), ways.end(), order);
      double rate[kWays.size()] = {};
      for (Way way : ways) {
        board.set = int(set);
        board.way = way;
        const int workers = way == kTwoProcesses ? 2 : 1;
        for (int number = 0; number < workers; ++number) sem_post(&board.order[number]);
        for (int number = 0; number < workers; ++number) wait_for(board.done);
        for (int number = 0; number < workers; ++number)
          rate[way] += kQueries * double(sets[set].size()) / board.seconds[number] * 1e-6;
      }
      fmt::print("{} {:.3f} {:.3f} {:.3f}\n", bake::name_of(kSets[set]), rate[0], rate[1], rate[2]);
    }
  }
  board.over = true;
  for (sem_t& semaphore : board.order) sem_post(&semaphore);
  while (wait(nullptr) > 0) continue;
  return 0;
}

}  // namespace

int main(int count, char** arguments) {
  if (count != 5) {
    fmt::print(stderr, "two_threads ASSET MESH ROUNDS RAYS\n");
    return 2;
  }
  try {
    return run(arguments[1], arguments[2], std::atoi(arguments[3]), std::strtoull(arguments[4], nullptr, 10));
  } catch (const std::exception& error) {
    fmt::print(stderr, "two_threads: {}\n", error.what());
    return 1;
  }
}
