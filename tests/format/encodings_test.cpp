// What holds for every part of the list alike: which sections a file has, and which record is whose.
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
  static const Bytes file = format::encode(test::random_asset(31, {.objects = 2,
                                                                   .max_voxels = 9,
                                                                   .bvhs = 2,
                                                                   .sphericals = 2,
                                                                   .exacts = 2,
                                                                   .proofs = 2,
                                                                   .cutouts = 2,
                                                                   .primaries = 1}));
  return file;
}

Part& part_of(std::vector<Part>& parts, uint32_t type) {
  return *std::find_if(parts.begin(), parts.end(), [&](const Part& part) { return part.type == type; });
}

void expect_damaged(const Bytes& file, const std::string& words) {
  const ReadOutcome outcome = outcome_of(file);
  EXPECT_EQ(outcome.status, Status::damaged_nif);
  EXPECT_NE(outcome.sentence.find(words), std::string::npos) << outcome.sentence << " and not " << words;
}

/// Calls test(part, numbers of the objects in mixed() with this part).
template <class Test>
void for_each_part(const Test& test) {
  const format::AssetView view = format::read_asset(mixed(), "good");
  format::for_each_part([&](auto part) {
    std::vector<uint32_t> having;
    for (uint32_t i = 0; i < view.objects.size(); ++i)
      if (part.of(view.objects[i])) having.push_back(i);
    SCOPED_TRACE(part.kName);
    test(part, having);
  });
}

TEST(Encodings, AreNumberedOnceAndNamed) {
  std::vector<uint32_t> numbers,
      sections{format::kMetadata, format::kObjects, format::kInstances, format::kNames, format::kData};
  format::for_each_optional([&](auto kind) {
    sections.push_back(kind.kRecords);
    sections.push_back(kind.kValues);
  });
  std::vector<std::string> names;
  for (const kernels::EncodingName& encoding : kernels::kEncodings) {
    numbers.push_back(encoding.number);
    names.push_back(encoding.name);
  }
  format::for_each_part([&](auto part) {
    for (const uint32_t type : test::sections_of(part)) sections.push_back(type);
  });
  const auto all_different = [](auto values) {
    std::sort(values.begin(), values.end());
    return std::adjacent_find(values.begin(), values.end()) == values.end();
  };
  EXPECT_TRUE(all_different(numbers));
  EXPECT_TRUE(all_different(names));
  EXPECT_TRUE(all_different(sections));
  uint32_t flags = format::kDeforms;  // those of parts that came later are different, too
  format::for_each_part([&](auto part) {
    EXPECT_EQ(flags & format::flag_of(part), 0u) << part.kName;
    flags |= format::flag_of(part);
  });
  EXPECT_EQ(std::count(numbers.begin(), numbers.end(), 0u), 0);
}

TEST(Encodings, SectionsAreThereForObjects) {
  ASSERT_EQ(outcome_of(mixed()).sentence, "");
  for_each_part([](auto part, const auto&) {
    for (const uint32_t type : test::sections_of(part)) {
      std::vector<Part> parts = test::parts_of(mixed());
      std::erase_if(parts, [&](const Part& part) { return part.type == type; });
      expect_damaged(test::file_of(mixed(), parts), "section " + format::section_name(type) + ": is missing");
      // An empty one is refused, too.
      parts = test::parts_of(mixed());
      part_of(parts, type).content.clear();
      EXPECT_EQ(outcome_of(test::file_of(mixed(), parts)).status, Status::damaged_nif)
          << format::section_name(type);
    }
  });
}

TEST(Encodings, SectionsAreNotThereForNoObject) {
  for_each_part([&](auto part, const auto&) {
    format::Asset others = format::to_asset(format::read_asset(mixed(), "good"));
    std::erase_if(others.objects, [&](const auto& object) { return part.of(object).has_value(); });
    others.instances.clear();
    const Bytes file = format::encode(others);
    ASSERT_EQ(outcome_of(file).sentence, "");
    for (const uint32_t type : test::sections_of(part))
      for (const size_t bytes : {0, 64}) {
        std::vector<Part> parts = test::parts_of(file);
        parts.push_back({type, format::known_section(type)->flags, Bytes(bytes)});
        expect_damaged(test::file_of(file, parts),
                       "section " + format::section_name(type) + ": is there for no object");
      }
  });
}

TEST(Encodings, RecordsGoWithTheirObjects) {
  for_each_part([](auto part, const std::vector<uint32_t>& having) {
    const uint32_t records = part.kRecords;
    const std::string section = "section " + format::section_name(records);
    ASSERT_GE(having.size(), 2u);
    // Two objects with swapped records, and a record that does not exist.
    for (const auto& [object, record] : {std::pair{having[1], 0u}, {having[0], 1u}, {having[1], 99u}}) {
      const Bytes file = test::with_record<ObjectRecord>(
          mixed(), format::kObjects, object, [&, record = record](auto& r) { part.of(r) = record; });
      expect_damaged(file, "section OBJS, record " + std::to_string(object) +
                               ": a part is not the number of objects that have one before it");
    }
    // One record fewer, and one more.
    std::vector<Part> parts = test::parts_of(mixed());
    Bytes& content = part_of(parts, records).content;
    const Bytes before = content;
    const size_t record = part_of(parts, records).record_size;
    content.resize(before.size() - record);
    expect_damaged(test::file_of(mixed(), parts), "a part has no such record");
    content = before;
    content.insert(content.end(), before.begin(), before.begin() + ptrdiff_t(record));
    expect_damaged(test::file_of(mixed(), parts), section + ": has records that belong to no object");
    content.resize(before.size() + 4);
    expect_damaged(test::file_of(mixed(), parts), section + " (entry ");
  });
}

/// Objects in another order are another file, with records in that order.
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
    options.cutouts = uint32_t(seed / 7 % 3);
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
