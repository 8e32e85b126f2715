// `nif validate` as users see it: what it prints, its exit codes, and how it escapes untrusted text. Its
// findings are tested in tests/validate.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "formats/base/status.hpp"
#include "formats/nif/writer.hpp"
#include "tests/cli/program.hpp"
#include "tests/support/random_asset.hpp"
#include "tests/support/temp_dir.hpp"

namespace nif::test {
namespace {

class ValidateCommand : public testing::Test {
 protected:
  std::string write(const std::string& name, const std::vector<std::byte>& bytes) {
    return folder_.write(name, {reinterpret_cast<const char*>(bytes.data()), bytes.size()}).string();
  }
  TempDir folder_;
};

/// A ball without any defect.
format::Asset good_asset() {
  RandomAssetOptions options;
  options.objects = options.instances = 0;
  options.bvhs = 1;
  format::Asset asset = random_asset(3, options);
  asset.metadata = R"({"tool":{"name":"another program"}})";
  return asset;
}

TEST_F(ValidateCommand, SaysThatNothingIsWrong) {
  const std::string path = write("good.nif", format::encode(good_asset()));
  const Outcome outcome = nif({"validate", "--strict", path});
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ(outcome.out, path + ": nothing is wrong\n");
  EXPECT_EQ(outcome.err, "");
  EXPECT_EQ(nif({"validate", "--strict", "--quiet", path}).out, "");
}

TEST_F(ValidateCommand, FailsByTheFirstErrorAndGoesOn) {
  std::vector<std::byte> damaged = format::encode(good_asset());
  damaged.back() ^= std::byte{1};
  const std::string good = write("good.nif", format::encode(good_asset())), bad = write("bad.nif", damaged),
                    missing = (folder_.path() / "missing.nif").string();
  const Outcome outcome = nif({"validate", bad, missing, good});
  EXPECT_EQ(outcome.code, int(Status::damaged_nif));
  EXPECT_NE(outcome.out.find(bad + ": 1 error\n  error 118: section META"), std::string::npos) << outcome.out;
  EXPECT_NE(outcome.out.find(missing + ": there is no such file\n"), std::string::npos) << outcome.out;
  EXPECT_NE(outcome.out.find(good + ": nothing is wrong\n"), std::string::npos) << outcome.out;
  EXPECT_TRUE(outcome.err.starts_with("nif: 2 of 3 assets fail; the first is " + bad + ": error 118: "))
      << outcome.err;

  const Outcome json = nif({"validate", bad, "--json"});
  EXPECT_EQ(json.code, int(Status::damaged_nif));
  const auto result = nlohmann::json::parse(json.out);
  EXPECT_EQ(result["schema"], "nifkit.validate/1");
  EXPECT_EQ(result["files"][0]["valid"], false);
  EXPECT_EQ(result["files"][0]["errors"], 1);
  EXPECT_EQ(result["files"][0]["findings"][0]["number"], 118);
  EXPECT_EQ(result["files"][0]["findings"][0]["name"], "section_checksum");
}

TEST_F(ValidateCommand, WarningsFailOnlyIfStrict) {
  format::Asset asset = good_asset();
  asset.objects[0].bias = 1e6f;
  const std::string path = write("doubtful.nif", format::encode(asset));
  EXPECT_EQ(nif({"validate", path}).code, 0);
  const Outcome strict = nif({"validate", "--strict", path});
  EXPECT_EQ(strict.code, int(Status::doubtful_nif));
  EXPECT_NE(strict.err.find("warning 912"), std::string::npos) << strict.err;
}

TEST_F(ValidateCommand, EscapesTextOfOthers) {
  format::Asset asset = good_asset();
  asset.objects[0].name = "a\x1b[31m\n\xc2\x9b\u00e9";
  asset.objects.push_back(asset.objects[0]);
  const std::string path = write("names.nif", format::encode(asset));
  for (const char* verb : {"validate", "info"}) {
    const Outcome outcome = nif({verb, path});
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_EQ(outcome.out.find('\x1b'), std::string::npos) << outcome.out;
    EXPECT_NE(outcome.out.find("'a\\x1b[31m\\x0a\\x9b\u00e9'"), std::string::npos) << outcome.out;
  }
}

/// Metadata is shown, but not trusted: a long value is neither repeated a thousand times nor searched without
/// end.
TEST_F(ValidateCommand, InfoOfMetadataOfAnySizeIsShort) {
  format::Asset asset = random_asset(3, {.objects = 1, .instances = 3});
  ASSERT_EQ(asset.instances.size(), 3u);
  asset.metadata =
      nlohmann::json{{"hierarchy",
                      {{"nodes", {{{"node", 0}, {"parent", 0}, {"name", std::string(100000, '\x01')}}}},
                       {"instances", std::vector<int>(asset.instances.size(), 0)}}}}
          .dump();
  const Outcome circle = nif({"info", write("circle.nif", format::encode(asset))});
  EXPECT_EQ(circle.code, 0) << circle.err;
  EXPECT_NE(circle.out.find("node 0, "), std::string::npos) << circle.out.substr(0, 2000);
  EXPECT_LT(circle.out.size(), 3 * 10000u);
  nlohmann::json wide;
  for (int i = 0; i < 200000; ++i) wide[std::to_string(i)] = i;
  asset.metadata = wide.dump();
  EXPECT_EQ(nif({"info", write("wide.nif", format::encode(asset))}).code, 0);
}

TEST_F(ValidateCommand, ListsNumbersAndWantsAFile) {
  const Outcome list = nif({"validate", "--list"});
  EXPECT_EQ(list.code, 0);
  EXPECT_NE(list.out.find("118  error    section_checksum"), std::string::npos) << list.out;
  EXPECT_EQ(nlohmann::json::parse(nif({"validate", "--list", "--json"}).out)["rules"][0]["number"], 101);
  const Outcome none = nif({"validate"});
  EXPECT_EQ(none.code, int(Status::usage));
  EXPECT_EQ(none.err, "nif: no asset is given; see --help\n");
}

}  // namespace
}  // namespace nif::test
