// Numbers of triangles in a source mesh, in files: everything is kept, readers may do without them, and what
// is wrong is refused.
#include <gtest/gtest.h>

#include <functional>
#include <set>

#include "formats/nif/writer.hpp"
#include "tests/format/damaged.hpp"
#include "tests/format/optional.hpp"
#include "tests/support/random_asset.hpp"

namespace nif {
namespace {

using test::Bytes;
using test::status_of;

/// A `segment`, two `bvh` and two `exact` objects; objects 1 to 3 have numbers.
format::Asset asset_with_sources(uint64_t seed, uint32_t sources = 3) {
  return test::random_asset(
      seed, {.objects = 1, .instances = 1, .max_voxels = 7, .bvhs = 2, .exacts = 2, .sources = sources});
}

TEST(SourceTrianglesFile, KeepsEveryNumber) {
  std::set<uint32_t> widths;
  for (uint64_t seed = 0; seed < 40; ++seed) {
    const format::Asset asset = asset_with_sources(seed);
    const Bytes bytes = format::encode(asset);
    EXPECT_EQ(format::encoded_bytes(asset), bytes.size());
    const format::AssetView view = format::read_asset(bytes, "file");
    EXPECT_EQ(bytes, format::encode(format::to_asset(view)));
    ASSERT_EQ(view.numbers.size(), 3u);
    EXPECT_EQ(view.numbers_of(0, format::kSourceTriangles), nullptr);
    EXPECT_EQ(view.numbers_of(4, format::kSourceTriangles), nullptr);
    uint64_t all = 0;
    for (uint32_t object = 1; object < 4; ++object) {
      const format::NumbersView* seen = view.numbers_of(object, format::kSourceTriangles);
      ASSERT_NE(seen, nullptr);
      const format::Numbers& kept = asset.objects[object].numbers.at(format::kSourceTriangles);
      EXPECT_EQ(seen->object, object);
      EXPECT_EQ(seen->below, kept.below);
      ASSERT_EQ(seen->field.count, kept.values.size());
      EXPECT_EQ(seen->bytes, (uint64_t{seen->field.count} * seen->field.bits + 31) / 32 * 4);
      for (uint32_t i = 0; i < seen->field.count; ++i)
        ASSERT_EQ(kernels::source_triangle(seen->field, i), kept.values[i]);
      EXPECT_EQ(kernels::source_triangle(seen->field, kernels::kNoTriangle), kernels::kNoTriangle);
      widths.insert(seen->field.bits);
      all += seen->bytes;
    }
    for (const format::PartBytes& part : format::bytes_by_part(view))
      if (std::string_view(part.name) == "source_triangles") {
        EXPECT_EQ(part.bytes, all);
      }
  }
  EXPECT_GT(widths.size(), 4u);
}

/// Numbers of every width, across the ends of words.
TEST(SourceTrianglesFile, PacksNumbersOfAnyWidth) {
  test::Random random(1);
  EXPECT_EQ(kernels::source_bits(1), 1u);
  EXPECT_EQ(kernels::source_bits(2), 1u);
  EXPECT_EQ(kernels::source_bits(3), 2u);
  EXPECT_EQ(kernels::source_bits(0x80000000u), 31u);
  EXPECT_EQ(kernels::source_bits(0xffffffffu), 32u);
  for (uint32_t bits = 1; bits <= 32; ++bits) {
    format::Asset asset = asset_with_sources(3, 1);
    format::Numbers& source = asset.objects[1].numbers.at(format::kSourceTriangles);
    source.below = bits == 32 ? 0xffffffffu : 1u << bits;
    if (source.below < source.values.size()) continue;
    ASSERT_EQ(kernels::source_bits(source.below), bits);
    for (uint32_t& number : source.values) number = random.below(source.below);
    source.values.front() = source.below - 1;
    const Bytes bytes = format::encode(asset);
    const format::AssetView view = format::read_asset(bytes, "file");
    EXPECT_EQ(format::to_asset(view).objects[1].numbers.at(format::kSourceTriangles).values, source.values)
        << bits;
  }
  EXPECT_EQ(kernels::source_triangle({}, 5), 5u) << "without numbers, its own";
}

TEST(SourceTrianglesFile, IsOptional) {
  test::expect_optional(format::encode(asset_with_sources(1)), format::encode(asset_with_sources(1, 0)),
                        {format::kNumbersRecords, format::kNumbersValues});
}

TEST(SourceTrianglesFile, RefusesWrongRecords) {
  const format::Asset asset = asset_with_sources(2);
  const Bytes file = format::encode(asset);
  const auto refused = [&](uint32_t index, const std::function<void(format::NumbersRecord&)>& change) {
    return status_of(test::with_record<format::NumbersRecord>(file, format::kNumbersRecords, index,
                                                              change)) == Status::damaged_nif;
  };
  EXPECT_FALSE(refused(0, [](auto&) {}));
  EXPECT_TRUE(refused(0, [](auto& r) { r.object = 0; })) << "has no triangles";
  EXPECT_TRUE(refused(2, [](auto& r) { r.object = 5; }));
  EXPECT_TRUE(refused(2, [](auto& r) { r.object = 0xffffffff; }));
  EXPECT_TRUE(refused(1, [](auto& r) { r.object = 1; }));
  EXPECT_TRUE(refused(1, [](auto& r) { r.object = 3; }));
  EXPECT_TRUE(refused(0, [](auto& r) { r.below = 0; })) << "2^32, so other widths";
  EXPECT_TRUE(refused(0, [](auto& r) { r.below = 0xffffffff; })) << "other widths";
  const uint32_t largest =
      *std::ranges::max_element(asset.objects[1].numbers.at(format::kSourceTriangles).values);
  if (kernels::source_bits(largest) ==
      kernels::source_bits(asset.objects[1].numbers.at(format::kSourceTriangles).below)) {
    EXPECT_TRUE(refused(0, [&](auto& r) { r.below = largest; })) << "the largest number is beyond";
  }
  EXPECT_TRUE(refused(0, [](auto& r) { r.reserved = 1; }));
  EXPECT_TRUE(refused(1, [](auto& r) { r.numbers.offset += 64; }));
  EXPECT_TRUE(refused(1, [](auto& r) { r.numbers.offset = ~uint64_t{63}; }));
  EXPECT_TRUE(refused(1, [](auto& r) { r.numbers.bytes = ~uint64_t{0}; }));
}

TEST(SourceTrianglesFile, RefusesWrongNumbers) {
  const auto status_after = [](const std::function<void(format::Asset&)>& change) {
    format::Asset asset = asset_with_sources(3);
    asset.objects[1].numbers.at(format::kSourceTriangles).below = 100;
    for (uint32_t& number : asset.objects[1].numbers.at(format::kSourceTriangles).values) number %= 100;
    change(asset);
    try {
      format::encode(asset);
      return Status::ok;
    } catch (const Error& error) {
      return error.status();
    }
  };
  EXPECT_EQ(status_after([](auto&) {}), Status::ok);
  EXPECT_EQ(status_after([](auto& a) { a.objects[1].numbers.at(format::kSourceTriangles).values[0] = 99; }),
            Status::ok);
  EXPECT_EQ(status_after([](auto& a) { a.objects[1].numbers.at(format::kSourceTriangles).values[0] = 100; }),
            Status::internal);
  EXPECT_EQ(status_after([](auto& a) { a.objects[1].numbers.at(format::kSourceTriangles).values.clear(); }),
            Status::internal);
  EXPECT_EQ(status_after([](auto& a) {
              for (int i = 0; i < 32; ++i)
                a.objects[1].numbers.at(format::kSourceTriangles).values.push_back(0);
            }),
            Status::internal);
  EXPECT_EQ(status_after([](auto& a) { a.objects[0].numbers = a.objects[1].numbers; }), Status::internal)
      << "a segment object has no triangles";
}

/// Bits beyond the last number must be zero, as all that means nothing.
TEST(SourceTrianglesFile, RefusesBitsAfterTheLastNumber) {
  uint32_t tried = 0;
  for (uint64_t seed = 0; seed < 20; ++seed) {
    const format::Asset asset = asset_with_sources(seed, 1);
    Bytes file = format::encode(asset);
    const format::Numbers& source = asset.objects[1].numbers.at(format::kSourceTriangles);
    const auto entry = test::section_entry(file, test::find_section(file, format::kNumbersValues));
    if (source.values.size() * kernels::source_bits(source.below) % 32 == 0) continue;
    file[entry.offset + entry.bytes - 1] |= std::byte{0x80};
    test::fix_checksums(file);
    EXPECT_EQ(status_of(file), Status::damaged_nif);
    ++tried;
  }
  EXPECT_GT(tried, 10u);
}

}  // namespace
}  // namespace nif
