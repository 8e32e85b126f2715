// Does everything concurrently that may be done so: threads load assets, build and change their own scenes,
// query a shared scene, start jobs and release handles, in random order. Every answer is compared. Meant for
// the thread sanitizer; tests/nightly.sh runs it for an hour.
#include <atomic>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <thread>

#include "tests/runtime/runtime_fixture.hpp"
#include "tests/support/plain_scene.hpp"

namespace nif::test {
namespace {

/// Borrowed bytes start at a multiple of this.
struct alignas(NIF_ASSET_ALIGNMENT) Block {
  std::byte bytes[NIF_ASSET_ALIGNMENT];
};

/// What all threads share, with the expected answers.
struct Shared {
  NifDevice device;
  NifAsset asset;
  NifScene scene;
  const std::byte* file;
  uint64_t file_bytes;
  std::vector<NifRay> rays;
  Answers answers;                           ///< of the scene
  std::vector<Matrix> transforms;            ///< of instances
  std::vector<std::vector<Answers>> placed;  ///< [object][transform] of a scene of only that instance
};

class Worker {
 public:
  Worker(const Shared& shared, uint64_t seed) : shared_(shared), random_(seed) {}

  /// Takes one random step. Returns false if an answer or a code was wrong.
  bool step() {
    switch (random_.below(6)) {
      case 0:
        return load_and_release();
      case 1:
        return change_own_scene();
      case 2:
        return query(shared_.scene, shared_.answers);
      case 3:
        return start_jobs();
      case 4:
        return ask_about();
      default:
        return fail();
    }
  }
  ~Worker() { nifReleaseScene(scene_); }

 private:
  bool query(NifScene scene, const Answers& expected) { return query_all(scene, shared_.rays) == expected; }

  /// Loads the asset again, into a scene that outlives its handle.
  bool load_and_release() {
    NifAsset asset = nullptr;
    NifScene scene = nullptr;
    const uint32_t object = random_.below(uint32_t(shared_.placed.size())),
                   transform = random_.below(uint32_t(shared_.transforms.size()));
    bool good =
        nifLoadAssetMemory(shared_.device, shared_.file, shared_.file_bytes,
                           random_.below(2) ? NIF_LOAD_COPY : NIF_LOAD_IN_PLACE, &asset) == NIF_OK &&
        nifNewScene(shared_.device, &scene) == NIF_OK &&
        nifAddInstance(scene, asset, object, shared_.transforms[transform].data(), nullptr) == NIF_OK &&
        nifCommitScene(scene) == NIF_OK;
    nifReleaseAsset(asset);
    good = good && query(scene, shared_.placed[object][transform]);
    nifReleaseScene(scene);
    return good;
  }

  /// Moves and queries one instance in a scene of this thread, again and again.
  bool change_own_scene() {
    if (!scene_ || random_.below(16) == 0) {
      nifReleaseScene(scene_);
      object_ = random_.below(uint32_t(shared_.placed.size()));
      if (nifNewScene(shared_.device, &scene_) != NIF_OK ||
          nifAddInstance(scene_, shared_.asset, object_, nullptr, nullptr) != NIF_OK)
        return false;
    }
    const uint32_t transform = random_.below(uint32_t(shared_.transforms.size()));
    return nifSetInstanceTransform(scene_, 0, shared_.transforms[transform].data()) == NIF_OK &&
           nifCommitScene(scene_) == NIF_OK && query(scene_, shared_.placed[object_][transform]);
  }

  /// Two jobs on the shared scene; a job that was waited for is complete.
  bool start_jobs() {
    Answers first(shared_.rays.size()), second(shared_.rays.size());
    bool good = true;
    NifJob jobs[2] = {};
    const NifRays rays = nifMakeRays(shared_.rays.data(), shared_.rays.size());
    const NifAnswers outputs[2] = {first.outputs(), second.outputs()};
    for (int i = 0; i < 2; ++i)
      good = good && nifQueryAsync(shared_.scene, &rays, &outputs[i], &jobs[i]) == NIF_OK;
    for (const NifJob job : jobs) good = job != nullptr && nifWaitJob(job) == NIF_OK && good;
    for (const NifJob job : jobs) nifReleaseJob(job);
    return good && first == shared_.answers && second == shared_.answers;
  }

