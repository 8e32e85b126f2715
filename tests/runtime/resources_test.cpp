// The resources of queries: they allocate no memory, by any allocator, and use at most 16 kB of stack. A
// separate program, because it counts every call of malloc and the like.
#include <pthread.h>

#include <atomic>
#include <cerrno>
#include <cstring>
#include <thread>

#include "tests/runtime/runtime_fixture.hpp"

namespace {
std::atomic<int64_t> allocations = 0;
}

// glibc's own names for the functions replaced here; operator new, new_delete_resource and all others call
// them.
extern "C" {
void* __libc_malloc(size_t bytes);
void* __libc_calloc(size_t count, size_t bytes);
void* __libc_realloc(void* memory, size_t bytes);
void* __libc_memalign(size_t alignment, size_t bytes);

void* malloc(size_t bytes) {
  ++allocations;
  return __libc_malloc(bytes);
}
void* calloc(size_t count, size_t bytes) {
  ++allocations;
  return __libc_calloc(count, bytes);
}
void* realloc(void* memory, size_t bytes) {
  ++allocations;
  return __libc_realloc(memory, bytes);
}
void* memalign(size_t alignment, size_t bytes) {
  ++allocations;
  return __libc_memalign(alignment, bytes);
}
void* aligned_alloc(size_t alignment, size_t bytes) {
  ++allocations;
  return __libc_memalign(alignment, bytes);
}
int posix_memalign(void** memory, size_t alignment, size_t bytes) {
  ++allocations;
  *memory = __libc_memalign(alignment, bytes);
  return *memory ? 0 : ENOMEM;
}
}

namespace nif::test {
namespace {

class ThreadResources : public RuntimeTest, public testing::WithParamInterface<const char*> {
 protected:
  void SetUp() override {
    const NifError error = nifNewDevice(GetParam(), nullptr, &device_);
    if (error == NIF_ERROR_NOT_AVAILABLE) GTEST_SKIP() << nifGetErrorMessage();
    ASSERT_EQ(error, NIF_OK);
    const format::AssetView& view = make(1, {.objects = 2, .instances = 0, .bvhs = 1, .skins = 1});
    const NifAsset asset = load();
    scene_of(asset, 0);
    scene_of(asset, 2);
    const NifScene all = new_scene();
    for (uint32_t i = 0; i < 12; ++i) {
      std::array<float, 12> transform = kIdentity;
      transform[3] = float(i / 3);
      ASSERT_EQ(nifAddInstance(all, asset, i % 3, transform.data(), nullptr), NIF_OK);
    }
    ASSERT_EQ(nifCommitScene(all), NIF_OK);
    Random random(1);
    rays_ = random_rays(random, view.objects[0].as<kernels::SegmentField>(), 10001);
  }

  /// Every kind of query, none of which fails.
  static void ask(const ThreadResources& test, Answers& answers, void* scratch, uint64_t scratch_bytes) {
    const NifFallback occlude = [](void*, uint64_t count, const uint64_t*, uint8_t* visible) {
      std::memset(visible, 0, count);
    };
    for (const NifScene scene : test.scenes_) {
      NifRays query = nifMakeRays(test.rays_.data(), test.rays_.size());
      NifAnswers outputs = answers.outputs();
      check(nifQuery(scene, &query, &outputs));
      query.scratch = scratch;
      query.scratch_bytes = scratch_bytes;
      check(nifQuery(scene, &query, &outputs));
      check(nifQueryWithFallback(scene, &query, &outputs, 0.9f, occlude, nullptr));
      uint32_t open_ray = 0, open_count = 0;
      NifOpenRays open{};
      open.struct_size = sizeof(open);
      open.capacity = 1;
      open.rays = &open_ray;
      open.count = &open_count;
      check(nifQueryOpen(scene, &query, &outputs, &open));
      query = nifMakeRays(test.rays_.data(), test.rays_.size());
      NifHits hits{};
      hits.struct_size = sizeof(hits);
      hits.t = answers.probability.data();
      hits.hit = answers.visible.data();
      check(nifIntersect(scene, &query, &hits));
      query = nifMakeRays(test.rays_.data(), 100);
      outputs = only_visible(answers.visible.data());
      check(nifQuery(scene, &query, &outputs));
      check(nifQueryRay(scene, &test.rays_[0], &outputs));
    }
  }
  static void check(NifError error) {
    if (error != NIF_OK) std::abort();  // gtest's own checks allocate
  }

