// Files cut short or changed: each is refused by name or means what it meant, and never reads out of bounds.
#include <gtest/gtest.h>

#include "formats/nif/reader.hpp"
#include "formats/nif/writer.hpp"
#include "tests/format/damaged.hpp"
#include "tests/support/query_object.hpp"

namespace nif {
namespace {

using test::Bytes;
using test::ExactBuffer;

Bytes small_file(uint64_t seed) {
  test::RandomAssetOptions options;
  options.objects = 2;
  options.instances = 2;
  options.max_voxels = 5;
  options.bvhs = uint32_t(seed % 2);
  options.sphericals = seed % 4 < 2 ? 0 : 1 + uint32_t(seed % 2);
  options.exacts = seed % 3 == 1 ? 1 : 0;
  options.proofs = seed % 3 == 2 ? 1 : 0;
  options.cutouts = seed % 5 == 2 ? 1 + uint32_t(seed % 2) : 0;
  options.primaries = uint32_t(seed % 3);
  options.sources = uint32_t(seed % 2 + seed % 3);
  options.colors = uint32_t(seed % 4 / 2);
  options.skins = uint32_t(seed % 3);
  options.translations = seed % 5 == 1;
  options.numbers = options.settings = seed % 2 == 0;
  options.levels = uint32_t(seed % 3);
  return format::encode(test::random_asset(seed, options));
}

/// Status of reading the bytes. If they are accepted, every object and field is queried a little.
Status status_of(std::span<const std::byte> bytes, uint64_t seed) {
  try {
    const format::AssetView view = format::read_asset(bytes, "file");
    test::Random random(seed);
    for (const format::ObjectView& object : view.objects)
      for (int ray = 0; ray < 8; ++ray) test::query_object(object, test::random_segment(random, object));
    for (const format::PrimaryView& primary : view.primaries)
      for (int ray = 0; ray < 8; ++ray)
        kernels::query_primary(primary.field, test::random_segment(random, primary.field));
    return Status::ok;
  } catch (const Error& error) {
    EXPECT_TRUE(std::string_view(error.what()).starts_with("file: ")) << error.what();
    return error.status();
  }
}

TEST(Damage, EveryTruncation) {
  const Bytes file = small_file(1);
  for (size_t length = 0; length < file.size(); ++length) {
    const ExactBuffer cut{std::span(file).first(length)};
    ASSERT_EQ(status_of(cut.bytes(), length), length == 0 ? Status::file_empty : Status::file_truncated)
        << length;
  }
}

TEST(Damage, EveryTruncationThatStatesItsOwnLength) {
  const Bytes file = small_file(1);
  for (size_t length = sizeof(format::Header); length < file.size(); ++length) {
    Bytes cut(file.begin(), file.begin() + ptrdiff_t(length));
    auto header = test::load<format::Header>(cut, 0);
    header.file_bytes = length;
    test::store(cut, 0, header);
    test::fix_checksums(cut);
    const ExactBuffer buffer(cut);
    ASSERT_EQ(status_of(buffer.bytes(), length), Status::damaged_nif) << length;
  }
}

TEST(Damage, EveryByteChanged) {
  const Bytes file = small_file(2);
  for (size_t at = 0; at < file.size(); ++at)
    for (const unsigned flip : {0x01u, 0x80u, 0xffu}) {
      Bytes changed = file;
      changed[at] ^= std::byte(flip);
      const ExactBuffer buffer(changed);
      ASSERT_NE(status_of(buffer.bytes(), at), Status::ok) << "byte " << at;
    }
}

TEST(Damage, EveryByteChangedWithRightChecksums) {
  uint64_t accepted = 0, refused = 0;
  for (uint64_t seed = 3; seed < 5; ++seed) {
    const Bytes file = small_file(seed);
    for (size_t at = 0; at < file.size(); ++at)
      for (const unsigned flip : {0x01u, 0x02u, 0x10u, 0x80u, 0xffu}) {
        Bytes changed = file;
        changed[at] ^= std::byte(flip);
        test::fix_checksums(changed);
        const ExactBuffer buffer(changed);
        ++(status_of(buffer.bytes(), at) == Status::ok ? accepted : refused);
      }
  }
  // Features and weights may change freely; tables may not.
  EXPECT_GT(accepted, 1000u);
  EXPECT_GT(refused, 1000u);
}

TEST(Damage, RandomWordsWithRightChecksums) {
  constexpr uint32_t kWords[] = {0,          1,          3,          4,          64,         127,
                                 512,        513,        0xffff,     0x7fffffff, 0x80000000, 0x7f800000,
                                 0x7fc00000, 0xff800000, 0xfffffff0, 0xffffffff};
  test::Random random(6);
  const Bytes file = small_file(6);
  // The records and tables: everything before the payloads.
  const size_t end = test::section_entry(file, test::find_section(file, format::kData)).offset;
  for (size_t at = 0; at + 4 <= end; at += 4)
    for (const uint32_t word : kWords) {
      Bytes changed = file;
      test::store(changed, at, word);
      if (random.below(2)) test::store(changed, random.below(uint32_t(end / 4)) * 4, word);
      test::fix_checksums(changed);
      const ExactBuffer buffer(changed);
      status_of(buffer.bytes(), at);
    }
}

TEST(Damage, BytesAfterTheEnd) {
  Bytes file = small_file(7);
  file.push_back(std::byte{0});
  EXPECT_EQ(status_of(file, 0), Status::damaged_nif);
  auto header = test::load<format::Header>(file, 0);
  header.file_bytes = file.size();
  test::store(file, 0, header);
  test::fix_checksums(file);
  EXPECT_EQ(status_of(file, 0), Status::damaged_nif);
}

}  // namespace
}  // namespace nif