  bool ask_about() {
    NifAssetInfo asset{};
    asset.struct_size = sizeof(asset);
    NifSceneInfo scene{};
    scene.struct_size = sizeof(scene);
    nifRetainAsset(shared_.asset);
    nifRetainScene(shared_.scene);
    const bool good = nifGetAssetInfo(shared_.asset, &asset) == NIF_OK &&
                      nifGetSceneInfo(shared_.scene, &scene) == NIF_OK && scene.committed == 1 &&
                      asset.object_count == shared_.placed.size();
    nifReleaseScene(shared_.scene);
    nifReleaseAsset(shared_.asset);
    return good;
  }

  /// This thread's own message, and a released handle.
  bool fail() {
    NifAsset asset = nullptr;
    const bool refused = nifLoadAssetMemory(shared_.device, shared_.file, shared_.file_bytes - 1,
                                            NIF_LOAD_COPY, &asset) == NIF_ERROR_FILE_TRUNCATED &&
                         std::string(nifGetErrorMessage()).starts_with("memory: ends after");
    NifScene scene = nullptr;
    const bool made = nifNewScene(shared_.device, &scene) == NIF_OK;
    nifReleaseScene(scene);
    return refused && made && nifCommitScene(scene) == NIF_ERROR_INVALID_ARGUMENT;
  }

  const Shared& shared_;
  Random random_;
  NifScene scene_ = nullptr;
  uint32_t object_ = 0;
};

class Stress : public RuntimeTest {
 protected:
  /// Runs four threads for this many seconds, on a device whose queries use two.
  void run(double seconds) {
    RandomAssetOptions options;
    options.objects = 2;
    options.bvhs = options.exacts = options.proofs = options.sphericals = 1;
    make(11, options);
    NifDevice device = nullptr;
    ASSERT_EQ(nifNewDevice("threads=2", nullptr, &device), NIF_OK);
    std::swap(device, device_);  // TearDown() releases it after what was made with it
    nifReleaseDevice(device);
    std::vector<Block> blocks(file_.size() / sizeof(Block) + 1);
    std::memcpy(blocks.data(), file_.data(), file_.size());
    Shared shared{device_, load(), new_scene(), blocks.front().bytes, file_.size(), {}, Answers(0), {}, {}};
    ASSERT_EQ(nifAddAsset(shared.scene, shared.asset, nullptr, nullptr, nullptr), NIF_OK);
    ASSERT_EQ(nifCommitScene(shared.scene), NIF_OK);
    Random random(11);
    shared.rays = rays_in_cube(random, 6, 300);
    shared.answers = query_all(shared.scene, shared.rays);
    for (int i = 0; i < 3; ++i) shared.transforms.push_back(random_transform(random, 2));
    for (uint32_t object = 0; object < view_->objects.size(); ++object) {
      std::vector<Answers>& placed = shared.placed.emplace_back();
      for (const Matrix& transform : shared.transforms)
        placed.push_back(query_all(scene_of(shared.asset, object, transform.data()), shared.rays));
    }
    std::atomic<uint64_t> steps = 0, wrong = 0;
    const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
    std::vector<std::thread> threads;
    for (uint64_t t = 0; t < 4; ++t)
      threads.emplace_back([&, t] {
        Worker worker(shared, 100 + t);
        while (std::chrono::steady_clock::now() < end) {
          wrong += !worker.step();
          ++steps;
        }
      });
    for (std::thread& thread : threads) thread.join();
    EXPECT_EQ(wrong, 0u) << "of " << steps << " steps";
    EXPECT_GT(steps, 4u);
    RecordProperty("steps", std::to_string(steps));
  }
};

TEST_F(Stress, ForASecond) { run(1); }

/// NIF_STRESS_SECONDS sets another duration.
TEST_F(Stress, ForHalfAMinute) {
  const char* seconds = std::getenv("NIF_STRESS_SECONDS");
  run(seconds ? std::atof(seconds) : 30);
}

}  // namespace
}  // namespace nif::test
