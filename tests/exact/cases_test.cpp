// Every certain answer about hostile meshes, judged in exact arithmetic: cases that were wrong once, and new
// ones.
#include "tests/exact/cases.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>

#include "tests/exact/judge.hpp"

namespace nif::test {
namespace {

std::vector<std::filesystem::path> kept_cases() {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(NIF_EXACT_CASES))
    files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  return files;
}

void expect_right(const Case& one, const std::vector<Way>& ways, Tally& tally) {
  for (const Finding& f : judge(one, ways, 16, tally))
    ADD_FAILURE() << one.name << ": " << name_of(f.placed) << ", " << f.way << ": " << f.what << "\n"
                  << in_hex(f.ray);
}

class KeptCases : public testing::TestWithParam<std::filesystem::path> {};
TEST_P(KeptCases, AreRight) {
  const Case one = read_case(GetParam());
  ASSERT_FALSE(one.rays.empty());
  Tally tally;
  expect_right(one, make_ways(NIF_EMULATED_MODULE), tally);
  EXPECT_GE(tally.rays, 2 * one.rays.size());
}
INSTANTIATE_TEST_SUITE_P(Each, KeptCases, testing::ValuesIn(kept_cases()),
                         [](const auto& p) { return p.param.stem().string(); });

TEST(ExactCases, OfEachGeneratorAreRight) {
  const std::vector<Way> ways = make_ways({}), with_gpu = make_ways(NIF_EMULATED_MODULE);
  Tally tally;
  for (uint64_t number = 0; number <= mesh_generators().size(); ++number)
    expect_right(draw_case(7, number, 100), number % 8 == 0 ? with_gpu : ways, tally);
  EXPECT_GT(tally.certain, tally.rays / 4);
  EXPECT_GT(tally.answers, 10 * tally.rays);
}

TEST(ExactCases, AreTheSameAsText) {
  const Case one = draw_case(3, 5, 20);
  const std::filesystem::path file = std::filesystem::path(testing::TempDir()) / "nif_exact_case.txt";
  { std::ofstream(file) << to_text(one, {"a remark"}); }
  const Case again = read_case(file);
  std::filesystem::remove(file);
  EXPECT_EQ(again.name, one.name);
  EXPECT_EQ(again.transform, one.transform);
  EXPECT_EQ(again.rays.size(), one.rays.size());
  EXPECT_EQ(to_text(again, {}), to_text(one, {}));
}

}  // namespace
}  // namespace nif::test
