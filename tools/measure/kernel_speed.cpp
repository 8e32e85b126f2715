// A study, not a test: how long the CPU's kernels take for a ray, alone, on batches in memory.
// docs/results/cpu-kernels.md has its output.
//
//   kernel_speed [--hits] [--least] [--few] ASSET MESH [RAYS [ROUNDS]]
//
// --hits: first hits instead of visibility. --least: as on devices with memory=least. --few: 8 rays in a batch instead
// of as many as it holds. ASSET has one object,
// of any encoding, baked from MESH. Prints a tab-separated line for each instruction set of this machine and
// each of three ray sets: both names, and the least and the median nanoseconds per ray over the rounds (20),
// on one thread. The 200000 rays of each set are those of nif bench.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>

#include "bake/ground_truth/prepare.hpp"
#include "bake/ground_truth/ray_sets.hpp"
#include "formats/base/status.hpp"
#include "formats/mesh/read.hpp"
#include "formats/nif/file_memory.hpp"
#include "formats/nif/reader.hpp"
#include "kernels/cpu/cpu_encodings.hpp"
#include "kernels/reference/batch.hpp"

namespace {

using namespace nif;
using kernels::cpu::Isa;

/// `size`: rays in a batch.
std::vector<kernels::SegmentBatch> to_batches(std::span<const kernels::Segment> rays, size_t size) {
  std::vector<kernels::SegmentBatch> batches((rays.size() + size - 1) / size);
  for (size_t i = 0; i < rays.size(); ++i) {
    kernels::SegmentBatch& batch = batches[i / size];
    kernels::set_segment(batch, batch.count++, rays[i]);
  }
  return batches;
}

/// Nanoseconds per ray in each round, sorted.
std::vector<double> time_rounds(const kernels::ObjectKernel& kernel,
                                const std::vector<kernels::SegmentBatch>& batches, size_t rays, int rounds,
                                bool hits) {
  struct Work {
    kernels::AnswerBatch answers;
    kernels::HitBatch hits;
    float limit[kernels::kBatchRays];
    alignas(64) std::byte scratch[kernels::kKernelScratchBytes];
  };
  const auto work = std::make_unique<Work>();
  std::fill_n(work->limit, kernels::kBatchRays, kernels::kNoHit);
  std::vector<double> times;
  for (int round = 0; round <= rounds; ++round) {
    const auto start = std::chrono::steady_clock::now();
    for (const kernels::SegmentBatch& batch : batches) {
      if (hits)
        kernel.intersect(batch, work->limit, work->hits, work->scratch);
      else
        kernel.answer(batch, work->answers, work->scratch);
    }
    const std::chrono::duration<double, std::nano> time = std::chrono::steady_clock::now() - start;
    if (round > 0) times.push_back(time.count() / double(rays));  // the first round fills the caches
  }
  std::sort(times.begin(), times.end());
  return times;
}

void run(const std::string& path, const std::string& mesh, uint64_t count, int rounds, bool hits, bool least,
         size_t batch) {
  const format::FileMemory memory = format::FileMemory::load(path, format::FileMemory::Mode::read);
  const format::AssetView view = format::read_asset(memory.bytes(), path);
  const bake::PreparedScene prepared = bake::prepare(mesh::read(mesh));
  if (view.objects.size() != 1 || prepared.objects.size() != 1)
    throw Error(Status::usage, path + ": needs exactly one object");
  const kernels::AnyField field = format::field_of(view.objects.front());
  const bake::GroundTruth truth(prepared.objects.front());
  kernels::cpu::SharedCopies copies;
  for (const bake::RaySet set : {bake::RaySet::outer_lines, bake::RaySet::inner_surface, bake::RaySet::sun}) {
    const auto rays = bake::draw_ray_set(truth.source(), set, count, 2).segments;
    if (rays.empty()) continue;
    const std::vector<kernels::SegmentBatch> batches = to_batches(rays, batch);
    for (const auto& [isa, name] : {std::pair{Isa::avx512, "avx512"}, std::pair{Isa::avx2, "avx2"},
                                    std::pair{Isa::sse4, "sse4"}, std::pair{Isa::neon, "neon"}}) {
      if (!kernels::cpu::available(isa)) continue;
      kernels::cpu::KernelOptions options{isa, std::pmr::new_delete_resource(), copies};
      if (least) options.most_without_bricks = options.most_decoded = 0;
      const auto kernel = kernels::cpu::make_kernel(field, options);
      const std::vector<double> times = time_rounds(*kernel, batches, rays.size(), rounds, hits);
      fmt::print("{}\t{}\t{:.1f}\t{:.1f}\n", name, bake::name_of(set), times.front(),
                 times[times.size() / 2]);
    }
  }
}

}  // namespace

int main(int argc, char** argv) {
  bool hits = false, least = false, few = false;
  for (; argc > 1 && std::string_view(argv[1]).starts_with("--"); --argc, ++argv) {
    hits |= std::string_view(argv[1]) == "--hits";
    least |= std::string_view(argv[1]) == "--least";
    few |= std::string_view(argv[1]) == "--few";
  }
  const uint64_t rays = argc > 3 ? std::strtoull(argv[3], nullptr, 10) : 200'000;
  const int rounds = argc > 4 ? std::atoi(argv[4]) : 20;
  if (argc < 3 || argc > 5 || rays == 0 || rounds < 1) {
    fmt::print(stderr, "usage: kernel_speed [--hits] [--least] [--few] ASSET MESH [RAYS [ROUNDS]]\n");
    return int(Status::usage);
  }
  try {
    run(argv[1], argv[2], rays, rounds, hits, least, few ? 8 : kernels::kBatchRays);
  } catch (const Error& error) {
    fmt::print(stderr, "{}\n", error.what());
    return int(error.status());
  }
}
