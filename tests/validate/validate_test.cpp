// Each number of `nif validate`: a file about which it is found, a line in the documentation; and nothing
// wrong with files that are right.
#include "formats/validate/validate.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <set>
#include <sstream>

#include "formats/nif/writer.hpp"
#include "tests/format/damaged.hpp"
#include "tests/support/random_asset.hpp"

namespace nif {
namespace {

using test::Bytes, validate::Entry, validate::Finding, validate::Findings, validate::Severity;

const std::filesystem::path kProject = NIF_PROJECT, kCorpus = kProject / "tests/corpus/validate";

Bytes bytes_in(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  EXPECT_TRUE(in) << path;
  const std::string text{std::istreambuf_iterator<char>(in), {}};
  const auto bytes = std::as_bytes(std::span(text));
  return {bytes.begin(), bytes.end()};
}

Findings findings_in(const Bytes& file) {
  const test::ExactBuffer buffer(file);
  return validate::validate(buffer.bytes(), "x.nif");
}

std::string sentences(const Findings& findings) {
  std::string all;
  for (const Finding& finding : findings.kept())
    all += std::to_string(finding.entry->number) + " " + finding.place + ": " + finding.what + "\n";
  return all;
}

TEST(Validate, NumbersAndNamesAreUnique) {
  std::set<uint16_t> numbers;
  std::set<std::string> names;
  uint16_t last = 0;
  for (const Entry& entry : validate::all_entries()) {
    EXPECT_TRUE(numbers.insert(entry.number).second) << entry.number;
    EXPECT_TRUE(names.insert(entry.name).second) << entry.name;
    EXPECT_LT(last, entry.number);
    last = entry.number;
    EXPECT_EQ(entry.status != Status::ok, entry.severity == Severity::error) << entry.number;
  }
}

TEST(Validate, FindsEachNumberInItsFile) {
  std::map<uint16_t, std::filesystem::path> files;
  for (const auto& file : std::filesystem::directory_iterator(kCorpus)) {
    const auto number = uint16_t(std::stoul(file.path().filename().string()));
    EXPECT_TRUE(files.emplace(number, file.path()).second) << file.path();
  }
  for (const Entry& entry : validate::all_entries()) {
    ASSERT_TRUE(files.contains(entry.number)) << entry.number << ' ' << entry.name << " has no file";
    const std::filesystem::path& path = files.at(entry.number);
    EXPECT_EQ(path.filename(), std::to_string(entry.number) + "-" + entry.name + ".nif");
    const Bytes file = bytes_in(path);
    const Findings findings = findings_in(file);
    EXPECT_GT(findings.count_of(entry.number), 0u) << path << '\n' << sentences(findings);
    const Status status = test::status_of(file);
    if (entry.number < 800)  // the reader refuses it, so there is no other finding
      EXPECT_EQ(status, entry.status) << path;
    else
      EXPECT_EQ(status, Status::ok) << path;
    files.erase(entry.number);
  }
  for (const auto& [number, path] : files) ADD_FAILURE() << path << " is of no number";
}

TEST(Validate, TakesMetadataAsDeepAsAnyIs) {
  test::RandomAssetOptions options;
  options.objects = options.instances = 0;
  options.bvhs = 1;
  format::Asset asset = test::random_asset(3, options);
  for (const size_t depth : {2u, 128u, 129u, 300'000u}) {
    const size_t within = depth - 1;
    asset.metadata = "{\"[[[\\\"[\":" + std::string(within, '[') + std::string(within, ']') + '}';
    const Findings findings = findings_in(format::encode(asset));
    EXPECT_EQ(findings.count_of(801), depth > 128 ? 1u : 0u) << depth << sentences(findings);
  }
}

/// The page has one line for each number, with the program's words, and no other line.
TEST(Validate, IsDocumented) {
  std::ifstream in(kProject / "docs/validation.md");
  ASSERT_TRUE(in);
  std::map<std::string, std::string> lines;
  for (std::string line; std::getline(in, line);)
    if (line.size() > 2 && line[0] == '|' && line[2] >= '0' && line[2] <= '9') {
      EXPECT_TRUE(lines.emplace(line.substr(2, 3), line).second) << line;
    }
  for (const Entry& entry : validate::all_entries()) {
    const std::string number = std::to_string(entry.number);
    std::string expected = "| " + number + " | `" + entry.name + "` | ";
    if (entry.number < 800)
      expected += std::to_string(int(entry.status));
    else
      expected += validate::name_of(entry.severity);
    expected += " | " + std::string(entry.what) + " |";
    EXPECT_EQ(lines[number], expected);
    lines.erase(number);
  }
  for (const auto& [number, line] : lines) ADD_FAILURE() << line;
}

/// Valid files of every encoding: the only findings are those that random assets must have.
TEST(Validate, TakesWhatTheBakerMakes) {
  size_t files = 0;
  for (const auto& file : std::filesystem::directory_iterator(kProject / "tests/corpus/asset")) {
    if (file.path().extension() != ".nif") continue;
    const Findings findings = findings_in(bytes_in(file.path()));
    EXPECT_EQ(findings.count(Severity::error) + findings.count(Severity::warning), 0u) << file.path() << '\n'
                                                                                       << sentences(findings);
    ++files;
  }
  EXPECT_GT(files, 10u);
}

TEST(Validate, TakesGoldenFiles) {
  for (const auto& file : std::filesystem::directory_iterator(kProject / "tests/golden")) {
    if (file.path().extension() != ".nif") continue;
    const Findings findings = findings_in(bytes_in(file.path()));
    EXPECT_EQ(findings.count(Severity::error), 0u) << file.path() << '\n' << sentences(findings);
  }
}

TEST(Validate, FindsAllWrongChecksums) {
  Bytes file = format::encode(test::random_asset(5));
  std::set<std::string> broken;
  const uint32_t sections = test::load<format::Header>(file, 0).section_count;
  for (uint32_t i = 0; i < sections; ++i) {
    const auto entry = test::section_entry(file, i);
    if (i % 2 || entry.bytes == 0 || (entry.flags & format::kPayloads)) continue;
    file[entry.offset] ^= std::byte{4};
    broken.insert("section " + format::section_name(entry.type) + " (entry " + std::to_string(i) + ")");
  }
  std::set<std::string> found;
  const Findings findings = findings_in(file);
  for (const Finding& finding : findings.kept()) {
    EXPECT_EQ(finding.entry->number, uint16_t(format::Rule::section_checksum));
    found.insert(finding.place);
  }
  EXPECT_EQ(found, broken);
  EXPECT_GT(found.size(), 2u);
}

TEST(Validate, KeepsTwentyOfANumberAndCountsTheRest) {
  test::RandomAssetOptions options;
  options.objects = 1;
  options.instances = 30;
  format::Asset asset = test::random_asset(6, options);
  for (format::Instance& instance : asset.instances) instance.transform.fill(0);
  const Findings findings = findings_in(format::encode(asset));
  constexpr auto kSingular = uint16_t(validate::Advice::transform_singular);
  EXPECT_EQ(findings.count_of(kSingular), 30u);
  size_t kept = 0;
  for (const Finding& finding : findings.kept()) kept += finding.entry->number == kSingular;
  EXPECT_EQ(kept, Findings::kKept);
  EXPECT_GE(findings.count(Severity::warning), 30u);
  EXPECT_EQ(findings.status(), Status::ok);
}

}  // namespace
}  // namespace nif
