// Coded payloads of `segment` objects: what is read is what was written, there is one coded form of it, and
// bytes that are none are refused before they take memory.
#include <gtest/gtest.h>

#include <algorithm>

#include "formats/nif/writer.hpp"
#include "tests/format/damaged.hpp"
#include "tests/support/meter.hpp"
#include "tests/support/query_object.hpp"

namespace nif {
namespace {

using format::SegmentData, format::SegmentRecord, format::SegmentView;
using test::Bytes;

/// With what is coded by the bits of the seed, and odd corners in every second one of two.
format::Asset coded_asset(uint64_t seed, uint32_t objects = 2, uint32_t max_voxels = 14) {
  test::RandomAssetOptions options;
  options.objects = objects;
  options.instances = 1;
  options.max_voxels = max_voxels;
  options.coded = 1 + uint32_t(seed % format::kCodedPayloads);
  options.odd_corners = seed / 2 % 2 == 0;
  return test::random_asset(seed, options);
}

uint32_t forms_of(const Bytes& file, uint32_t object) {
  const auto entry = test::section_entry(file, test::find_section(file, format::kSegments));
  return test::load<SegmentRecord>(file, entry.offset + object * sizeof(SegmentRecord)).forms;
}

bool operator==(const kernels::BrickStates& a, const kernels::BrickStates& b) {
  return a.surface == b.surface && a.aux == b.aux;
}

void expect_same(const SegmentData& a, const SegmentData& b) {
  EXPECT_EQ(a.brick_table, b.brick_table);
  EXPECT_TRUE(std::ranges::equal(a.brick_states, b.brick_states,
                                 [](const auto& one, const auto& other) { return one == other; }));
  EXPECT_EQ(a.brick_corners, b.brick_corners);
  EXPECT_EQ(a.corner_base, b.corner_base);
  EXPECT_EQ(a.voxel_base, b.voxel_base);
  EXPECT_EQ(a.voxel_records, b.voxel_records);
  EXPECT_EQ(a.parts, b.parts);
  EXPECT_EQ(a.features, b.features);
}

TEST(Coded, IsReadAsItWasWritten) {
  size_t with[5] = {}, smaller = 0, files = 0;  // [bit of PayloadForm]
  for (uint64_t seed = 0; seed < 84; ++seed) {
    SCOPED_TRACE(seed);
    format::Asset asset = coded_asset(seed);
    const Bytes file = format::encode(asset);
    EXPECT_EQ(format::encoded_bytes(asset), file.size());
    const format::Asset again = format::to_asset(format::read_asset(file, "coded"));
    EXPECT_EQ(format::encode(again), file);
    for (uint32_t i = 0; i < asset.objects.size(); ++i) {
      expect_same(again.objects[i].as<SegmentData>(), asset.objects[i].as<SegmentData>());
      const uint32_t forms = forms_of(file, i);
      EXPECT_EQ(forms & format::kCodedPayloads & ~asset.objects[i].as<SegmentData>().coded, 0u);
      for (uint32_t bit = 0; bit < 5; ++bit) with[bit] += forms >> bit & 1;
    }
    for (format::Object& object : asset.objects) object.as<SegmentData>().coded = 0;
    const Bytes uncoded = format::encode(asset);
    EXPECT_EQ(forms_of(uncoded, 0), 0u);
    smaller += file.size() < uncoded.size();
    ++files;
    const format::AssetView one = format::read_asset(file, "coded"), other = format::read_asset(uncoded, "");
    test::Random random(seed);
    for (size_t i = 0; i < one.objects.size(); ++i)
      for (int ray = 0; ray < 20; ++ray) {
        const kernels::Segment segment = test::random_segment(random, one.objects[i]);
        const kernels::Answer a = test::query_object(one.objects[i], segment),
                              b = test::query_object(other.objects[i], segment);
        EXPECT_EQ(a.logit, b.logit);
        EXPECT_EQ(a.certain, b.certain);
      }
  }
  for (uint32_t bit = 0; bit < 5; ++bit) EXPECT_GT(with[bit], 10u) << bit;
  EXPECT_GT(smaller, files * 3 / 4);
}

/// Where a change is accepted, it is the coded form of something else.
TEST(Coded, HasOneFormOfGivenContents) {
  uint64_t accepted = 0, refused = 0;
  for (uint64_t seed = 0; seed < 14; ++seed) {
    const Bytes file = format::encode(coded_asset(6 + seed, 1, seed % 2 ? 5 : 9));
    test::Random random(seed);
    for (const uint32_t type : {uint32_t{format::kOccupancy}, uint32_t{format::kCells},
                                uint32_t{format::kFeatures}, uint32_t{format::kSegments}}) {
      const auto section = test::section_entry(file, test::find_section(file, type));
      for (int change = 0; change < 150 && section.bytes > 0; ++change) {
        Bytes changed = file;
        const bool at_end = random.below(4) == 0;
        const uint64_t at =
            at_end ? section.bytes - 1 - random.below(uint32_t(std::min<uint64_t>(section.bytes, 6)))
                   : random.below(uint32_t(section.bytes));
        changed[section.offset + at] ^= std::byte(1u << random.below(8));
        test::fix_checksums(changed);
        const test::ExactBuffer exact(changed);
        const test::ReadOutcome outcome = test::outcome_of(exact.bytes());
        ++(outcome.status == Status::ok ? accepted : refused);
        if (outcome.status == Status::ok)
          EXPECT_EQ(format::encode(format::to_asset(format::read_asset(exact.bytes(), "changed"))), changed)
              << seed << " " << at;
        else
          EXPECT_EQ(outcome.status, Status::damaged_nif) << outcome.sentence;
      }
    }
  }
  EXPECT_GT(accepted, 20u);  // where a payload is not coded, and of the record
  EXPECT_GT(refused, 4000u);
}

/// Arrays without entries have no memory.
TEST(Coded, MayHaveNoSurface) {
  format::Asset asset = coded_asset(format::kCodedPayloads - 1, 1);
  auto& data = asset.objects[0].as<SegmentData>();
  EXPECT_EQ(data.coded, format::kCodedPayloads);
  data.voxels = {24, 24, 24};
  data.brick_table.assign(7 * 7 * 7, 2);
  data.brick_states = {}, data.brick_corners = {}, data.corner_base = {}, data.features = {};
  data.voxel_base = {}, data.voxel_records = {}, data.parts = {};
  data.corners = 0;
  const Bytes file = format::encode(asset);
  EXPECT_EQ(format::encode(format::to_asset(format::read_asset(file, "file"))), file);
}

/// A file of one object, all of it coded, and ways to change it.
class CodedFile : public testing::Test {
 protected:
  void SetUp() override {
    test::RandomAssetOptions options;
    options.objects = 1;
    options.instances = 0;
    options.coded = format::kCodedPayloads;
    for (uint64_t seed = 1; file_.empty(); ++seed) {
      asset_ = test::random_asset(seed, options);
      if (asset_.objects[0].as<SegmentData>().parts.empty()) continue;
      file_ = format::encode(asset_);
      if (forms_of(file_, 0) != format::kCodedPayloads) file_.clear();
    }
  }

