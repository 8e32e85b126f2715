// Golden files, cut at every length, with every bit turned over, and with bytes behind their end: each is
// refused against its checksums, and with these made right it is refused or answers rays. All lie in blocks
// of exactly their length, so that the address sanitizer sees every byte that is read beyond, and the memory
// that reading takes is counted.
#include <gtest/gtest.h>

#include <cinttypes>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "formats/nif/writer.hpp"
#include "tests/format/damaged.hpp"
#include "tests/support/query_object.hpp"
#include "tests/support/test_meter.hpp"

namespace nif {
namespace {

using test::Bytes, test::ExactBuffer;

struct Golden {
  std::string name;
  Bytes bytes;
};
const std::vector<Golden>& golden_files() {
  static const std::vector<Golden> files = [] {
    std::vector<Golden> found;
    for (const auto& entry : std::filesystem::directory_iterator(NIF_GOLDEN_FOLDER)) {
      if (entry.path().extension() != ".nif") continue;
      std::ifstream stream(entry.path(), std::ios::binary);
      const std::string text{std::istreambuf_iterator<char>(stream), {}};
      const auto bytes = std::as_bytes(std::span(text));
      found.push_back({entry.path().stem().string(), {bytes.begin(), bytes.end()}});
    }
    return found;
  }();
  return files;
}

/// Results of reading damaged files.
struct Tally {
  uint64_t refused = 0, accepted = 0;

  /// Reads a file and, if it is accepted, queries one of its objects.
  Status read(std::span<const std::byte> file, uint64_t seed) {
    const ExactBuffer buffer(file);
    test::Meter meter;
    const Status status = status_of(buffer.bytes(), seed, meter);
    // docs/format.md: payloads that are coded decode to at most 16 times what they take, and a line more for
    // each of three; views of objects, networks and instances take less than the file has of them in records.
    EXPECT_LE(meter.most(), 18 * file.size() + (16 << 10));
    ++(status == Status::ok ? accepted : refused);
    return status;
  }

  /// For docs/results/trust.sh, which adds up such lines.
  void print(const char* checksums) const {
    std::printf("  %s checksums: %" PRIu64 " damaged files refused, %" PRIu64 " accepted\n", checksums,
                refused, accepted);
  }

 private:
  static Status status_of(std::span<const std::byte> bytes, uint64_t seed, test::Meter& meter) {
    try {
      const format::AssetView view = format::read_asset(bytes, "file", &meter);
      // One object per file: querying all would take ten times as long as reading.
      test::Random random(seed);
      const format::ObjectView& object = view.objects[seed % view.objects.size()];
      test::query_object(object, test::random_segment(random, object));
      if (view.primaries.empty()) return Status::ok;
      const kernels::PrimaryField& primary = view.primaries[seed % view.primaries.size()].field;
      kernels::query_primary(primary, test::random_segment(random, primary));
      return Status::ok;
    } catch (const Error& error) {
      EXPECT_TRUE(std::string_view(error.what()).starts_with("file: ")) << error.what();
      EXPECT_NE(error.status(), Status::internal) << error.what();
      return error.status();
    }
  }
};

/// Sets the length in the header to that of the file.
Bytes stating_its_length(Bytes file) {
  if (file.size() < sizeof(format::Header)) return file;
  auto header = test::load<format::Header>(file, 0);
  header.file_bytes = file.size();
  test::store(file, 0, header);
  test::fix_checksums(file);
  return file;
}

TEST(GoldenDamage, EveryPrefix) {
  Tally tally;
  for (const Golden& file : golden_files())
    for (size_t length = 0; length < file.bytes.size(); ++length) {
      const auto cut = std::span(file.bytes).first(length);
      ASSERT_EQ(tally.read(cut, length), length == 0 ? Status::file_empty : Status::file_truncated)
          << file.name << ' ' << length;
    }
  EXPECT_GT(tally.refused, 50'000u);
  tally.print("wrong");
}

TEST(GoldenDamage, EveryPrefixThatStatesItsOwnLength) {
  Tally tally;
  for (const Golden& file : golden_files())
    for (size_t length = sizeof(format::Header); length < file.bytes.size(); length += 3) {
      const Bytes cut = stating_its_length({file.bytes.begin(), file.bytes.begin() + ptrdiff_t(length)});
      ASSERT_EQ(tally.read(cut, length), Status::damaged_nif) << file.name << ' ' << length;
    }
  EXPECT_GT(tally.refused, 20'000u);
  tally.print("right");
}

/// Flips every `step`-th bit of the first `end` bytes of a file.
void turn_bits(const Golden& file, size_t end, size_t step, Tally& as_they_are, Tally& fixed) {
  for (size_t bit = 0; bit < 8 * end; bit += step) {
    Bytes changed = file.bytes;
    changed[bit / 8] ^= std::byte(1u << bit % 8);
    ASSERT_NE(as_they_are.read(changed, bit), Status::ok) << file.name << ", bit " << bit;
    test::fix_checksums(changed);
    fixed.read(changed, bit);
  }
}

/// The start of the first payload. Before it are the header, section table, metadata and records.
size_t end_of_tables(const Bytes& file) {
  return test::section_entry(file, test::find_section(file, format::kInstances)).offset;
}

/// The short test: every fifth bit of headers, section tables and objects, and every 401st of the rest.
TEST(GoldenDamage, BitsOfHeadersAndTables) {
  Tally as_they_are, fixed;
  for (const Golden& file : golden_files()) {
    turn_bits(file, end_of_tables(file.bytes), 5, as_they_are, fixed);
    turn_bits(file, file.bytes.size(), 401, as_they_are, fixed);
  }
  EXPECT_EQ(as_they_are.accepted, 0u);
  EXPECT_GT(as_they_are.refused, 10'000u);
  // Numbers of a model may change freely; the tables that locate them may not.
  EXPECT_GT(fixed.refused, 2'000u);
  EXPECT_GT(fixed.accepted, 200u);
  as_they_are.print("wrong");
  fixed.print("right");
}

/// With sanitizers, which are many times slower, every eleventh.
TEST(GoldenDamage, EveryBit) {
#ifdef NIF_SANITIZED
  constexpr size_t kStep = 11;
#else
  constexpr size_t kStep = 1;
#endif
  Tally as_they_are, fixed;
  for (const Golden& file : golden_files()) turn_bits(file, file.bytes.size(), kStep, as_they_are, fixed);
  EXPECT_EQ(as_they_are.accepted, 0u);
  EXPECT_GT(as_they_are.refused, 500'000u / kStep);
  EXPECT_GT(fixed.refused, 50'000u / kStep);
  EXPECT_GT(fixed.accepted, 50'000u / kStep);
  as_they_are.print("wrong");
  fixed.print("right");
}

TEST(GoldenDamage, BytesBehindTheEnd) {
  Tally tally;
  for (const Golden& file : golden_files())
    for (const size_t more : {1, 2, 3, 4, 7, 8, 16, 32, 63, 64, 65, 128, 4096})
      for (const unsigned value : {0u, 1u, 0xffu}) {
        Bytes longer = file.bytes;
        longer.resize(longer.size() + more, std::byte(value));
        ASSERT_EQ(tally.read(longer, more), Status::damaged_nif) << file.name << ' ' << more;
        ASSERT_EQ(tally.read(stating_its_length(longer), more), Status::damaged_nif)
            << file.name << ' ' << more;
      }
}

}  // namespace
}  // namespace nif
