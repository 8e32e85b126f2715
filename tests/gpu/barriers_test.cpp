// The pipeline's barriers: with all of them answers are right in any order of threads; without one of them,
// the emulator's orders show that it is missing.
#include <numeric>

#include "kernels/gpu/pipeline_kernels.hpp"
#include "tests/gpu/emulator/emulator.hpp"
#include "tests/gpu/module_fixture.hpp"

namespace nif::test {
namespace {

namespace gpu = kernels::gpu;
using gpu::LeftOut;

constexpr uint64_t kOrders = 12;
constexpr LeftOut kDefects[] = {LeftOut::odd_syncs, LeftOut::even_syncs};

/// Items of some lists; each block gets several lists.
struct Lists {
  static constexpr uint32_t kLists = 40;
  std::vector<uint32_t> counts = std::vector<uint32_t>(1 + kLists),
                        first_tile = std::vector<uint32_t>(1 + kLists);
  uint32_t none = 0;

  Lists() {
    Random random(1);
    for (uint32_t list = 0; list < kLists; ++list) {
      counts[1 + list] = list % 5 == 4 ? 0 : 1 + random.below(3 * gpu::kTileItems);
      first_tile[list + 1] = first_tile[list] + (counts[1 + list] + gpu::kTileItems - 1) / gpu::kTileItems;
    }
    counts[0] = std::accumulate(counts.begin() + 1, counts.end(), 0u);
  }
  gpu::PipelineWork work() {
    gpu::PipelineWork work{};
    work.list_count = work.end_list = kLists;
    work.items.counts = counts.data();
    work.memory.first_tile = first_tile.data();
    work.memory.order = &none;  // there is one; nobody reads it here
    return work;
  }
};

/// A list's network in shared memory, as for_each_tile() is used: how often a thread found another one's, in
/// all orders.
template <uint32_t kThreads>
uint32_t wrong_networks(uint32_t wave, LeftOut left_out) {
  constexpr uint32_t kWords = 3 * kThreads;
  Lists lists;
  const gpu::PipelineWork work = lists.work();
  uint32_t wrong = 0;
  for (uint64_t order = 0; order < kOrders; ++order) {
    uint32_t answered = 0;
    const gpu::EmulatedGrid grid{.blocks = 5,
                                 .threads = kThreads,
                                 .shared_bytes = 4 * kWords,
                                 .wave = wave,
                                 .order = order,
                                 .left_out = left_out};
    gpu::emulate(grid, [&](const gpu::EmulatedThread& thread) {
      auto* const network = reinterpret_cast<uint32_t*>(thread.shared());
      const auto begin = [&](uint32_t list) {
        for (uint32_t i = thread.index(); i < kWords; i += kThreads) network[i] = list;
      };
      gpu::for_each_tile<kThreads>(thread, work, begin, [&](const gpu::PipelineTile& tile) {
        if (thread.wave() * wave >= tile.count) return;
        for (int layer = 0; layer < 3; ++layer) {
          for (uint32_t i = 0; i < kWords; ++i) wrong += network[i] != tile.list;
          thread.wave_sync();
        }
        answered += thread.index() < tile.count;
      });
    });
    EXPECT_EQ(answered, lists.counts[0]);
  }
  return wrong;
}

TEST(GpuBarriers, OfListsAreAllNeeded) {
  for (const uint32_t wave : {32u, 64u}) {
    EXPECT_EQ(wrong_networks<gpu::kBlockThreads>(wave, LeftOut::none), 0u);
    EXPECT_EQ(wrong_networks<2 * gpu::kBlockThreads>(wave, LeftOut::none), 0u);
    for (const LeftOut defect : kDefects) {
      EXPECT_GT(wrong_networks<gpu::kBlockThreads>(wave, defect), 1000u) << wave;
      EXPECT_GT(wrong_networks<2 * gpu::kBlockThreads>(wave, defect), 1000u) << wave;
    }
  }
}

TEST(GpuBarriers, OfOffsetsAreAllNeeded) {
  const auto wrong = [](LeftOut left_out) {
    uint32_t count = 0;
    for (uint64_t order = 0; order < kOrders; ++order) {
      Lists lists;
      const std::vector<uint32_t> expected = lists.first_tile;
      std::fill(lists.first_tile.begin(), lists.first_tile.end(), ~0u);
      const gpu::PipelineWork work = lists.work();
      gpu::emulate({.threads = gpu::kBlockThreads,
                    .shared_bytes = 4 * gpu::kBlockThreads,
                    .order = order,
                    .left_out = left_out},
                   [&](const gpu::EmulatedThread& thread) { gpu::pipeline_offsets(thread, work); });
      count += lists.first_tile != expected;
    }
    return count;
  };
  EXPECT_EQ(wrong(LeftOut::none), 0u);
  for (const LeftOut defect : kDefects) EXPECT_GT(wrong(defect), 0u);
}

/// Whole scenes, with so many objects with their own networks that blocks go from list to list.
class GpuBarriersOfNetworks : public GpuModuleTest {
 protected:
  void TearDown() override {
    machine().defective = "";
    GpuModuleTest::TearDown();
  }
  static Answers ask(const std::string& config, const format::Asset& asset, const std::vector<NifRay>& rays) {
    const nifkit::Device device(config);
    const auto file = format::encode(asset);
    const nifkit::Asset loaded = nifkit::Asset::load(device, file);
    nifkit::Scene scene(device);
    for (uint32_t i = 0; i < asset.objects.size(); ++i) {
      const float x = 2 * static_cast<float>(i % 5) - 4, y = 2 * static_cast<float>(i / 5) - 4;
      scene.add_instance(loaded, i, Matrix{0.5f, 0, 0, x, 0, 0.5f, 0, y, 0, 0, 0.5f, 0});
    }
    scene.commit();
    return query_all(scene.get(), rays);
  }
  /// How many answers differ from those in the first order, without defects.
  void expect_needed(const char* kernel, uint32_t gpu, const char* more, const format::Asset& asset,
                     size_t count) {
    Random random(3);
    const std::vector<NifRay> rays = rays_in_cube(random, 6, count);
    const std::string config = GpuModuleTest::config(gpu) + more;
    machine().processors = 1;
    machine().order = 0;
    machine().defective = "";
    const Answers expected = ask(config, asset, rays);
    for (const bool odd : {false, true}) {
      machine().without_odd_syncs = odd;
      size_t wrong = 0;
      for (uint64_t order = 1; order <= 3; ++order) {
        machine().order = order;
        machine().defective = "";
        EXPECT_EQ(ask(config, asset, rays), expected) << kernel;
        machine().defective = kernel;
        const Answers got = ask(config, asset, rays);
        for (size_t i = 0; i < rays.size(); ++i) wrong += got.logit[i] != expected.logit[i];
      }
      EXPECT_GT(wrong, 10u) << kernel << " without its " << (odd ? "odd" : "even") << " barriers";
    }
  }
};

TEST_F(GpuBarriersOfNetworks, OfSegmentObjectsAreAllNeeded) {
  const format::Asset asset = random_asset(21, {.objects = 25, .instances = 0, .features = 2});
  for (const uint32_t gpu : {0u, 2u})
    expect_needed("nif_pipeline_segment_2", gpu, ",pipeline=on", asset, 60'000);
}

TEST_F(GpuBarriersOfNetworks, OfSphericalObjectsAreAllNeeded) {
  const format::Asset asset = random_asset(22, {.objects = 0, .instances = 0, .sphericals = 25});
  for (const char* kernel : {"nif_pipeline_half_outer_64", "nif_pipeline_half_inner_64"})
    expect_needed(kernel, 0, ",precision=half", asset, 20'000);
}

}  // namespace
}  // namespace nif::test