  /// The file with another payload of a section, and another record.
  Bytes with(
      uint32_t section, const std::function<void(Bytes&)>& change_payload,
      const std::function<void(SegmentRecord&)>& change_record = [](SegmentRecord&) {}) const {
    std::vector<test::Part> parts = test::parts_of(file_);
    size_t bytes = 0;
    for (test::Part& part : parts) {
      if (part.type != section) continue;
      change_payload(part.content);
      bytes = part.content.size();
    }
    for (test::Part& part : parts) {
      if (part.type != format::kSegments) continue;
      auto record = test::load<SegmentRecord>(part.content, 0);
      (section == format::kOccupancy ? record.occupancy
       : section == format::kCells   ? record.cells
                                     : record.features)
          .bytes = bytes;
      change_record(record);
      test::store(part.content, 0, record);
    }
    return test::file_of(file_, parts);
  }
  Bytes with_record(const std::function<void(SegmentRecord&)>& change) const {
    return test::with_record<SegmentRecord>(file_, format::kSegments, 0, change);
  }
  static void expect_refused(const Bytes& file, const std::string& why) {
    const test::ExactBuffer exact(file);
    const test::ReadOutcome outcome = test::outcome_of(exact.bytes());
    EXPECT_EQ(outcome.status, Status::damaged_nif);
    EXPECT_NE(outcome.sentence.find("x.nif: section SEGM, record 0: "), std::string::npos)
        << outcome.sentence;
    EXPECT_NE(outcome.sentence.find(why), std::string::npos) << outcome.sentence;
  }

