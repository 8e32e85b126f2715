// What holds for every encoding of the list alike: which sections a file has, and which record is whose.
#include "formats/nif/parts.hpp"

#include <gtest/gtest.h>

#include "formats/nif/writer.hpp"
#include "tests/format/damaged.hpp"
#include "tests/support/query_object.hpp"

namespace nif {
namespace {

using format::ObjectRecord;
using test::Bytes, test::ReadOutcome, test::outcome_of, test::Part;

/// Two objects of each encoding.
const Bytes& mixed() {
  static const Bytes file = format::encode(test::random_asset(
      31,
      {.objects = 2, .max_voxels = 9, .bvhs = 2, .sphericals = 2, .exacts = 2, .proofs = 2, .primaries = 1}));
  return file;
}

Part& part_of(std::vector<Part>& parts, uint32_t type) {
  return *std::find_if(parts.begin(), parts.end(), [&](const Part& part) { return part.type == type; });
}

/// The file with objects that are these of its own, told by their numbers.
Bytes with_objects(const std::vector<uint32_t>& numbers) {
  std::vector<Part> parts = test::parts_of(mixed());
  Bytes& records = part_of(parts, format::kObjects).content;
  const Bytes before = records;
  records.clear();
  for (const uint32_t number : numbers) {
    const auto* at = before.data() + number * sizeof(ObjectRecord);
    records.insert(records.end(), at, at + sizeof(ObjectRecord));
  }
  return test::file_of(mixed(), parts);
}

void expect_damaged(const Bytes& file, const std::string& words) {
  const ReadOutcome outcome = outcome_of(file);
  EXPECT_EQ(outcome.status, Status::damaged_nif);
  EXPECT_NE(outcome.sentence.find(words), std::string::npos) << outcome.sentence << " and not " << words;
}

/// Calls test(encoding, the number of its first object in mixed()).
template <class Test>
void for_each_pair(const Test& test) {
  const format::AssetView view = format::read_asset(mixed(), "good");
  format::for_each_encoding([&](auto encoding) {
    uint32_t first = 0;
    while (format::encoding_of(view.objects[first]).number != encoding.kNumber) ++first;
    SCOPED_TRACE(encoding.kName);
    test(encoding, first);
  });
}

TEST(Encodings, AreNumberedOnceAndNamed) {
  std::vector<uint32_t> numbers,
      sections{format::kMetadata,     format::kObjects,       format::kInstances,     format::kNames,
               format::kPrimaries,    format::kPrimaryValues, format::kSourceRecords, format::kSourceNumbers,
               format::kColorRecords, format::kColorValues};
  std::vector<std::string> names;
  format::for_each_encoding([&](auto encoding) {
    numbers.push_back(encoding.kNumber);
    names.push_back(encoding.kName);
    for (const uint32_t type : encoding.kSections) sections.push_back(type);
  });
  const auto all_different = [](auto values) {
    std::sort(values.begin(), values.end());
    return std::adjacent_find(values.begin(), values.end()) == values.end();
  };
  EXPECT_TRUE(all_different(numbers));
  EXPECT_TRUE(all_different(names));
  EXPECT_TRUE(all_different(sections));
  EXPECT_EQ(std::count(numbers.begin(), numbers.end(), 0u), 0);
}

TEST(Encodings, SectionsAreThereForObjects) {
  ASSERT_EQ(outcome_of(mixed()).sentence, "");
  for_each_pair([](auto encoding, uint32_t) {
    for (const uint32_t type : encoding.kSections) {
      std::vector<Part> parts = test::parts_of(mixed());
      std::erase_if(parts, [&](const Part& part) { return part.type == type; });
      expect_damaged(test::file_of(mixed(), parts), "section " + format::section_name(type) + ": is missing");
      // An empty one does not do either.
      parts = test::parts_of(mixed());
      part_of(parts, type).content.clear();
      EXPECT_EQ(outcome_of(test::file_of(mixed(), parts)).status, Status::damaged_nif)
          << format::section_name(type);
    }
  });
}

TEST(Encodings, SectionsAreNotThereForNoObject) {
  for_each_pair([&](auto encoding, uint32_t) {
    test::RandomAssetOptions others{
        .objects = 1, .instances = 0, .bvhs = 1, .sphericals = 1, .exacts = 1, .proofs = 1};
    for (const auto& [number, count] :
         {std::pair(1u, &others.objects), std::pair(2u, &others.sphericals), std::pair(3u, &others.bvhs),
          std::pair(4u, &others.exacts), std::pair(5u, &others.proofs)})
      if (number == encoding.kNumber) *count = 0;
    const Bytes file = format::encode(test::random_asset(1, others));
    ASSERT_EQ(outcome_of(file).sentence, "");
    for (const uint32_t type : encoding.kSections)
      for (const size_t bytes : {0, 64}) {
        std::vector<Part> parts = test::parts_of(file);
        parts.push_back({type, format::kRequired, Bytes(bytes)});
        expect_damaged(test::file_of(file, parts),
                       "section " + format::section_name(type) + ": is there for no object");
      }
  });
}

TEST(Encodings, RecordsGoWithTheirObjects) {
  for_each_pair([](auto encoding, uint32_t first) {
    const uint32_t records = encoding.kSections[0];
    const std::string section = "section " + format::section_name(records);
    // The first's record for the second, the second's for the first, and one that is not there.
    for (const auto& [object, record] : {std::pair{first + 1, 0u}, {first, 1u}, {first + 1, 2u}}) {
      const Bytes file = test::with_record<ObjectRecord>(mixed(), format::kObjects, object,
                                                         [record = record](auto& r) { r.record = record; });
      expect_damaged(file, "section OBJS, record " + std::to_string(object) +
                               ": record is not the number of objects of its encoding before it");
    }
    // One record less, and one more.
    std::vector<Part> parts = test::parts_of(mixed());
    Bytes& content = part_of(parts, records).content;
    const Bytes before = content;
    content.resize(before.size() / 2);
    expect_damaged(test::file_of(mixed(), parts), "its encoding has no such record");
    content = before;
    content.insert(content.end(), before.begin(), before.begin() + ptrdiff_t(before.size() / 2));
    expect_damaged(test::file_of(mixed(), parts), section + ": has records that belong to no object");
    content.resize(before.size() + 4);
    expect_damaged(test::file_of(mixed(), parts), section + ": ");
  });
}

TEST(Encodings, AreThoseThatAreKnown) {
  const auto with_encoding = [](uint32_t number) {
    return outcome_of(
        test::with_record<ObjectRecord>(mixed(), format::kObjects, 1, [&](auto& r) { r.encoding = number; }));
  };
  for (const uint32_t number : {0u, 6u, 256u, 0xffffffffu}) {
    const ReadOutcome outcome = with_encoding(number);
    EXPECT_EQ(outcome.status, Status::unsupported_nif);
    EXPECT_EQ(outcome.sentence,
              "x.nif: section OBJS, record 1: encoding " + std::to_string(number) +
                  "; this build reads 1 (segment), 2 (spherical), 3 (bvh), 4 (exact) and 5 (proof)");
  }
  // A file in nothing but an encoding of a later version is not damaged.
  std::vector<Part> parts = test::parts_of(with_objects({0}));
  auto record = test::load<ObjectRecord>(part_of(parts, format::kObjects).content, 0);
  record.encoding = 9;
  test::store(part_of(parts, format::kObjects).content, 0, record);
  EXPECT_EQ(outcome_of(test::file_of(mixed(), parts)).status, Status::unsupported_nif);
}

/// Another order of the same objects is another file, with other records first.
TEST(Encodings, MayComeInAnyOrder) {
  format::Asset asset = format::to_asset(format::read_asset(mixed(), "good"));
  std::swap(asset.objects[0], asset.objects[5]);
  std::swap(asset.objects[1], asset.objects[2]);
  const Bytes file = format::encode(asset);
  const format::AssetView view = format::read_asset(file, "file"),
                          before = format::read_asset(mixed(), "good");
  const size_t places[] = {5, 2, 1, 3, 4, 0};
  test::Random random(1);
  for (size_t i = 0; i < 6; ++i) {
    ASSERT_EQ(view.objects[i].name, before.objects[places[i]].name);
    for (int ray = 0; ray < 200; ++ray) {
      const kernels::Segment segment = test::random_segment(random, view.objects[i]);
      ASSERT_EQ(test::query_object(view.objects[i], segment).logit,
                test::query_object(before.objects[places[i]], segment).logit);
    }
  }
}

TEST(Encodings, SizesAreKnownWithoutWriting) {
  for (uint64_t seed = 0; seed < 200; ++seed) {
    test::RandomAssetOptions options;
    options.objects = uint32_t(seed % 4);
    options.instances = uint32_t(seed % 3);
    options.max_voxels = 1 + uint32_t(seed % 15);
    options.bvhs = uint32_t(seed / 2 % 3);
    options.sphericals = uint32_t(seed / 3 % 4);
    options.primaries = uint32_t(seed / 5 % 4);
    if (options.objects + options.bvhs + options.sphericals == 0) options.objects = 1;
    format::Asset asset = test::random_asset(seed, options);
    if (seed % 2 == 0) asset.metadata.clear();
    if (seed % 5 == 0) asset.objects[0].name.clear();
    ASSERT_EQ(format::encoded_bytes(asset), format::encode(asset).size()) << "seed " << seed;
  }
}

}  // namespace
}  // namespace nif
