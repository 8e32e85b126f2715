// Every call of the C interface without memory: it reports that or does without, nothing crashes or leaks,
// and the next call works. A separate program, because it replaces operator new.
#include <gtest/gtest.h>
#include <nif/nif.h>

#include <atomic>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <new>

#include "tests/runtime/runtime_fixture.hpp"
#include "tests/support/temp_dir.hpp"

namespace {

/// The library's allocations, by operator new and by the device's callbacks, count together. The test's own
/// never fail.
std::atomic<bool> watched{false};
std::atomic<int64_t> left{0};       ///< until one fails
std::atomic<bool> only_one{false};  ///< only that one fails; otherwise all later ones, too
std::atomic<int64_t> failed{0}, alive{0};

bool fails() {
  if (!watched) return false;
  const int64_t number = left--;
  const bool now = only_one ? number == 0 : number <= 0;
  failed += now;
  return now;
}

void* take(size_t bytes, size_t alignment) {
  return std::aligned_alloc(std::max<size_t>(alignment, 16), (bytes + 63) / 64 * 64 + 64);
}

}  // namespace

[[gnu::noinline]] void* operator new(size_t bytes) {
  if (fails()) throw std::bad_alloc();
  if (void* memory = std::malloc(bytes ? bytes : 1)) return memory;
  throw std::bad_alloc();
}
[[gnu::noinline]] void* operator new[](size_t bytes) { return operator new(bytes); }
[[gnu::noinline]] void* operator new(size_t bytes, std::align_val_t alignment) {
  if (fails()) throw std::bad_alloc();
  if (void* memory = take(bytes, size_t(alignment))) return memory;
  throw std::bad_alloc();
}
[[gnu::noinline]] void* operator new[](size_t bytes, std::align_val_t alignment) {
  return operator new(bytes, alignment);
}
[[gnu::noinline]] void operator delete(void* memory) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete[](void* memory) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory, size_t) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete[](void* memory, size_t) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory, std::align_val_t) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete[](void* memory, std::align_val_t) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory, size_t, std::align_val_t) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete[](void* memory, size_t, std::align_val_t) noexcept {
  std::free(memory);
}

namespace nif::test {
namespace {

NifDeviceCallbacks callbacks() {
  NifDeviceCallbacks result{};
  result.struct_size = sizeof(result);
  result.allocate = [](void*, uint64_t bytes, uint64_t alignment) -> void* {
    if (fails()) return nullptr;
    ++alive;
    return take(bytes, alignment);
  };
  result.deallocate = [](void*, void* memory, uint64_t, uint64_t) {
    --alive;
    std::free(memory);
  };
  result.log = [](void*, uint32_t, const char*) {};
  return result;
}

/// All calls, one after the other. Calls that fail are repeated with memory, so that all are reached.
class Everything {
 public:
  Everything(const std::string& path, std::span<const std::byte> file, const std::vector<NifRay>& rays,
             const char* config, bool own_allocator)
      : path_(path), file_(file), rays_(rays), config_(config), own_allocator_(own_allocator) {}

