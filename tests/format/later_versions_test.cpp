// What a file of a later version may have, and what becomes of it: flags, sections, records and payloads that
// this build does not know; objects that it cannot answer, beside those that it can; levels of detail.
#include <gtest/gtest.h>

#include <functional>

#include "formats/nif/writer.hpp"
#include "tests/format/damaged.hpp"
#include "tests/support/query_object.hpp"

namespace nif::test {
namespace {

using format::ObjectRecord, format::InstanceRecord, format::kNoPart;

const Bytes& good() {
  static const Bytes file = format::encode(random_asset(5, {.objects = 2,
                                                            .instances = 4,
                                                            .max_voxels = 7,
                                                            .bvhs = 1,
                                                            .sphericals = 1,
                                                            .exacts = 1,
                                                            .primaries = 1,
                                                            .colors = 1,
                                                            .sources = 1}));
  return file;
}

/// encode() of what was read: without what this build does not know.
Bytes rewritten(const Bytes& file) {
  return format::encode(format::to_asset(format::read_asset(file, "file")));
}

Bytes with_object(uint32_t index, const std::function<void(ObjectRecord&)>& change) {
  return with_record<ObjectRecord>(good(), format::kObjects, index, change);
}
Bytes with_instance(uint32_t index, const std::function<void(InstanceRecord&)>& change) {
  return with_record<InstanceRecord>(good(), format::kInstances, index, change);
}

Bytes with_header(const std::function<void(format::Header&)>& change) {
  Bytes file = good();
  auto header = load<format::Header>(file, 0);
  change(header);
  store(file, 0, header);
  fix_checksums(file);
  return file;
}

Bytes text(std::string_view words) {
  const auto bytes = std::as_bytes(std::span(words));
  return {bytes.begin(), bytes.end()};
}

TEST(LaterVersions, OldFilesAreUnsupported) {
  Bytes old = good();
  old[5] = std::byte{'1'};
  EXPECT_EQ(outcome_of(old).status, Status::unsupported_nif);
  EXPECT_EQ(
      outcome_of(old).sentence,
      "x.nif: header: format version 1 or an experimental version 2, which are no longer read; bake the "
      "mesh again");
  EXPECT_EQ(outcome_of(std::span(old).first(20)).status, Status::unsupported_nif);
  old[5] = std::byte{'3'};
  old[6] = std::byte{'7'};
  EXPECT_EQ(outcome_of(old).sentence, "x.nif: header: format version 3.7; this build reads version 2.0");
  old[6] = std::byte{'x'};
  EXPECT_EQ(status_of(old), Status::damaged_nif);
}

TEST(LaterVersions, ArithmeticMustBeKnownAndProversNeedNot) {
  for (const uint32_t revision : {0u, format::kArithmetic + 1, 0xffffffffu}) {
    const ReadOutcome outcome = outcome_of(with_header([&](auto& h) { h.arithmetic = revision; }));
    EXPECT_EQ(outcome.status, Status::unsupported_nif);
    EXPECT_EQ(outcome.sentence, "x.nif: header: is to be answered by revision " + std::to_string(revision) +
                                    " of the arithmetic; this build knows revisions 1 to 1");
  }
  for (const uint32_t revision : {0u, format::kProver, format::kProver + 1, 0xffffffffu}) {
    const Bytes file = with_header([&](auto& h) { h.prover = revision; });
    const format::AssetView view = format::read_asset(file, "file");
    EXPECT_EQ(view.prover, revision);
    EXPECT_EQ(view.objects[0].proven, revision != 0);
    EXPECT_EQ(rewritten(file), file);
  }
}

TEST(LaterVersions, FlagsThatMayBeIgnored) {
  const Bytes files[] = {with_header([](auto& h) { h.flags |= 0x10000; }),
                         with_object(0, [](auto& r) { r.flags |= 0xffff0000; }),
                         with_instance(1, [](auto& r) { r.flags |= 0x80000000; })};
  for (const Bytes& file : files) {
    EXPECT_EQ(outcome_of(file).sentence, "");
    EXPECT_EQ(rewritten(file), good());
  }
}

TEST(LaterVersions, FlagsOfInstancesThatMustBeKnown) {
  EXPECT_EQ(status_of(with_instance(1, [](auto& r) { r.flags = format::kDisabled; })), Status::ok);
  for (uint32_t bit = 1; bit < 16; ++bit) {
    const ReadOutcome outcome = outcome_of(with_instance(1, [&](auto& r) { r.flags = 1u << bit; }));
    EXPECT_EQ(outcome.status, Status::unsupported_nif);
    EXPECT_NE(outcome.sentence.find("section INST, record 1"), std::string::npos) << outcome.sentence;
  }
}

TEST(LaterVersions, SectionsAreKeptIfTheySaySo) {
  for (const uint32_t type : {format::fourcc("XTRA"), format::fourcc("mine")}) {  // ours, and a vendor's
    for (const uint32_t flags :
         {0u, uint32_t{format::kKeep}, format::kKeep | format::kPayloads, format::kKeep | 0x40000000u}) {
      std::vector<Part> parts = parts_of(good());
      parts.push_back({type, flags, text("16 bytes, or two"), 8});
      const Bytes file = file_of(good(), parts);
      EXPECT_EQ(outcome_of(file).sentence, "");
      EXPECT_EQ(rewritten(file), flags & format::kKeep ? file : good()) << flags;
    }
    std::vector<Part> parts = parts_of(good());
    parts.push_back({type, format::kRequired | format::kKeep, text("later")});
    EXPECT_EQ(status_of(file_of(good(), parts)), Status::unsupported_nif);
  }
  // In the order of the file, at its end.
  std::vector<Part> parts = parts_of(good()), after = parts;
  const Part two{format::fourcc("TWO2"), format::kKeep, text("2")},
      one{format::fourcc("ONE1"), format::kKeep, text("1")};
  parts.insert(parts.begin(), two);
  parts.insert(parts.begin() + 3, one);
  after.push_back(two);
  after.push_back(one);
  EXPECT_EQ(rewritten(file_of(good(), parts)), file_of(good(), after));
}

/// A section of payloads has no checksum, known or not.
TEST(LaterVersions, SectionsOfPayloadsHaveNoChecksum) {
  std::vector<Part> parts = parts_of(good());
  parts.push_back({format::fourcc("XVAL"), format::kPayloads, text("later")});
  Bytes file = file_of(good(), parts);
  for (const uint32_t type : {uint32_t{format::kData}, format::fourcc("XVAL")}) {
    Bytes wrong = file;
    const uint32_t index = find_section(file, type);
    auto entry = section_entry(file, index);
    entry.crc = 1;
    store_entry(wrong, index, entry);
    auto header = load<format::Header>(wrong, 0);
    header.table_crc = format::crc32c(
        std::span(wrong).subspan(sizeof(header), header.section_count * sizeof(format::SectionEntry)));
    header.header_crc = 0;
    header.header_crc = format::crc32c(std::as_bytes(std::span(&header, 1)));
    store(wrong, 0, header);
    EXPECT_NE(outcome_of(wrong).sentence.find("has a checksum, although"), std::string::npos);
  }
}

/// Bytes of records beyond those that are known are ignored, and dropped.
TEST(LaterVersions, RecordsMayBeLonger) {
  for (const Part& known : parts_of(good())) {
    if (known.record_size == 0) continue;
    SCOPED_TRACE(format::section_name(known.type));
    for (const uint32_t more : {8u, 64u}) {
      std::vector<Part> parts = parts_of(good());
      lengthen_records(section_of(parts, known.type), more, std::byte{0xff});
      const Bytes file = file_of(good(), parts);
      EXPECT_EQ(outcome_of(file).sentence, "");
      EXPECT_EQ(rewritten(file), good());
    }
    // But not shorter, nor of an odd size, nor without one.
    for (const uint32_t size : {known.record_size - 8, known.record_size / 2, 8u, 0u, 4u, 0xfffffff8u}) {
      std::vector<Part> parts = parts_of(good());
      section_of(parts, known.type).record_size = size;
      EXPECT_EQ(status_of(file_of(good(), parts)), Status::damaged_nif) << size;
    }
  }
  std::vector<Part> parts = parts_of(good());
  section_of(parts, format::kNames).record_size = 8;
  section_of(parts, format::kNames).content.resize(64);
  EXPECT_EQ(status_of(file_of(good(), parts)), Status::damaged_nif);
}

/// As an ObjectRecord with a part that came later.
struct GrownRecord {
  static constexpr uint32_t kFirstBytes = 8;
  uint32_t first[2];
  uint32_t later = kNoPart, spare = kNoPart;
};

TEST(LaterVersions, RecordsOfTheFirstVersionStayReadable) {
  const uint32_t words[] = {1, 2, 3, 4, 5, 6, 7, 8};
  const auto read = [&](uint32_t record_size) {
    return format::Records<GrownRecord>(
        {format::fourcc("GROW"), 0, record_size, 0, std::as_bytes(std::span(words))}, "x.nif");
  };
  const auto small = read(8), large = read(16);
  ASSERT_EQ(small.count(), 4u);
  EXPECT_EQ(small[3].first[1], 8u);
  EXPECT_EQ(small[3].later, kNoPart);
  ASSERT_EQ(large.count(), 2u);
  EXPECT_EQ(large[1].first[1], 6u);
  EXPECT_EQ(large[1].spare, 8u);
  EXPECT_THROW(read(4), Error);
  EXPECT_THROW(read(0), Error);
}

/// What lies between payloads, and after them, belongs to something else.
TEST(LaterVersions, PayloadsMayHaveOthersBetween) {
  for (const PayloadKind& kind : payload::kPayloadKinds) {
    std::vector<Part> parts = parts_of(good());
    const Part* records = find_part(parts, kind.records);
    if (!records) continue;
    SCOPED_TRACE(format::section_name(kind.records));
    const Bytes own = payload_of(parts, kind, 0);
    // As if it were longer by three lines, at its front or at its end.
    Bytes longer = own;
    longer.resize(format::aligned(own.size()));
    longer.resize(longer.size() + 192, std::byte{0xa5});
    set_payload(parts, kind, 0, longer);
    Part& changed = section_of(parts, kind.records);
    auto payload = load<format::Payload>(changed.content, kind.at);
    payload.bytes = own.size();
    store(changed.content, kind.at, payload);
    Bytes file = file_of(good(), parts);
    EXPECT_EQ(outcome_of(file).sentence, "");
    EXPECT_EQ(rewritten(file), good());

    longer.assign(192, std::byte{0x5a});
    longer.insert(longer.end(), own.begin(), own.end());
    set_payload(parts, kind, 0, longer);
    payload.offset += 192;
    store(section_of(parts, kind.records).content, kind.at, payload);
    file = file_of(good(), parts);
    EXPECT_EQ(outcome_of(file).sentence, "");
    EXPECT_EQ(rewritten(file), good());
  }
  std::vector<Part> parts = parts_of(good());
  for (const uint32_t type : {uint32_t{format::kData}, uint32_t{format::kColorValues}})
    section_of(parts, type).content.resize(section_of(parts, type).content.size() + 77, std::byte{1});
  EXPECT_EQ(rewritten(file_of(good(), parts)), good());
}

TEST(LaterVersions, PayloadsOutOfPlaceAreRefused) {
  const auto refused = [](const PayloadKind& kind, const std::function<void(format::Payload&)>& change,
                          const std::string& why) {
    std::vector<Part> parts = parts_of(good());
    auto payload = load<format::Payload>(section_of(parts, kind.records).content, kind.at);
    change(payload);
    store(section_of(parts, kind.records).content, kind.at, payload);
    const ReadOutcome outcome = outcome_of(file_of(good(), parts));
    EXPECT_EQ(outcome.status, Status::damaged_nif);
    EXPECT_NE(outcome.sentence.find(why), std::string::npos) << outcome.sentence;
  };
  constexpr const char* kPlace = "does not start at a multiple of 64 after";
  refused(
      payload::kCells, [](auto& p) { p.offset += 8; }, kPlace);
  refused(
      payload::kCells, [](auto& p) { p.offset -= 64; }, kPlace);
  refused(
      payload::kCells, [](auto& p) { p.offset = 0; }, kPlace);
  refused(
      payload::kTree, [](auto& p) { p.offset = ~uint64_t{63}; }, "past the end");
  refused(
      payload::kTree, [](auto& p) { p.offset = uint64_t{1} << 63; }, "past the end");
  refused(
      payload::kTree, [](auto& p) { p.bytes = ~uint64_t{0}; }, "bytes, not");
  refused(
      payload::kCells, [](auto& p) { p.reserved = 1; }, "reserved");
  // Of a wrong checksum, also of an empty payload.
  for (const bool empty : {false, true}) {
    Bytes file = format::encode(random_asset(5, {.objects = 1, .max_voxels = 7, .coded = kCodedAll}));
    const auto records = section_entry(file, find_section(file, format::kNetworks));
    const size_t at = records.offset + (empty ? payload::kCorners : payload::kFeatures).at;
    auto payload = load<format::Payload>(file, at);
    ASSERT_EQ(payload.bytes == 0, empty);
    fix_checksums(file);
    payload.crc ^= 1;
    store(file, at, payload);
    auto entry = section_entry(file, find_section(file, format::kNetworks));
    entry.crc = format::crc32c(std::span(file).subspan(entry.offset, entry.bytes));
    store_entry(file, find_section(file, format::kNetworks), entry);
    auto header = load<format::Header>(file, 0);
    header.table_crc = format::crc32c(
        std::span(file).subspan(sizeof(header), header.section_count * sizeof(format::SectionEntry)));
    header.header_crc = 0;
    header.header_crc = format::crc32c(std::as_bytes(std::span(&header, 1)));
    store(file, 0, header);
    EXPECT_NE(outcome_of(file).sentence.find("payload has a wrong checksum"), std::string::npos)
        << outcome_of(file).sentence;
  }
}

TEST(LaterVersions, PaddingOfPayloadsIsZero) {
  Bytes file = good();
  const size_t cells = payload_at(file, payload::kCells, 0), corners = payload_at(file, payload::kCorners, 0);
  const auto bytes =
      load<format::PlanesRecord>(file, section_entry(file, find_section(file, format::kPlanes)).offset)
          .cells.bytes;
  ASSERT_LT(cells + bytes, corners);
  file[corners - 1] = std::byte{1};
  EXPECT_EQ(status_of(file), Status::damaged_nif);
}

/// An object that this build cannot answer does not keep others from being read.
TEST(LaterVersions, ObjectsMayBeUnsupported) {
  const format::AssetView whole = format::read_asset(good(), "file");
  struct Change {
    const char* why;
    std::function<void(ObjectRecord&)> change;
  };
  const Change changes[] = {
      {"deforms, which this build does not know", [](auto& r) { r.flags = format::kDeforms; }},
      {"has flags that this build does not know", [](auto& r) { r.flags = 0x8000; }}};
  for (uint32_t index = 0; index < whole.objects.size(); ++index)
    for (const auto& [why, change] : changes) {
      const Bytes file = with_object(index, change);
      ASSERT_EQ(outcome_of(file).sentence, "") << index;
      const format::AssetView view = format::read_asset(file, "file");
      Random random(index);
      for (uint32_t i = 0; i < view.objects.size(); ++i) {
        const format::ObjectView& object = view.objects[i];
        EXPECT_EQ(object.name, whole.objects[i].name);
        EXPECT_EQ(object.aabb_min, whole.objects[i].aabb_min);
        if (i == index) {
          EXPECT_STREQ(object.unsupported, why);
          EXPECT_FALSE(object.planes || object.triangles || object.network || object.spherical);
          EXPECT_EQ(view.colors_of(i), nullptr);
          continue;
        }
        ASSERT_EQ(object.unsupported, nullptr);
        for (int ray = 0; ray < 50; ++ray) {
          const kernels::Segment segment = random_segment(random, object);
          EXPECT_EQ(query_object(object, segment).logit, query_object(whole.objects[i], segment).logit);
        }
      }
      EXPECT_EQ(view.instances.size(), whole.instances.size());
      try {
        format::to_asset(view);
        ADD_FAILURE() << "written without it";
      } catch (const Error& error) {
        EXPECT_EQ(error.status(), Status::unsupported_nif);
      }
    }
}

/// Parts that mean nothing together, as far as this build knows; and none.
TEST(LaterVersions, PartsMayBelongTogetherLater) {
  const format::Asset asset = random_asset(7, {.objects = 1, .instances = 0, .max_voxels = 5, .bvhs = 2});
  // The first object takes the second one's triangles.
  Bytes file =
      with_record<ObjectRecord>(format::encode(asset), format::kObjects, 0, [](auto& r) { r.triangles = 0; });
  file = with_record<ObjectRecord>(file, format::kObjects, 1, [](auto& r) { r.triangles = kNoPart; });
  const format::AssetView view = format::read_asset(file, "file");
  for (const uint32_t i : {0, 1})
    EXPECT_STREQ(view.objects[i].unsupported, "has parts that this build does not read together");
  ASSERT_EQ(view.objects[2].unsupported, nullptr);
  EXPECT_EQ(format::to_data(*view.objects[2].triangles).vertices, asset.objects[2].triangles->vertices);
  // Their records count, so the third object's is the second.
  EXPECT_EQ(status_of(with_record<ObjectRecord>(file, format::kObjects, 2, [](auto& r) { r.triangles = 0; })),
            Status::damaged_nif);
  EXPECT_EQ(status_of(with_record<ObjectRecord>(file, format::kObjects, 0, [](auto& r) { r.triangles = 1; })),
            Status::damaged_nif);
  // We write none.
  format::Asset odd = asset;
  odd.objects[0].triangles = odd.objects[1].triangles;
  EXPECT_THROW(format::encode(odd), Error);
}

TEST(LaterVersions, LevelsCountDown) {
  format::Asset asset = random_asset(9, {.objects = 0, .instances = 1, .bvhs = 5});
  asset.instances[0].object = 2;
  const auto status = [&](std::initializer_list<uint32_t> levels) {
    Bytes file = format::encode(random_asset(9, {.objects = 0, .instances = 0, .bvhs = 5}));
    uint32_t i = 0;
    for (const uint32_t level : levels)
      file = with_record<ObjectRecord>(file, format::kObjects, i++, [&](auto& r) { r.level = level; });
    return status_of(file);
  };
  EXPECT_EQ(status({0, 0, 0, 0, 0}), Status::ok);
  EXPECT_EQ(status({2, 1, 0, 1, 0}), Status::ok);
  EXPECT_EQ(status({4, 3, 2, 1, 0}), Status::ok);
  EXPECT_EQ(status({0, 0, 0, 0, 1}), Status::damaged_nif) << "of no finer one";
  EXPECT_EQ(status({2, 0, 0, 0, 0}), Status::damaged_nif);
  EXPECT_EQ(status({1, 2, 1, 0, 0}), Status::damaged_nif);
  EXPECT_EQ(status({1, 1, 0, 0, 0}), Status::damaged_nif);
  EXPECT_EQ(status({16, 15, 14, 13, 12}), Status::damaged_nif);
  EXPECT_EQ(status({0xffffffff, 0, 0, 0, 0}), Status::damaged_nif);

  asset.objects[1].level = 1;
  asset.objects[1].error = 0.5f;
  const Bytes file = format::encode(asset);
  EXPECT_EQ(rewritten(file), file);
  const format::AssetView view = format::read_asset(file, "file");
  EXPECT_EQ(view.objects[1].level, 1u);
  EXPECT_EQ(view.objects[1].error, 0.5f);
  EXPECT_EQ(
      status_of(with_record<InstanceRecord>(file, format::kInstances, 0, [](auto& r) { r.object = 1; })),
      Status::damaged_nif)
      << "a coarser level is placed";
  for (const float wrong : {-1.0f, INFINITY, NAN})
    EXPECT_EQ(
        status_of(with_record<ObjectRecord>(file, format::kObjects, 1, [&](auto& r) { r.error = wrong; })),
        Status::damaged_nif);
  // Without instances, the finest are placed.
  asset.instances.clear();
  const Bytes alone = format::encode(asset);
  std::vector<uint32_t> placed;
  format::read_asset(alone, "file").for_each_placed([&](uint32_t object, const auto*) {
    placed.push_back(object);
  });
  EXPECT_EQ(placed, (std::vector<uint32_t>{0, 2, 3, 4}));
  EXPECT_EQ(format::read_asset(alone, "file").placed_count(), 4u);
}

TEST(LaterVersions, InstancesKeepTheirSettings) {
  const format::Asset asset =
      random_asset(3, {.objects = 1, .instances = 30, .max_voxels = 4, .settings = true});
  const Bytes file = format::encode(asset);
  const format::AssetView view = format::read_asset(file, "file");
  uint32_t with[4] = {};
  for (size_t i = 0; i < asset.instances.size(); ++i) {
    const format::Instance& wanted = asset.instances[i];
    const format::InstanceView& seen = view.instances[i];
    EXPECT_EQ(seen.mask, wanted.mask);
    EXPECT_EQ(seen.flags, wanted.flags);
    EXPECT_EQ(seen.user, wanted.user);
    EXPECT_EQ(seen.parent, wanted.parent);
    with[0] += wanted.mask != 0xffffffff;
    with[1] += wanted.flags != 0;
    with[2] += wanted.user > 0xffffffff;
    with[3] += wanted.parent != format::kNoParent;
  }
  for (const uint32_t count : with) EXPECT_GT(count, 2u);
  EXPECT_EQ(rewritten(file), file);
  for (const uint32_t parent : {1u, 2u, 30u, 0xfffffffeu})
    EXPECT_EQ(status_of(with_record<InstanceRecord>(file, format::kInstances, 1,
                                                    [&](auto& r) { r.parent = parent; })),
              Status::damaged_nif);
}

/// Numbers of every kind and width, and of kinds that come later.
TEST(LaterVersions, NumbersOfAllKinds) {
  uint32_t kinds[5] = {}, any = 0;
  for (uint64_t seed = 0; seed < 30; ++seed) {
    const format::Asset asset = random_asset(seed, {.objects = 0,
                                                    .instances = 1,
                                                    .max_voxels = 5,
                                                    .bvhs = 1,
                                                    .exacts = 1,
                                                    .sources = 1,
                                                    .numbers = true});
    const Bytes file = format::encode(asset);
    EXPECT_EQ(rewritten(file), file);
    const format::AssetView view = format::read_asset(file, "file");
    for (uint32_t object = 0; object < 2; ++object)
      for (const auto& [kind, numbers] : asset.objects[object].numbers) {
        const format::NumbersView* seen = view.numbers_of(object, format::NumbersKind(kind));
        ASSERT_NE(seen, nullptr);
        EXPECT_EQ(format::to_numbers(*seen).values, numbers.values);
        ++kinds[kind];
        any += numbers.below == 0;
      }
    if (view.numbers.size() < 2) continue;
    const auto changed = [&](uint32_t index, const std::function<void(format::NumbersRecord&)>& change) {
      return with_record<format::NumbersRecord>(file, format::kNumbersRecords, index, change);
    };
    const auto last = uint32_t(view.numbers.size()) - 1;
    const Bytes later = changed(last, [](auto& r) { r.kind = 5; });
    EXPECT_EQ(format::read_asset(later, "file").numbers.size(), last) << "skipped";
    EXPECT_EQ(status_of(changed(0, [](auto& r) { r.kind = 0xffffffff; })),
              view.numbers[0].object == view.numbers[1].object ? Status::damaged_nif : Status::ok);
    EXPECT_EQ(status_of(changed(1, [](auto& r) { r.object = 0, r.kind = 0; })), Status::damaged_nif);
  }
  for (uint32_t kind = 1; kind <= 4; ++kind) EXPECT_GT(kinds[kind], 5u);
  EXPECT_GT(any, 0u);
}

}  // namespace
}  // namespace nif::test
