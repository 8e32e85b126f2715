// The fixture of the runtime's tests: an encoded random asset, and the reference's answers to compare with.
#pragma once

#include <gtest/gtest.h>
#include <nif/nif.hpp>

#include <memory>
#include <vector>

#include "formats/nif/reader.hpp"
#include "formats/nif/writer.hpp"
#include "tests/support/query_answers.hpp"
#include "tests/support/random_asset.hpp"
#include "tests/support/to_world.hpp"

namespace nif::test {

/// An asset in memory with its views, and handles to the same bytes through the runtime.
class RuntimeTest : public testing::Test {
 protected:
  void SetUp() override { ASSERT_EQ(nifNewDevice(nullptr, nullptr, &device_), NIF_OK); }
  void TearDown() override {
    for (const NifScene scene : scenes_) nifReleaseScene(scene);
    for (const NifAsset asset : assets_) nifReleaseAsset(asset);
    nifReleaseDevice(device_);
  }

  const format::AssetView& make(uint64_t seed, const RandomAssetOptions& options = {}) {
    file_ = format::encode(random_asset(seed, options));
    view_ = std::make_unique<format::AssetView>(format::read_asset(file_, "file"));
    return *view_;
  }
  NifAsset load() {
    NifAsset asset = nullptr;
    EXPECT_EQ(nifLoadAssetMemory(device_, file_.data(), file_.size(), NIF_LOAD_COPY, &asset), NIF_OK)
        << nifGetErrorMessage();
    assets_.push_back(asset);
    return asset;
  }
  NifScene new_scene() {
    NifScene scene = nullptr;
    EXPECT_EQ(nifNewScene(device_, &scene), NIF_OK);
    scenes_.push_back(scene);
    return scene;
  }
  NifScene scene_of(NifAsset asset, uint32_t object, const float* transform = nullptr) {
    const NifScene scene = new_scene();
    EXPECT_EQ(nifAddInstance(scene, asset, object, transform, nullptr), NIF_OK) << nifGetErrorMessage();
    EXPECT_EQ(nifCommitScene(scene), NIF_OK);
    return scene;
  }

  NifDevice device_ = nullptr;
  std::vector<std::byte> file_;
  std::unique_ptr<format::AssetView> view_;
  std::vector<NifAsset> assets_;
  std::vector<NifScene> scenes_;
};

inline std::vector<NifRay> random_rays(Random& random, const kernels::SegmentField& field, size_t count) {
  std::vector<NifRay> rays;
  while (rays.size() < count) rays.push_back(to_ray(random_segment(random, field)));
  return rays;
}

/// For one ray: only whether it is visible.
inline NifAnswers only_visible(uint8_t* visible) {
  auto answers = nifkit::sized<NifAnswers>();
  answers.visible = visible;
  return answers;
}

inline Answers query_all(NifScene scene, const std::vector<NifRay>& rays) {
  Answers answers(rays.size());
  NifRays query = nifMakeRays(rays.data(), rays.size());
  const NifAnswers outputs = answers.outputs();
  EXPECT_EQ(nifQuery(scene, &query, &outputs), NIF_OK) << nifGetErrorMessage();
  return answers;
}

}  // namespace nif::test
