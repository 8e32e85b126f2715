// Assets of every version of the format still read, and still answer the same bits.
#include "tests/golden/golden.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
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

std::vector<test::GoldenAnswer> read_answers(fs::path path) {
  path.replace_extension(".answers");
  std::vector<test::GoldenAnswer> answers(fs::file_size(path) / sizeof(test::GoldenAnswer));
  std::ifstream(path, std::ios::binary)
      .read(reinterpret_cast<char*>(answers.data()),
            std::streamsize(answers.size() * sizeof(test::GoldenAnswer)));
  return answers;
}

TEST(Golden, StillAnswersTheSame) {
  const auto paths = golden_assets();
  ASSERT_GE(paths.size(), 2u);
  for (const fs::path& path : paths) {
    SCOPED_TRACE(path.string());
    const auto memory = format::FileMemory::load(path.string(), format::FileMemory::Mode::read);
    const auto view = format::read_asset(memory.bytes(), path.string());
    const auto answers = read_answers(path);
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
