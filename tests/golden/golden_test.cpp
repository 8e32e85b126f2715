// Assets of every version of the format are still read, and still answer the same bits.
#include "tests/golden/golden.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <vector>

#include "formats/nif/file_memory.hpp"
#include "formats/nif/writer.hpp"
#include "tests/support/query_object.hpp"

namespace nif {
namespace {

namespace fs = std::filesystem;

std::vector<fs::path> golden_assets() {
  std::vector<fs::path> paths;
  for (const auto& entry : fs::directory_iterator(NIF_GOLDEN_FOLDER))
    if (entry.path().extension() == ".nif") paths.push_back(entry.path());
  std::sort(paths.begin(), paths.end());
  return paths;
}

template <class Record>
std::vector<Record> read_records(fs::path path, const char* extension) {
  path.replace_extension(extension);
  std::vector<Record> records(fs::file_size(path) / sizeof(Record));
  std::ifstream(path, std::ios::binary)
      .read(reinterpret_cast<char*>(records.data()), std::streamsize(records.size() * sizeof(Record)));
  return records;
}

/// Calls visit(first, last) for each range of records of one scene.
template <class Record, class Scene, class Visit>
void for_each_scene(const std::vector<Record>& records, Scene Record::*scene, const Visit& visit) {
  for (size_t first = 0, last; first < records.size(); first = last) {
    for (last = first; last < records.size() && records[last].*scene == records[first].*scene;) ++last;
    visit(first, last);
  }
}

TEST(Golden, StillAnswersTheSame) {
  const auto paths = golden_assets();
  ASSERT_GE(paths.size(), 2u);
  for (const fs::path& path : paths) {
    SCOPED_TRACE(path.string());
    const auto memory = format::FileMemory::load(path.string(), format::FileMemory::Mode::read);
    const auto view = format::read_asset(memory.bytes(), path.string());
    const auto answers = read_records<test::GoldenAnswer>(path, ".answers");
    ASSERT_GE(answers.size(), 300u);
    for (const test::GoldenAnswer& golden : answers) {
      ASSERT_LT(golden.object, view.objects.size());
      const auto answer = test::query_object(view.objects[golden.object], golden.ray);
      ASSERT_EQ(answer.visible, golden.visible != 0);
      ASSERT_EQ(answer.certain, golden.certain != 0);
      ASSERT_EQ(answer.logit, golden.logit);
    }
  }
}

/// For every instruction set: answers of objects, and first hits of objects and whole assets.
class GoldenOn : public testing::TestWithParam<const char*> {
 protected:
  void SetUp() override {
    try {
      device_ = std::make_unique<nifkit::Device>(GetParam());
    } catch (const nifkit::Error& error) {
      if (error.code() != NIF_ERROR_NOT_AVAILABLE) throw;
      GTEST_SKIP() << error.what();
    }
  }
  std::unique_ptr<nifkit::Device> device_;
};

TEST_P(GoldenOn, AnswersTheSame) {
  for (const fs::path& path : golden_assets()) {
    SCOPED_TRACE(path.string());
    const auto asset = nifkit::Asset::load(*device_, path.string());
    const auto answers = read_records<test::GoldenAnswer>(path, ".answers");
    for_each_scene(answers, &test::GoldenAnswer::object, [&](size_t first, size_t last) {
      std::vector<NifRay> rays;
      for (size_t i = first; i < last; ++i) rays.push_back(test::to_nif_ray(answers[i].ray));
      std::vector<uint8_t> visible(rays.size()), certain(rays.size());
      std::vector<int32_t> logit(rays.size());
      test::golden_scene(*device_, asset, answers[first].object)
          .query(nifkit::Rays(rays), nifkit::Answers().visible(visible).certain(certain).logit(logit));
      for (size_t i = first; i < last; ++i) {
        ASSERT_EQ(visible[i - first], answers[i].visible) << i;
        ASSERT_EQ(certain[i - first], answers[i].certain) << i;
        ASSERT_EQ(logit[i - first], answers[i].logit) << i;
      }
    });
  }
}

TEST_P(GoldenOn, HitsTheSame) {
  for (const fs::path& path : golden_assets()) {
    SCOPED_TRACE(path.string());
    const auto asset = nifkit::Asset::load(*device_, path.string());
    const auto golden = read_records<test::GoldenHit>(path, ".hits");
    ASSERT_GE(golden.size(), 100u);
    ASSERT_EQ(golden.back().scene, test::kWholeAsset);
    for_each_scene(golden, &test::GoldenHit::scene, [&](size_t first, size_t last) {
      std::vector<kernels::Segment> rays;
      for (size_t i = first; i < last; ++i) rays.push_back(golden[i].ray);
      const uint32_t number = golden[first].scene;
      const auto hits = test::golden_hits(test::golden_scene(*device_, asset, number), number, rays);
      for (size_t i = first; i < last; ++i)
        ASSERT_EQ(std::memcmp(&hits[i - first], &golden[i], sizeof(test::GoldenHit)), 0)
            << i << ": t " << golden[i].t << ", now " << hits[i - first].t;
    });
  }
}

INSTANTIATE_TEST_SUITE_P(Kernels, GoldenOn,
                         testing::Values("isa=scalar", "isa=sse4", "isa=avx2", "isa=avx512", "isa=neon",
                                         "isa=auto", "memory=least"),
                         [](const auto& name) {
                           const std::string config = name.param;
                           return config.substr(config.find('=') + 1);
                         });

TEST(Golden, Version2IsWrittenTheSame) {
  for (const fs::path& path : golden_assets()) {
    if (!path.filename().string().starts_with("v2-")) continue;
    const auto memory = format::FileMemory::load(path.string(), format::FileMemory::Mode::map);
    const auto written = format::encode(format::to_asset(format::read_asset(memory.bytes(), path.string())));
    EXPECT_TRUE(std::ranges::equal(written, memory.bytes())) << path;
  }
}

}  // namespace
}  // namespace nif
