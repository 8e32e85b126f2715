// Translations that floats cannot hold: what the file keeps of them, and which ones it may not have.
#include <gtest/gtest.h>

#include <cmath>

#include "formats/nif/writer.hpp"
#include "tests/format/damaged.hpp"
#include "tests/support/random_asset.hpp"

namespace nif::test {
namespace {

format::Asset far_asset(bool translations = true) {
  return random_asset(1, {.objects = 0, .instances = 3, .bvhs = 1, .translations = translations});
}

Bytes with_translation(const Bytes& file, double x) {
  return with_record<format::InstanceRecord>(file, format::kInstances, 0,
                                             [&](auto& record) { record.translation[0] = x; });
}

TEST(Translations, AreReadAsTheyWereWritten) {
  const format::Asset asset = far_asset();
  const Bytes bytes = format::encode(asset);
  const format::AssetView view = format::read_asset(bytes, "file");
  for (size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(view.instances[i].transform, asset.instances[i].transform);
    EXPECT_EQ(view.instances[i].remainder, asset.instances[i].remainder);
    EXPECT_NE(view.instances[i].remainder, (std::array<float, 3>{}));
  }
  EXPECT_EQ(format::encode(format::to_asset(view)), bytes);
}

/// -0 moves points as 0 does, but not to the same bits.
TEST(Translations, KeepTheSignOfZero) {
  format::Asset asset = far_asset(false);
  asset.instances[0].transform[3] = -0.0f;
  const Bytes bytes = format::encode(asset);
  const format::AssetView view = format::read_asset(bytes, "file");
  EXPECT_TRUE(std::signbit(view.instances[0].transform[3]));
  EXPECT_EQ(view.instances[0].remainder, (std::array<float, 3>{}));
}

TEST(Translations, AreSumsOfTwoSingles) {
  const Bytes good = format::encode(far_asset());
  const float most = std::numeric_limits<float>::max(), least = std::numeric_limits<float>::denorm_min();
  for (const double right :
       {0.0, -0.0, 1.0 / 3 - double(static_cast<float>(1.0 / 3)), 1 + std::ldexp(1.0, -47), double(most),
        -double(most), double(least), 16777217.0})
    EXPECT_EQ(status_of(with_translation(good, right)), Status::ok) << right;
  for (const double wrong :
       {double(NAN), double(INFINITY), -1e300, 1.0 / 3, double(least) / 2,
        double(most) + std::ldexp(1.0, 102), 1 + std::ldexp(1.0, -24) + std::ldexp(1.0, -52)})
    EXPECT_EQ(status_of(with_translation(good, wrong)), Status::damaged_nif) << wrong;
}

}  // namespace
}  // namespace nif::test
