// Translations that floats cannot hold: what the file keeps of them, and what it must not say.
#include <gtest/gtest.h>

#include <limits>

#include "formats/nif/writer.hpp"
#include "tests/format/damaged.hpp"
#include "tests/support/random_asset.hpp"

namespace nif::test {
namespace {

format::Asset far_asset(bool translations = true) {
  return random_asset(1, {.objects = 0, .instances = 3, .bvhs = 1, .translations = translations});
}

/// An asset with one number of the section changed.
Bytes changed(Bytes file, size_t index, double value) {
  const auto entry = section_entry(file, find_section(file, format::kTranslations));
  store(file, entry.offset + index * sizeof(double), value);
  fix_checksums(file);
  return file;
}

TEST(Translations, AreReadAsTheyWereWritten) {
  const format::Asset asset = far_asset();
  const Bytes bytes = format::encode(asset);
  const format::AssetView view = format::read_asset(bytes, "file");
  for (size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(view.instances[i].remainder, asset.instances[i].remainder);
    EXPECT_NE(view.instances[i].remainder, (std::array<float, 3>{}));
  }
  EXPECT_EQ(format::encode(format::to_asset(view)), bytes);
}

TEST(Translations, AreLeftOutWhereFloatsHoldThem) {
  const Bytes bytes = format::encode(far_asset(false));
  for (const Part& part : parts_of(bytes)) EXPECT_NE(part.type, format::kTranslations);
}

TEST(Translations, MayBeUnknown) {
  const Bytes bytes = format::encode(far_asset());
  std::vector<Part> parts = parts_of(bytes);
  for (Part& part : parts)
    if (part.type == format::kTranslations) {
      EXPECT_EQ(part.flags, 0u);
      part.type = format::fourcc("NEW0");
    }
  const Bytes unknown = file_of(bytes, parts);
  for (const format::InstanceView& instance : format::read_asset(unknown, "file").instances)
    EXPECT_EQ(instance.remainder, (std::array<float, 3>{}));
}

TEST(Translations, ThatContradictTheTransformAreRefused) {
  const format::Asset asset = far_asset();
  const Bytes good = format::encode(asset);
  ASSERT_EQ(status_of(good), Status::ok);
  const float rounded = asset.instances[0].transform[3];
  const double step = double(std::nextafter(rounded, INFINITY)) - double(rounded);
  for (const double wrong :
       {double(rounded) + step, 0.0, double(NAN), double(INFINITY), -1e300, double(rounded) + step / 3})
    EXPECT_EQ(status_of(changed(good, 0, wrong)), Status::damaged_nif) << wrong;
  EXPECT_EQ(status_of(changed(good, 0, double(rounded) + step / 4)), Status::ok);
  EXPECT_EQ(status_of(changed(good, 0, double(rounded))), Status::ok) << "others have a remainder";
}

TEST(Translations, AreAsManyAsInstancesAndNotForNothing) {
  const Bytes good = format::encode(far_asset());
  for (const size_t count : {size_t{0}, size_t{2}, size_t{4}}) {
    std::vector<Part> parts = parts_of(good);
    for (Part& part : parts)
      if (part.type == format::kTranslations) part.content.resize(count * sizeof(format::Translation));
    EXPECT_EQ(status_of(file_of(good, parts)), Status::damaged_nif) << count;
  }
  Bytes rounded = good;
  const format::Asset asset = far_asset();
  for (size_t i = 0; i < 9; ++i)
    rounded = changed(rounded, i, double(asset.instances[i / 3].transform[4 * (i % 3) + 3]));
  EXPECT_EQ(status_of(rounded), Status::damaged_nif);
}

}  // namespace
}  // namespace nif::test
