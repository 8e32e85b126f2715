// Many threads query one scene, load assets and fail at the same time; meant for the thread sanitizer.
#include <atomic>
#include <string>
#include <thread>

#include "tests/runtime/runtime_fixture.hpp"

namespace nif::test {
namespace {

class Threads : public RuntimeTest {};

TEST_F(Threads, QueryOneScene) {
  const format::AssetView& view = make(1);
  const NifScene scene = new_scene();
  ASSERT_EQ(nifAddAsset(scene, load(), nullptr, nullptr, nullptr), NIF_OK);
  ASSERT_EQ(nifCommitScene(scene), NIF_OK);
  Random random(1);
  const auto rays = random_rays(random, view.objects[0].as<kernels::SegmentField>(), 2000);
  const Answers expected = query_all(scene, rays);
  std::atomic<int> wrong = 0;
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; ++t)
    threads.emplace_back([&] {
      for (int round = 0; round < 3; ++round) wrong += !(query_all(scene, rays) == expected);
    });
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(wrong, 0);
}

TEST_F(Threads, ShareDeviceAndAsset) {
  const format::AssetView& view = make(2);
  const NifAsset shared = load();
  Random random(2);
  const auto rays = random_rays(random, view.objects[0].as<kernels::SegmentField>(), 200);
  const Answers expected = query_all(scene_of(shared, 0), rays);
  std::atomic<int> wrong = 0;
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; ++t)
    threads.emplace_back([&] {
      for (int round = 0; round < 20; ++round) {
        NifAsset own = nullptr;
        NifScene scene = nullptr;
        wrong += nifLoadAssetMemory(device_, file_.data(), file_.size(), NIF_LOAD_COPY, &own) != NIF_OK;
        wrong += nifNewScene(device_, &scene) != NIF_OK;
        wrong += nifAddInstance(scene, round % 2 ? own : shared, 0, nullptr, nullptr) != NIF_OK;
        wrong += nifCommitScene(scene) != NIF_OK;
        nifReleaseAsset(own);
        wrong += !(query_all(scene, rays) == expected);
        nifReleaseScene(scene);
      }
    });
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(wrong, 0);
}

TEST_F(Threads, MakeAndReleaseHandles) {
  // The table of handles grows, and slots are reused, while other threads look up theirs.
  make(3);
  const NifAsset asset = load();
  std::atomic<int> wrong = 0;
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; ++t)
    threads.emplace_back([&] {
      std::vector<NifScene> scenes(400, nullptr);
      for (int round = 0; round < 3; ++round) {
        for (NifScene& scene : scenes) {
          wrong += nifNewScene(device_, &scene) != NIF_OK;
          wrong += nifAddInstance(scene, asset, 0, nullptr, nullptr) != NIF_OK;
          nifRetainScene(scene);
          nifRetainAsset(asset);
          nifReleaseAsset(asset);
          nifReleaseScene(scene);
        }
        for (const NifScene scene : scenes) {
          wrong += nifCommitScene(scene) != NIF_OK;
          nifReleaseScene(scene);
          wrong += nifCommitScene(scene) != NIF_ERROR_INVALID_ARGUMENT;
          nifReleaseScene(scene);
        }
      }
    });
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(wrong, 0);
}

TEST_F(Threads, EachHasItsOwnMessage) {
  std::atomic<int> wrong = 0;
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; ++t)
    threads.emplace_back([&, t] {
      wrong += std::string(nifGetErrorMessage()) != "";
      const std::string path = "nowhere/" + std::to_string(t) + ".nif";
      for (int round = 0; round < 100; ++round) {
        NifAsset asset = nullptr;
        wrong += nifLoadAssetFile(device_, path.c_str(), NIF_LOAD_COPY, &asset) != NIF_ERROR_FILE_NOT_FOUND;
        wrong += std::string(nifGetErrorMessage()).find(path) != 0;
      }
    });
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(wrong, 0);
}

}  // namespace
}  // namespace nif::test