  std::vector<NifRay> rays_;
};

INSTANTIATE_TEST_SUITE_P(Each, ThreadResources,
                         testing::Values("threads=1,isa=scalar", "threads=1,isa=sse4", "threads=1,isa=avx2",
                                         "threads=1,isa=avx512", "threads=3"));

TEST_P(ThreadResources, NothingIsAllocated) {
  Answers answers(rays_.size());
  uint64_t bytes = 0;
  ASSERT_EQ(nifGetQueryScratchBytes(scenes_[0], rays_.size(), &bytes), NIF_OK);
  void* scratch = std::aligned_alloc(64, (bytes + 63) / 64 * 64);
  std::memset(scratch, 0, bytes);
  NifRays query = nifMakeRays(rays_.data(), rays_.size());
  const NifAnswers outputs = answers.outputs();
  NifJob job = nullptr;
  ASSERT_EQ(nifQueryAsync(scenes_[2], &query, &outputs, &job), NIF_OK);
  auto device_info = nifkit::sized<NifDeviceInfo>();
  auto asset_info = nifkit::sized<NifAssetInfo>();
  auto scene_info = nifkit::sized<NifSceneInfo>();
  auto object_info = nifkit::sized<NifObjectInfo>();
  auto part_info = nifkit::sized<NifPartInfo>();
  uint32_t done = 0;
  // The first pose of an instance allocates.
  check(nifGetObjectInfo(assets_[0], 2, &object_info));
  std::vector<float> vertices(3 * size_t{object_info.vertices}, 0.5f),
      joints(12 * size_t{object_info.joints});
  for (size_t i = 0; i < joints.size(); ++i) joints[i] = i % 12 % 5 == 0;
  const std::vector<float> weights(object_info.targets);
  auto pose = nifkit::sized<NifPose>();
  pose.joints = joints.data();
  pose.joint_count = object_info.joints;
  pose.weights = weights.data();
  pose.target_count = object_info.targets;
  check(nifSetInstanceVertices(scenes_[1], 0, vertices.data(), 12));
  check(nifPoseInstance(scenes_[1], 0, &pose));
  check(nifCommitScene(scenes_[1]));
  // So many that several threads commit them.
  NifScene crowd = nullptr;
  check(nifNewScene(device_, &crowd));
  const auto bending = uint32_t(20'000 / object_info.triangles + 2);
  const auto pose_crowd = [&] {
    for (uint32_t i = 0; i < bending; ++i) check(nifPoseInstance(crowd, i, &pose));
    check(nifCommitScene(crowd));
  };
  for (uint32_t i = 0; i < bending; ++i) check(nifAddInstance(crowd, assets_[0], 2, nullptr, nullptr));
  pose_crowd();

  const int64_t before = allocations;
  ask(*this, answers, scratch, bytes);
  ask(*this, answers, scratch, bytes);
  check(nifWaitJob(job));
  check(nifIsJobDone(job, &done));
  // The other calls that allocate nothing according to nif.h.
  check(nifGetQueryScratchBytes(scenes_[0], 5, &bytes));
  check(nifGetDeviceInfo(device_, &device_info));
  check(nifGetAssetInfo(assets_[0], &asset_info));
  check(nifGetObjectInfo(assets_[0], 0, &object_info));
  check(nifGetPartInfo(assets_[0], 1, &part_info));
  check(nifGetSceneInfo(scenes_[0], &scene_info));
  check(nifSetInstanceTransform(scenes_[2], 3, nullptr));
  check(nifSetInstanceVertices(scenes_[1], 0, vertices.data(), 12));
  check(nifPoseInstance(scenes_[1], 0, &pose));
  check(nifCommitScene(scenes_[1]));
  pose_crowd();
  nifGetErrorName(NIF_ERROR_CANCELLED);
  nifGetErrorMessage();
  const int64_t during = allocations - before;

  EXPECT_EQ(during, 0);
  EXPECT_GT(before, 100) << "nothing is counted at all";
  nifReleaseJob(job);
  nifReleaseScene(crowd);
  std::free(scratch);
}

TEST_P(ThreadResources, LittleStack) {
  // Runs a thread on a stack filled with a pattern, which shows how much of the stack was used.
  constexpr size_t kStack = 256 * 1024;
  constexpr unsigned char kPaint = 0xa5;
  auto* stack = static_cast<unsigned char*>(std::aligned_alloc(4096, kStack));
  struct Work {
    const ThreadResources* test;
    Answers* answers;
    bool asks;
  };
  Answers answers(rays_.size());
  const auto used_by = [&](bool asks) {
    std::memset(stack, kPaint, kStack);
    Work work{this, &answers, asks};
    pthread_attr_t attributes;
    pthread_attr_init(&attributes);
    EXPECT_EQ(pthread_attr_setstack(&attributes, stack, kStack), 0);
    pthread_t thread;
    EXPECT_EQ(pthread_create(
                  &thread, &attributes,
                  [](void* argument) -> void* {
                    const auto& todo = *static_cast<Work*>(argument);
                    if (todo.asks) ask(*todo.test, *todo.answers, nullptr, 0);
                    return nullptr;
                  },
                  &work),
              0);
    pthread_join(thread, nullptr);
    pthread_attr_destroy(&attributes);
    size_t untouched = 0;
    while (untouched < kStack && stack[untouched] == kPaint) ++untouched;
    return kStack - untouched;
  };
  const size_t without = used_by(false), with = used_by(true);
  std::free(stack);
  RecordProperty("bytes", std::to_string(with - without));
#ifdef __OPTIMIZE__
  EXPECT_LE(with - without, 16u * 1024);
#endif
  EXPECT_GT(with - without, 500u);
}

}  // namespace
}  // namespace nif::test
