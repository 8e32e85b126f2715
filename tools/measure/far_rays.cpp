// A study, not a test: how long rays take that start far away. docs/results/far-rays.md has its output.
//
//   far_rays [--hits] ASSET [RAYS [ROUNDS]]
//
// --hits: first hits instead of visibility. ASSET has one object. Prints a tab-separated line for each
// distance: how many sizes away the rays start (a size is the longest side of the bounds), and the least and
// the median nanoseconds per ray over the rounds (7), on one thread with the best instruction set. 100000
// rays for each distance come from all directions and go to points in the middle four fifths of the bounds.
// Each round queries all distances in turn.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <memory>
#include <vector>

#include "formats/base/random.hpp"
#include "formats/base/status.hpp"
#include "formats/nif/file_memory.hpp"
#include "formats/nif/reader.hpp"
#include "kernels/cpu/cpu_encodings.hpp"
#include "kernels/reference/batch.hpp"

namespace {

using namespace nif;

constexpr double kDistances[] = {2, 10, 100, 1e3, 1e4, 1e5, 1e6, 1e7, 1e9};

std::vector<kernels::SegmentBatch> rays_from(const format::ObjectView& object, double distance,
                                             uint64_t count) {
  std::vector<kernels::SegmentBatch> batches((count + kernels::kBatchRays - 1) / kernels::kBatchRays);
  double size = 0;
  for (size_t a = 0; a < 3; ++a)
    size = std::max(size, double(object.aabb_max[a]) - double(object.aabb_min[a]));
  Random random(1, 0, 0);
  for (uint64_t i = 0; i < count; ++i) {
    const Double3 from = random.direction();
    kernels::Segment ray{{}, {}, 0, kernels::kNoHit};
    for (size_t a = 0; a < 3; ++a) {
      const double low = object.aabb_min[a], side = double(object.aabb_max[a]) - low;
      const double target = low + side * (0.1 + 0.8 * random.uniform());
      ray.origin[a] = float(target + from[a] * distance * size);
      ray.direction[a] = float(target - double(ray.origin[a]));
    }
    kernels::SegmentBatch& batch = batches[i / kernels::kBatchRays];
    kernels::set_segment(batch, batch.count++, ray);
  }
  return batches;
}

void run(const std::string& path, uint64_t count, int rounds, bool hits) {
  const format::FileMemory memory = format::FileMemory::load(path, format::FileMemory::Mode::read);
  const format::AssetView view = format::read_asset(memory.bytes(), path);
  if (view.objects.size() != 1) throw Error(Status::usage, path + ": needs exactly one object");
  const format::ObjectView& object = view.objects.front();
  kernels::cpu::SharedCopies copies;
  using kernels::cpu::Isa;
  constexpr Isa kBestFirst[] = {Isa::avx512, Isa::avx2, Isa::sse4, Isa::neon};
  const auto* const isa = std::ranges::find_if(kBestFirst, kernels::cpu::available);
  if (isa == std::end(kBestFirst)) throw Error(Status::usage, "this machine has no SIMD kernels");
  const kernels::cpu::KernelOptions options{*isa, std::pmr::new_delete_resource(), copies};
  const auto kernel = kernels::cpu::make_kernel(format::field_of(object), options);
  struct Work {
    kernels::AnswerBatch answers;
    kernels::HitBatch hits;
    float limit[kernels::kBatchRays];
    alignas(64) std::byte scratch[kernels::kKernelScratchBytes];
  };
  const auto work = std::make_unique<Work>();
  std::fill_n(work->limit, kernels::kBatchRays, kernels::kNoHit);
  std::vector<std::vector<kernels::SegmentBatch>> rays;
  for (const double distance : kDistances) rays.push_back(rays_from(object, distance, count));
  std::vector<std::vector<double>> times(rays.size());
  for (int round = 0; round <= rounds; ++round)
    for (size_t d = 0; d < rays.size(); ++d) {
      const auto start = std::chrono::steady_clock::now();
      for (const kernels::SegmentBatch& batch : rays[d]) {
        if (hits)
          kernel->intersect(batch, work->limit, work->hits, work->scratch);
        else
          kernel->answer(batch, work->answers, work->scratch);
      }
      const std::chrono::duration<double, std::nano> time = std::chrono::steady_clock::now() - start;
      if (round > 0) times[d].push_back(time.count() / double(count));  // the first round fills the caches
    }
  for (size_t d = 0; d < rays.size(); ++d) {
    std::ranges::sort(times[d]);
    fmt::print("{:g}\t{:.1f}\t{:.1f}\n", kDistances[d], times[d].front(), times[d][times[d].size() / 2]);
  }
}

}  // namespace

int main(int argc, char** argv) {
  bool hits = false;
  for (; argc > 1 && std::string_view(argv[1]).starts_with("--"); --argc, ++argv)
    hits |= std::string_view(argv[1]) == "--hits";
  const uint64_t rays = argc > 2 ? std::strtoull(argv[2], nullptr, 10) : 100'000;
  const int rounds = argc > 3 ? std::atoi(argv[3]) : 7;
  if (argc < 2 || argc > 4 || rays == 0 || rounds < 1) {
    fmt::print(stderr, "usage: far_rays [--hits] ASSET [RAYS [ROUNDS]]\n");
    return int(Status::usage);
  }
  try {
    run(argv[1], rays, rounds, hits);
  } catch (const Error& error) {
    fmt::print(stderr, "{}\n", error.what());
    return int(error.status());
  }
}