  format::Asset asset_;
  Bytes file_;
};

constexpr uint32_t kPayloadSections[] = {format::kOccupancy, format::kCells, format::kFeatures};

TEST_F(CodedFile, ThatEndsEarlyOrLateIsRefused) {
  for (const uint32_t section : kPayloadSections) {
    SCOPED_TRACE(format::section_name(section));
    const size_t bytes = test::section_entry(file_, test::find_section(file_, section)).bytes;
    for (const size_t missing : {size_t{1}, size_t{2}, size_t{4}, bytes / 2})
      expect_refused(with(section, [&](Bytes& payload) { payload.resize(bytes - missing); }),
                     "is not what an encoder makes");
    for (const size_t more : {size_t{1}, size_t{4}})
      for (const unsigned value : {0u, 255u})
        expect_refused(with(section, [&](Bytes& payload) { payload.resize(bytes + more, std::byte(value)); }),
                       "is not what an encoder makes");
    expect_refused(with(section, [](Bytes& payload) { payload.clear(); }), "is not what an encoder makes");
    expect_refused(with(section, [](Bytes& payload) { payload.resize(1 << 20); }), "no smaller for it");
  }
}

TEST_F(CodedFile, WithWrongCountsIsRefused) {
  for (const int by : {-1, 1}) {
    const auto changed = [&](uint32_t SegmentRecord::*count) {
      return with_record([&](SegmentRecord& record) { record.*count += uint32_t(by); });
    };
    expect_refused(changed(&SegmentRecord::mixed_bricks), "occupancy payload is not what an encoder makes");
    expect_refused(changed(&SegmentRecord::corners), "corners is not the number of bits");
    expect_refused(changed(&SegmentRecord::surface_voxels), "surface_voxels is not the number of");
    expect_refused(changed(&SegmentRecord::part_count), "cells payload is not what an encoder makes");
  }
  expect_refused(with_record([](SegmentRecord& record) { ++record.levels; }), "");
  expect_refused(with_record([](SegmentRecord& record) { record.part_count = 1 << 20; }),
                 "payloads decode to more than 16 times their bytes");
  // An empty brick takes two bytes of an uncoded table, but hardly any of a coded one.
  const uint32_t most = uint32_t(file_.size());
  expect_refused(with_record([&](SegmentRecord& record) {
                   record.levels = 0;
                   uint32_t& side = record.voxels[0] = record.voxels[1] = record.voxels[2] = 4;
                   while (side / 4 * (side / 4) * (side / 4) < most) side += 4;
                   record.voxels[1] = record.voxels[2] = side;
                 }),
                 "or have more bricks than half as many");
}

TEST_F(CodedFile, WithUnknownOrIdleFormsIsRefused) {
  const auto with_forms = [&](uint32_t forms) {
    return with_record([&](SegmentRecord& record) { record.forms = forms; });
  };
  expect_refused(with_forms(format::kCodedPayloads | 32), "unknown bits");
  expect_refused(with_forms(0x80000000u | format::kCodedPayloads), "unknown bits");
  expect_refused(with_record([](SegmentRecord& record) { record.reserved = 1; }),
                 "reserved bytes are not zero");
  expect_refused(with_forms(format::kCodedCells | format::kStatedCorners), "states corners");
  expect_refused(with_forms(format::kCodedOccupancy | format::kStatedKinds), "states kinds");
  // Of what is coded, or of what is not, something else comes out.
  for (uint32_t forms = 0; forms < format::kPayloadForms; ++forms)
    if (forms != format::kCodedPayloads) expect_refused(with_forms(forms), "");
}

/// Counts that claim much of a small payload are refused before there is memory for them.
TEST_F(CodedFile, TakesMemoryOnlyInProportionToItself) {
  const auto memory_for = [](const Bytes& file) {
    test::Meter meter;
    try {
      format::read_asset(file, "file", &meter);
    } catch (const Error& error) {
      EXPECT_EQ(error.status(), Status::damaged_nif);
    }
    return meter.most();
  };
  const auto bound = [](const Bytes& file) { return format::kMostExpansion * file.size() + 4096; };
  EXPECT_LT(memory_for(file_), bound(file_));
  for (uint32_t SegmentRecord::*count : {&SegmentRecord::mixed_bricks, &SegmentRecord::corners,
                                         &SegmentRecord::surface_voxels, &SegmentRecord::part_count})
    for (uint32_t bit = 0; bit < 32; ++bit) {
      const Bytes changed = with_record([&](SegmentRecord& record) { record.*count = 1u << bit; });
      EXPECT_LT(memory_for(changed), bound(changed)) << bit;
    }
  const Bytes wide = with_record([](SegmentRecord& record) {
    record.levels = 0;
    for (uint32_t& voxels : record.voxels) voxels = 256;
  });
  EXPECT_LT(memory_for(wide), bound(wide));
}

TEST(Coded, LeavesWhatBecomesNoSmallerOrTooSmall) {
  test::RandomAssetOptions options{.objects = 1, .max_voxels = 40, .features = 8};
  options.coded = format::kCodedPayloads;
  format::Asset asset = test::random_asset(3, options);
  auto& data = asset.objects[0].as<SegmentData>();
  const auto features_coded = [&] {
    return (forms_of(format::encode(asset), 0) & format::kCodedFeatures) != 0;
  };
  EXPECT_TRUE(features_coded());
  test::Random random(1);
  for (int8_t& feature : data.features) feature = int8_t(random.between(-127, 127));
  EXPECT_EQ(forms_of(format::encode(asset), 0) & format::kCodedPayloads,
            format::kCodedOccupancy | format::kCodedCells);
  // All together to less than a sixteenth.
  std::ranges::fill(data.features, int8_t{5});
  format::leave_bare(data);
  EXPECT_EQ(forms_of(format::encode(asset), 0), 0u);
}

/// As an uncoded table has them. Else a small file could ask for much memory, because what is built at load
/// has a word for each voxel.
TEST(Coded, HasTwoBytesForEachBrick) {
  test::RandomAssetOptions options{.objects = 1, .features = 8};
  options.coded = format::kCodedPayloads;
  for (const uint32_t side : {4u, 60u}) {
    format::Asset asset = test::random_asset(3, options);
    auto& data = asset.objects[0].as<SegmentData>();
    const uint32_t bricks = format::bricks_for(side);
    data.levels = 0;
    data.voxels = {side, side, side};
    data.brick_table.assign(size_t{bricks} * bricks * bricks, 0);
    data.brick_table[0] = kernels::kFirstMixedBrick;
    data.brick_states = {{0x7fffffffffffffffu, 0}};
    data.brick_corners = {~uint64_t{0}};
    data.corner_base = {0};
    data.corners = 64;
    format::leave_bare(data);
    data.features.resize(8 * 64);
    test::Random random(1);
    for (int8_t& feature : data.features) feature = int8_t(random.between(-127, 127));
    EXPECT_EQ(forms_of(format::encode(asset), 0) != 0, side == 4) << side;
  }
}

/// Coding repairs nothing: what a reader refuses is refused when it is written, coded or not.
TEST_F(CodedFile, IsNotMadeOfDamagedData) {
  const auto refused = [&](const std::function<void(SegmentData&)>& damage) {
    format::Asset damaged = asset_;
    damage(damaged.objects[0].as<SegmentData>());
    std::string sentences[2];
    for (const uint32_t coded : {0u, uint32_t{format::kCodedPayloads}}) {
      damaged.objects[0].as<SegmentData>().coded = coded;
      try {
        format::encode(damaged);
        ADD_FAILURE() << "was written";
      } catch (const Error& error) {
        sentences[coded != 0] = error.what();
      }
    }
    EXPECT_EQ(sentences[0], sentences[1]);
  };
  refused([](SegmentData& data) { data.voxel_records[0] = kernels::kEmptyVoxel; });
  refused([](SegmentData& data) { data.voxel_records[0] |= 63u << 4; });
  refused([](SegmentData& data) { data.parts.pop_back(); });
  refused([](SegmentData& data) { data.parts.push_back(kernels::kBareCell); });
  refused([](SegmentData& data) { data.parts[0] = kernels::make_link(255, 0); });
  refused([](SegmentData& data) { ++data.corners; });
  refused([](SegmentData& data) { ++data.voxel_base.back(); });
  refused([](SegmentData& data) { data.brick_table[0] = 0xffff; });
  refused([](SegmentData& data) { data.brick_states[0].surface ^= 1; });
  refused([](SegmentData& data) { data.brick_table.pop_back(); });
  refused([](SegmentData& data) { data.features.pop_back(); });
  refused([](SegmentData& data) { data.features[0] = -128; });
  refused([](SegmentData& data) { data.levels = 9; });
  refused([](SegmentData& data) { data.voxels[2] = 300; });
}

}  // namespace
}  // namespace nif