  void run() {
    const NifDeviceCallbacks own = callbacks();
    NifDevice device = nullptr;
    call([&] { return nifNewDevice(config_, own_allocator_ ? &own : nullptr, &device); });
    auto device_info = nifkit::sized<NifDeviceInfo>();
    call([&] { return nifGetDeviceInfo(device, &device_info); });
    auto backend = nifkit::sized<NifBackendInfo>();
    call([&] { return nifGetBackendInfo(0, &backend); });
    NifAsset assets[5] = {};
    call([&] { return nifLoadAssetFile(device, path_.c_str(), NIF_LOAD_COPY, &assets[0]); });
    call([&] { return nifLoadAssetFile(device, path_.c_str(), NIF_LOAD_IN_PLACE, &assets[1]); });
    call([&] { return nifLoadAssetMemory(device, file_.data(), file_.size(), NIF_LOAD_COPY, &assets[2]); });
    call([&] {
      return nifLoadAssetMemory(device, file_.data(), file_.size(), NIF_LOAD_IN_PLACE, &assets[3]);
    });
    auto reader = nifkit::sized<NifReader>();
    reader.user = &file_;
    reader.size = file_.size();
    reader.read = [](void* user, uint64_t offset, void* to, uint64_t size) -> uint32_t {
      std::memcpy(to, static_cast<std::span<const std::byte>*>(user)->data() + offset, size);
      return 1;
    };
    call([&] { return nifLoadAssetReader(device, &reader, &assets[4]); });
    auto asset_info = nifkit::sized<NifAssetInfo>();
    call([&] { return nifGetAssetInfo(assets[0], &asset_info); });
    auto object = nifkit::sized<NifObjectInfo>();
    call([&] { return nifGetObjectInfo(assets[0], 0, &object); });
    auto part = nifkit::sized<NifPartInfo>();
    call([&] { return nifGetPartInfo(assets[0], 0, &part); });
    std::vector<uint32_t> words(100'000);
    uint64_t word_count = 0;
    call([&] { return nifGetShaderTables(assets[0], 0, words.data(), words.size(), &word_count); });
    NifScene scene = nullptr;
    call([&] { return nifNewScene(device, &scene); });
    for (const NifAsset asset : assets)
      call([&] { return nifAddAsset(scene, asset, nullptr, nullptr, nullptr); });
    uint32_t instance = 0;
    call([&] { return nifAddInstance(scene, assets[0], 0, kIdentity.data(), &instance); });
    call([&] { return nifCommitScene(scene); });
    call([&] { return nifSetInstanceTransform(scene, instance, kIdentity.data()); });
    call([&] { return nifCommitScene(scene); });
    constexpr double kOrigin[3] = {1e7, 0, 0};
    call([&] { return nifSetSceneOrigin(scene, kOrigin); });
    call([&] { return nifSetInstanceOrigin(scene, instance, kOrigin); });
    call([&] { return nifSetInstanceTransforms(scene, 1, &instance, kIdentity.data(), 0); });
    call([&] { return nifGetObjectInfo(assets[0], asset_info.object_count - 1, &object); });
    uint32_t bending = 0;
    call([&] {
      return nifAddInstance(scene, assets[0], asset_info.object_count - 1, kIdentity.data(), &bending);
    });
    const std::vector<float> vertices(3 * size_t{object.vertices});
    call([&] { return nifSetInstanceVertices(scene, bending, vertices.data(), 12); });
    const std::vector<float> joints(12 * size_t{object.joints}, 0.5f), weights(object.targets);
    auto pose = nifkit::sized<NifPose>();
    pose.joints = joints.data();
    pose.joint_count = object.joints;
    pose.weights = weights.data();
    pose.target_count = object.targets;
    call([&] { return nifPoseInstance(scene, bending, &pose); });
    call([&] { return nifCommitScene(scene); });
    call([&] { return nifRemoveInstance(scene, bending); });
    call([&] { return nifSetInstanceMask(scene, instance, 0); });
    call([&] { return nifSetInstanceUser(scene, instance, 1); });
    call([&] { return nifCommitScene(scene); });
    call([&] { return nifSetInstanceMask(scene, instance, 1); });
    call([&] { return nifSetInstanceFlags(scene, instance, NIF_INSTANCE_DISABLED); });
    call([&] { return nifSetInstanceFlags(scene, instance, 0); });
    auto instance_info = nifkit::sized<NifInstanceInfo>();
    call([&] { return nifGetInstanceInfo(scene, instance, &instance_info); });
    call([&] { return nifRemoveInstance(scene, instance); });
    call([&] { return nifSetSceneOrigin(scene, nullptr); });
    call([&] { return nifCommitScene(scene); });
    auto scene_info = nifkit::sized<NifSceneInfo>();
    call([&] { return nifGetSceneInfo(scene, &scene_info); });

    std::vector<uint8_t> visible(rays_.size());
    NifRays query = nifMakeRays(rays_.data(), rays_.size());
    auto outputs = nifkit::sized<NifAnswers>();
    uint64_t scratch = 0;
    call([&] { return nifGetQueryScratchBytes(scene, rays_.size(), &scratch); });
    outputs.visible = visible.data();
    call([&] { return nifQuery(scene, &query, &outputs); });
    answers = visible;
    call([&] { return nifQueryRay(scene, rays_.data(), &outputs); });
    const NifFallback fallback = [](void*, uint64_t, const uint64_t*, uint8_t*) {};
    call([&] { return nifQueryWithFallback(scene, &query, &outputs, 2, fallback, nullptr); });
    std::vector<uint32_t> open_rays(rays_.size());
    std::vector<float> t(rays_.size());
    uint32_t open_count = 0;
    auto open = nifkit::sized<NifOpenRays>();
    open.capacity = open_rays.size();
    open.rays = open_rays.data();
    open.count = &open_count;
    call([&] { return nifQueryOpen(scene, &query, &outputs, &open); });
    NifRays places = nifMakeRays(rays_.data(), rays_.size());
    NifHits hits{};
    hits.struct_size = sizeof(hits);
    hits.t = t.data();
    call([&] { return nifIntersect(scene, &places, &hits); });
    call([&] { return nifIntersectRay(scene, rays_.data(), &hits); });
    NifJob jobs[2] = {};
    call([&] { return nifQueryAsync(scene, &query, &outputs, &jobs[0]); });
    call([&] { return nifWaitJob(jobs[0]); });
    call([&] { return nifIntersectAsync(scene, &places, &hits, &jobs[1]); });
    uint32_t done = 0;
    call([&] { return nifIsJobDone(jobs[1], &done); });
    call([&] { return nifCancelJob(jobs[0]); });
    call([&] { return nifWaitJob(jobs[1]); });
    nifReleaseDevice(device);
    for (const NifAsset asset : assets) nifReleaseAsset(asset);
    nifReleaseScene(scene);
    for (const NifJob job : jobs) nifReleaseJob(job);
  }

  int refused = 0;
  std::vector<uint8_t> answers;

 private:
  template <class Call>
  void call(const Call& call) {
    watched = true;
    const NifError error = call();
    watched = false;
    if (error == NIF_OK) return;
    ++refused;
    ASSERT_EQ(error, NIF_ERROR_OUT_OF_MEMORY) << nifGetErrorMessage();
    ASSERT_STRNE(nifGetErrorMessage(), "");
    ASSERT_EQ(call(), NIF_OK) << "it does not recover: " << nifGetErrorMessage();
  }

  const std::string path_;
  std::span<const std::byte> file_;
  const std::vector<NifRay>& rays_;
  const char* config_;
  const bool own_allocator_;
};

TEST(NoMemoryInTheRuntime, EveryCallSaysSoAndTheNextWorks) {
  const TempDir folder;
  const std::vector<std::byte> encoded =
      format::encode(random_asset(5, {.bvhs = 1, .features = 2, .skins = 1}));
  struct alignas(64) Line {
    std::byte bytes[64];
  };
  std::vector<Line> lines((encoded.size() + 63) / 64);  // what is borrowed has to be aligned
  std::copy(encoded.begin(), encoded.end(), lines.front().bytes);
  const std::span<const std::byte> file(lines.front().bytes, encoded.size());
  const std::string path =
      folder.write("a.nif", {reinterpret_cast<const char*>(file.data()), file.size()}).string();
  Random random(5);
  const format::AssetView view = format::read_asset(file, "file");
  const std::vector<NifRay> rays = random_rays(random, view.objects[0].as<kernels::SegmentField>(), 200);
  std::vector<uint8_t> expected;
  for (const char* config : {"threads=1,shaders=on", "threads=2,shaders=on"}) {
    for (const bool own_allocator : {true, false}) {
      for (const bool once : {true, false}) {
        int64_t reached = 1;
        // All of the first ones, and some of the others, which are similar.
        for (int64_t number = 0; reached > 0; number += 1 + number / 8) {
          only_one = once;
          left = number;
          failed = 0;
          Everything everything(path, file, rays, config, own_allocator);
          everything.run();
          if (HasFatalFailure()) return;
          reached = failed;
          EXPECT_EQ(alive, 0) << "memory was lost after allocation " << number;
          if (expected.empty()) expected = everything.answers;
          ASSERT_EQ(everything.answers, expected) << "after allocation " << number;
          ASSERT_TRUE(number < 100'000);
          if (number == 0) {
            EXPECT_GT(everything.refused, 0);
          }
        }
      }
    }
  }
}

}  // namespace
}  // namespace nif::test
