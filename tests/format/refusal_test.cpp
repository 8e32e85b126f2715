// Each reason to refuse a file, by its status and its sentence; and what is skipped, as promised.
#include <gtest/gtest.h>

#include <functional>

#include "formats/nif/reader.hpp"
#include "formats/nif/writer.hpp"
#include "tests/format/damaged.hpp"
#include "tests/support/random_asset.hpp"

namespace nif {
namespace {

using test::Bytes, test::ReadOutcome, test::outcome_of, test::with_record;

Bytes bytes_of(std::string_view text) {
  const auto bytes = std::as_bytes(std::span(text));
  return {bytes.begin(), bytes.end()};
}

/// A file with one more section of this type and flags, before or after the others.
Bytes with_section(const Bytes& file, uint32_t type, uint32_t flags, bool first) {
  std::vector<test::Part> parts = test::parts_of(file);
  parts.insert(first ? parts.begin() : parts.end(), {type, flags, bytes_of("from the future")});
  return test::file_of(file, parts);
}

const Bytes& good() {
  static const Bytes file = format::encode(test::random_asset(21));
  return file;
}

TEST(Refusal, NotOurs) {
  EXPECT_EQ(outcome_of({}).status, Status::file_empty);
  EXPECT_EQ(outcome_of({}).sentence, "x.nif: the file is empty");
  EXPECT_EQ(outcome_of(bytes_of("solid cube\n facet")).status, Status::not_a_nif);
  EXPECT_EQ(outcome_of(bytes_of("P")).status, Status::not_a_nif);
  EXPECT_EQ(outcome_of(bytes_of("\xab"
                                "NI"))
                .status,
            Status::file_truncated);
  for (const char* text :
       {"NetImmerse File Format, Version 4.0.0.2\n", "Gamebryo File Format, Version 20.2.0.7\n"}) {
    const ReadOutcome outcome = outcome_of(bytes_of(text));
    EXPECT_EQ(outcome.status, Status::foreign_nif);
    EXPECT_NE(outcome.sentence.find("NetImmerse/Gamebryo"), std::string::npos);
  }
}

TEST(Refusal, TextModeTransfers) {
  Bytes unix_to_dos, dos_to_unix, seven_bits = good();
  for (const std::byte b : good()) {
    if (b == std::byte{'\n'}) unix_to_dos.push_back(std::byte{'\r'});
    unix_to_dos.push_back(b);
    if (b != std::byte{'\r'}) dos_to_unix.push_back(b);
  }
  for (std::byte& b : seven_bits) b &= std::byte{0x7f};
  EXPECT_EQ(outcome_of(unix_to_dos).status, Status::damaged_nif);
  EXPECT_EQ(outcome_of(dos_to_unix).status, Status::damaged_nif);
  EXPECT_EQ(outcome_of(seven_bits).status, Status::damaged_nif);
}

TEST(Refusal, OtherVersions) {
  const auto of_version = [](uint32_t version) {
    Bytes file = good();
    auto header = test::load<format::Header>(file, 0);
    header.version = version;
    test::store(file, 0, header);
    test::fix_checksums(file);
    return outcome_of(file);
  };
  EXPECT_EQ(of_version(2).status, Status::ok);
  EXPECT_EQ(of_version(1).status, Status::unsupported_nif);
  EXPECT_EQ(of_version(1).sentence, "x.nif: header: format version 1 is no longer read; bake the mesh again");
  EXPECT_EQ(of_version(3).status, Status::unsupported_nif);
  EXPECT_EQ(of_version(3).sentence, "x.nif: header: format version 3; this build reads version 2");
}

TEST(Refusal, FlagsOfTheHeader) {
  const auto with_header = [](const Bytes& before, const std::function<void(format::Header&)>& change) {
    Bytes file = before;
    auto header = test::load<format::Header>(file, 0);
    change(header);
    test::store(file, 0, header);
    test::fix_checksums(file);
    return outcome_of(file);
  };
  const Bytes bare = format::encode(test::random_asset(21, {.instances = 0}));
  const auto places_nothing = [](auto& h) { h.flags = format::kPlacesNothing; };
  EXPECT_EQ(with_header(bare, places_nothing).status, Status::ok);
  EXPECT_EQ(with_header(good(), places_nothing).sentence,
            "x.nif: section INST: has instances, though its header says that it places nothing");
  for (uint32_t bit = 1; bit < 32; ++bit)
    EXPECT_EQ(with_header(bare, [&](auto& h) { h.flags = 1u << bit; }).status,
              bit < 16 ? Status::unsupported_nif : Status::ok)
        << bit;
  for (size_t i = 0; i < std::size(format::Header{}.reserved); ++i)
    EXPECT_EQ(with_header(bare, [&](auto& h) { h.reserved[i] = 1; }).status, Status::damaged_nif) << i;
}

TEST(Refusal, UnknownSections) {
  for (const bool first : {true, false}) {
    const uint32_t type = format::fourcc("XTRA");
    const Bytes optional = with_section(good(), type, 0, first);
    EXPECT_EQ(outcome_of(optional).sentence, "");
    EXPECT_EQ(format::encode(format::to_asset(format::read_asset(optional, "file"))), good());
    const ReadOutcome required = outcome_of(with_section(good(), type, format::kRequired, first));
    EXPECT_EQ(required.status, Status::unsupported_nif);
    EXPECT_NE(required.sentence.find("XTRA"), std::string::npos);
  }
}

TEST(Refusal, SectionTable) {
  const ReadOutcome twice = outcome_of(with_section(good(), format::kMetadata, 0, true));
  EXPECT_EQ(twice.status, Status::damaged_nif);
  EXPECT_NE(twice.sentence.find("twice"), std::string::npos);

  for (const uint32_t type :
       {uint32_t{format::kObjects}, uint32_t{format::kInstances}, uint32_t{format::kNames},
        uint32_t{format::kPlanes}, uint32_t{format::kNetworks}, uint32_t{format::kMlps},
        uint32_t{format::kData}}) {
    Bytes file = good();
    const uint32_t index = test::find_section(file, type);
    auto entry = test::section_entry(file, index);
    entry.flags &= ~uint32_t{format::kRequired};
    test::store_entry(file, index, entry);
    test::fix_checksums(file);
    EXPECT_EQ(outcome_of(file).status, Status::damaged_nif) << "flag of " << format::section_name(type);
    entry.type = format::fourcc("GONE");
    test::store_entry(file, index, entry);
    test::fix_checksums(file);
    const ReadOutcome missing = outcome_of(file);
    EXPECT_EQ(missing.status, Status::damaged_nif);
    EXPECT_NE(missing.sentence.find("missing"), std::string::npos);
  }

  const auto with_entry = [](uint32_t index, const std::function<void(format::SectionEntry&)>& change) {
    Bytes file = good();
    auto entry = test::section_entry(file, index);
    change(entry);
    test::store_entry(file, index, entry);
    test::fix_checksums(file);
    return outcome_of(file).status;
  };
  for (uint32_t i = 0; i < test::load<format::Header>(good(), 0).section_count; ++i) {
    EXPECT_EQ(with_entry(i, [](auto& e) { e.offset += 64; }), Status::damaged_nif);
    EXPECT_EQ(with_entry(i, [](auto& e) { e.offset -= 64; }), Status::damaged_nif);
    EXPECT_EQ(with_entry(i, [](auto& e) { e.offset += 1; }), Status::damaged_nif);
    EXPECT_EQ(with_entry(i, [](auto& e) { e.offset = 0; }), Status::damaged_nif);
    EXPECT_EQ(with_entry(i, [](auto& e) { e.offset = ~uint64_t{0} - 63; }), Status::damaged_nif);
    EXPECT_EQ(with_entry(i, [](auto& e) { e.bytes = ~uint64_t{0}; }), Status::damaged_nif);
    EXPECT_EQ(with_entry(i, [](auto& e) { e.bytes += 64; }), Status::damaged_nif);
    EXPECT_EQ(with_entry(i, [](auto& e) { e.record_size += 4; }), Status::damaged_nif);
    EXPECT_EQ(with_entry(i, [](auto& e) { e.record_size = 0xfffffff8; }), Status::damaged_nif);
    EXPECT_EQ(with_entry(i, [](auto& e) { e.flags ^= format::kPayloads; }), Status::damaged_nif);
    EXPECT_EQ(with_entry(i, [](auto& e) { e.flags |= 8; }), Status::unsupported_nif);
    EXPECT_EQ(with_entry(i, [](auto& e) { e.flags |= 0x8000; }), Status::unsupported_nif);
    EXPECT_EQ(with_entry(i, [](auto& e) { e.flags |= 0xffff0000; }), Status::ok) << "may be ignored";
    EXPECT_EQ(with_entry(i, [](auto& e) { e.flags |= format::kKeep; }), Status::ok);
  }
}

/// Whether a file with this change of a record is refused with a message that names the record.
template <class Record>
bool refused(uint32_t section, uint32_t index, const std::function<void(Record&)>& change) {
  const ReadOutcome outcome = outcome_of(with_record<Record>(good(), section, index, change));
  if (outcome.status != Status::damaged_nif) return false;
  const std::string place =
      "section " + format::section_name(section) + ", record " + std::to_string(index) + ": ";
  EXPECT_NE(outcome.sentence.find(place), std::string::npos) << outcome.sentence;
  return true;
}

TEST(Refusal, ObjectRecords) {
  using Record = format::ObjectRecord;
  const float inf = std::numeric_limits<float>::infinity(), nan = std::numeric_limits<float>::quiet_NaN();
  const auto object = [](const std::function<void(Record&)>& change) {
    return refused<Record>(format::kObjects, 1, change);
  };
  EXPECT_FALSE(object([](auto&) {}));
  for (uint32_t Record::*part : {&Record::planes, &Record::network})
    for (const uint32_t record : {0u, 2u, 0xfffffffeu})
      EXPECT_TRUE(object([&](auto& r) { r.*part = record; })) << record;
  EXPECT_TRUE(object([](auto& r) { r.name.offset += 1; }));
  EXPECT_TRUE(object([](auto& r) { r.name.bytes = 0xffffffff; }));
  EXPECT_TRUE(object([](auto& r) { r.name.bytes -= 1; }));
  EXPECT_TRUE(object([&](auto& r) { r.aabb_min[0] = nan; }));
  EXPECT_TRUE(object([&](auto& r) { r.aabb_max[2] = inf; }));
  EXPECT_TRUE(object([](auto& r) { std::swap(r.aabb_min[0], r.aabb_max[0]); }));
  EXPECT_TRUE(object([](auto& r) { r.bias = -1; }));
  EXPECT_TRUE(object([&](auto& r) { r.bias = inf; }));
  for (size_t i = 0; i < std::size(Record{}.reserved); ++i)
    EXPECT_TRUE(object([&](auto& r) { r.reserved[i] = 1; })) << i;
}

TEST(Refusal, PlanesRecords) {
  using Record = format::PlanesRecord;
  const float inf = std::numeric_limits<float>::infinity(), nan = std::numeric_limits<float>::quiet_NaN();
  const auto planes = [](const std::function<void(Record&)>& change) {
    return refused<Record>(format::kPlanes, 1, change);
  };
  EXPECT_FALSE(planes([](auto&) {}));
  EXPECT_TRUE(planes([&](auto& r) { r.origin[1] = inf; }));
  EXPECT_TRUE(planes([](auto& r) { r.voxels_per_unit = 0; }));
  EXPECT_TRUE(planes([&](auto& r) { r.voxels_per_unit = nan; }));
  EXPECT_TRUE(planes([](auto& r) { r.voxels[0] = 0; }));
  EXPECT_TRUE(planes([](auto& r) { r.voxels[2] = 257; }));
  EXPECT_TRUE(planes([](auto& r) { r.voxels[2] += 4; }));
  EXPECT_TRUE(planes([](auto& r) { r.mixed_bricks += 1; }));
  EXPECT_TRUE(planes([](auto& r) { r.mixed_bricks = 0xffffffff; }));
  EXPECT_TRUE(planes([](auto& r) { r.occupancy.bytes -= 2; }));
  EXPECT_TRUE(planes([](auto& r) { r.levels = 5; }));
  EXPECT_TRUE(planes([](auto& r) { r.surface_voxels += 1; }));
  EXPECT_TRUE(planes([](auto& r) { r.child_count += 1; }));
  EXPECT_TRUE(planes([](auto& r) { r.child_count = 0xffffffff; }));
  EXPECT_TRUE(planes([](auto& r) { r.cells.offset += 32; }));
  EXPECT_TRUE(planes([](auto& r) { r.cells.offset = r.occupancy.offset; }));
  EXPECT_TRUE(planes([](auto& r) { r.cells.reserved = 1; }));
  EXPECT_TRUE(planes([](auto& r) { r.cells.bytes -= 4; }));
}

TEST(Refusal, NetworkRecords) {
  using Record = format::NetworkRecord;
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const auto network = [](const std::function<void(Record&)>& change) {
    return refused<Record>(format::kNetworks, 1, change);
  };
  EXPECT_FALSE(network([](auto&) {}));
  EXPECT_TRUE(network([](auto& r) { r.mlp = 3; }));
  EXPECT_TRUE(network([](auto& r) { r.corners += 1; }));
  EXPECT_TRUE(network([](auto& r) { r.features_per_corner = 0; }));
  EXPECT_TRUE(network([](auto& r) { r.features_per_corner = 9; }));
  EXPECT_TRUE(network([](auto& r) { r.samples = 33; }));
  EXPECT_TRUE(network([](auto& r) { r.samples += 4; }));
  EXPECT_TRUE(network([&](auto& r) { r.length_scale = nan; }));
  EXPECT_TRUE(network([](auto& r) { r.length_scale = -1; }));
  EXPECT_TRUE(network([](auto& r) { r.forms = 4; }));
  EXPECT_TRUE(network([](auto& r) { r.forms = format::kCornersAround; })) << "its payload is not empty";
  EXPECT_TRUE(network([](auto& r) { r.reserved[0] = 1; }));
  EXPECT_TRUE(network([](auto& r) { r.reserved[1] = 1; }));
  EXPECT_TRUE(network([](auto& r) { r.brick_corners.offset -= 64; }));
  EXPECT_TRUE(network([](auto& r) { r.brick_corners.bytes -= 4; }));
  EXPECT_TRUE(network([](auto& r) { r.features.offset = ~uint64_t{0}; }));
  EXPECT_TRUE(network([](auto& r) { r.features.bytes += 64; }));
}

TEST(Refusal, MlpAndInstanceRecords) {
  const auto network = [](const std::function<void(format::MlpRecord&)>& change) {
    return outcome_of(with_record<format::MlpRecord>(good(), format::kMlps, 0, change)).status ==
           Status::damaged_nif;
  };
  EXPECT_FALSE(network([](auto&) {}));
  EXPECT_TRUE(network([](auto& r) { r.layer_count = 0; }));
  EXPECT_TRUE(network([](auto& r) { r.layer_count = 5; }));
  EXPECT_TRUE(network([](auto& r) { r.logit_scale = 0; }));
  EXPECT_FALSE(network([](auto& r) { r.threshold = 1 << 27; }));
  EXPECT_FALSE(network([](auto& r) { r.threshold = -(1 << 27); }));
  EXPECT_TRUE(network([](auto& r) { r.threshold = (1 << 27) + 1; }));
  EXPECT_TRUE(network([](auto& r) { r.threshold = -(1 << 27) - 1; }));
  EXPECT_TRUE(network([](auto& r) { r.threshold = std::numeric_limits<int32_t>::min(); }));
  EXPECT_TRUE(network([](auto& r) { r.layers[0].inputs += 4; }));
  EXPECT_TRUE(network([](auto& r) { r.layers[0].outputs += 1; }));
  EXPECT_TRUE(network([](auto& r) { r.layers[0].outputs = 0x40000000; }));
  EXPECT_TRUE(network([](auto& r) { r.layers[0].shift = 25; }));
  EXPECT_TRUE(network([](auto& r) { r.layers[3].shift = 1; }));
  EXPECT_TRUE(network([](auto& r) { r.reserved = 1; }));
  EXPECT_TRUE(network([](auto& r) { r.weights.offset = 32; }));

  const auto instance = [](const std::function<void(format::InstanceRecord&)>& change) {
    return outcome_of(with_record<format::InstanceRecord>(good(), format::kInstances, 2, change)).status ==
           Status::damaged_nif;
  };
  EXPECT_FALSE(instance([](auto&) {}));
  EXPECT_TRUE(instance([](auto& r) { r.object = 3; }));
  EXPECT_TRUE(instance([](auto& r) { r.reserved = 1; }));
  EXPECT_TRUE(instance([](auto& r) { r.linear[4] = std::numeric_limits<float>::quiet_NaN(); }));
  EXPECT_TRUE(instance([](auto& r) { r.name.bytes += 1; }));
}

/// Two objects with holes after one without, which share maps.
format::Asset with_holes() {
  return test::random_asset(21, {.objects = 1, .instances = 0, .bvhs = 1, .cutouts = 2});
}

/// The sentence of a refusal, without the file's name; empty if the file is read.
std::string why_damaged(const Bytes& file) {
  const ReadOutcome outcome = outcome_of(file);
  EXPECT_TRUE(outcome.status == Status::ok || outcome.status == Status::damaged_nif) << outcome.sentence;
  return outcome.sentence.substr(std::min(outcome.sentence.size(), std::string("x.nif: ").size()));
}

TEST(Refusal, FlagOfHoles) {
  const Bytes file = format::encode(with_holes());
  const auto object = [&](uint32_t index, const std::function<void(format::ObjectRecord&)>& change) {
    return why_damaged(with_record<format::ObjectRecord>(file, format::kObjects, index, change));
  };
  const std::string place = "section OBJS, record ";
  EXPECT_EQ(object(2, [](auto&) {}), "");
  for (const uint32_t without : {0u, 1u})
    EXPECT_EQ(object(without, [](auto& r) { r.flags = format::kCutOuts; }).find(place), 0u) << without;
  EXPECT_EQ(object(2, [](auto& r) { r.flags = 0; }).find(place + "2"), 0u);
  EXPECT_EQ(object(2, [](auto& r) { r.flags = format::kDeforms; }).find(place + "2"), 0u)
      << "also of an object that is not answered";
  EXPECT_EQ(object(2, [](auto& r) { r.flags |= format::kDeforms; }), "");
  EXPECT_EQ(object(2, [](auto& r) { r.holes = format::kNoPart; }).find(place + "2"), 0u);
  EXPECT_EQ(object(1, [](auto& r) { r.holes = 0; }).find(place + "1"), 0u);
  for (const uint32_t record : {0u, 2u, 0xfffffffeu})
    EXPECT_EQ(object(3, [&](auto& r) { r.holes = record; }).find(place + "3"), 0u) << record;
  EXPECT_EQ(object(2, [](auto& r) { r.spare = 7; }), "") << "of a later part";
  // Records that end before, in a file without holes: the flag alone.
  const Bytes none = format::encode(test::random_asset(21, {.objects = 0, .instances = 0, .bvhs = 1}));
  const auto entry = test::section_entry(none, test::find_section(none, format::kObjects));
  ASSERT_EQ(entry.record_size, format::ObjectRecord::kFirstBytes);
  Bytes flagged = none;
  test::store(flagged, entry.offset, uint32_t{format::kCutOuts});
  test::fix_checksums(flagged);
  EXPECT_EQ(why_damaged(flagged).find(place + "0"), 0u);
}

TEST(Refusal, HolesRecords) {
  using Record = format::HolesRecord;
  const format::Asset asset = with_holes();
  const Bytes file = format::encode(asset);
  const auto holes = [&](const std::function<void(Record&)>& change) {
    return why_damaged(with_record<Record>(file, format::kHoles, 1, change));
  };
  const std::string place = "section HOLE, record 1: ";
  const format::HolesData& data = *asset.objects[3].holes;
  EXPECT_EQ(holes([](auto&) {}), "");
  for (const uint32_t patches : {0u, data.triangles + 1, 0xffffffffu})
    EXPECT_EQ(holes([&](auto& r) { r.patches = patches; }).find(place + "patches is"), 0u) << patches;
  for (size_t i = 0; i < std::size(Record{}.reserved); ++i)
    EXPECT_EQ(holes([&](auto& r) { r.reserved[i] = 1; }).find(place), 0u) << i;
  EXPECT_EQ(holes([](auto& r) { r.holes.bytes -= 4; }).find(place), 0u);
  EXPECT_EQ(holes([](auto& r) { r.holes.offset += 32; }).find(place), 0u);
  EXPECT_EQ(holes([](auto& r) { r.holes.reserved = 1; }).find(place), 0u);

  // What it holds.
  const auto with = [&](const std::function<void(format::HolesData&)>& change) {
    format::HolesData changed = data;
    change(changed);
    return why_damaged(test::with_holes(file, 1, changed));
  };
  const auto maps = uint32_t(asset.alpha_maps.size());
  EXPECT_EQ(with([](auto&) {}), "");
  EXPECT_NE(with([&](auto& d) { d.patches.back().map = maps; }).find("alpha map of a patch"),
            std::string::npos);
  EXPECT_NE(with([&](auto& d) { d.patches[0].map = 0xffffffff; }).find("alpha map of a patch"),
            std::string::npos);
  EXPECT_EQ(with([](auto& d) { d.patches[0].shift = 16; }), "");
  for (const uint32_t shift : {17u, 32u, 0x80000000u})
    EXPECT_NE(with([&](auto& d) { d.patches.back().shift = shift; }).find("shift of a patch"),
              std::string::npos);
  for (const bool last : {false, true})
    EXPECT_NE(with([&](auto& d) {
                d.patches.resize(2);  // three numbers, in two bits
                std::vector<uint32_t> numbers(d.triangles, 1);
                (last ? numbers.back() : numbers.front()) = 3;
                d.set_numbers(numbers);
              }).find("patch of a triangle"),
              std::string::npos);
  EXPECT_NE(with([](auto& d) {
              ASSERT_NE(d.triangles % 32, 0u);
              d.patches.resize(1);
              d.set_numbers(std::vector<uint32_t>(d.triangles, 1));
              d.numbers.back() |= 1u << 31;
            }).find("after the last number"),
            std::string::npos);
}

TEST(Refusal, AlphaMapRecords) {
  using Record = format::AlphaMapRecord;
  format::Asset asset = with_holes();
  test::Random random(5);
  while (asset.alpha_maps.size() < 2) test::add_random_alpha_map(random, asset.alpha_maps);
  const Bytes file = format::encode(asset);
  const auto map = [&](const std::function<void(Record&)>& change) {
    return why_damaged(with_record<Record>(file, format::kAlphaMaps, 1, change));
  };
  const std::string place = "section ALPH, record 1: ";
  EXPECT_EQ(map([](auto&) {}), "");
  for (const uint32_t size : {0u, kernels::kMaxAlphaSide + 1, 0xffffffffu}) {
    EXPECT_EQ(map([&](auto& r) { r.width = size; }).find(place + "width is "), 0u) << size;
    EXPECT_EQ(map([&](auto& r) { r.height = size; }).find(place + "height is "), 0u) << size;
  }
  for (size_t a = 0; a < 2; ++a) {
    for (const uint32_t wrap : {0u, 1u, 2u}) EXPECT_EQ(map([&](auto& r) { r.wrap[a] = uint8_t(wrap); }), "");
    for (const uint32_t wrap : {3u, 255u})
      EXPECT_EQ(map([&](auto& r) { r.wrap[a] = uint8_t(wrap); }).find(place + "wrap"), 0u) << wrap;
  }
  for (size_t i = 0; i < std::size(Record{}.reserved); ++i)
    EXPECT_EQ(map([&](auto& r) { r.reserved[i] = 1; }).find(place), 0u) << i;
  EXPECT_EQ(map([](auto& r) { r.tiles.reserved = 1; }).find(place), 0u);
  EXPECT_EQ(map([](auto& r) { r.tiles.offset += 8; }).find(place), 0u);

  // Payloads that no encoder makes.
  const std::string damaged = place + "tiles payload is not what an encoder makes";
  const auto with_tiles = [&](const std::function<void(Bytes&)>& change) {
    std::vector<test::Part> parts = test::parts_of(file);
    Bytes tiles = test::payload_of(parts, test::payload::kAlphaTiles, 1);
    change(tiles);
    test::set_payload(parts, test::payload::kAlphaTiles, 1, tiles);
    return why_damaged(test::file_of(file, parts));
  };
  EXPECT_EQ(with_tiles([](auto&) {}), "");
  EXPECT_EQ(with_tiles([](auto& t) { t.clear(); }), damaged);
  EXPECT_EQ(with_tiles([](auto& t) { t.resize(t.size() + 8, std::byte{1}); }), damaged);
  EXPECT_EQ(with_tiles([](auto& t) { std::fill_n(t.begin(), 4, std::byte{255}); }), damaged);
  EXPECT_EQ(with_tiles([](auto& t) { std::fill(t.begin(), t.end(), std::byte{0}); }), damaged);

  // Together they are too large, though each is not.
  const auto clear = [](uint32_t width, uint32_t height, format::AlphaMaps& maps) {
    kernels::AlphaMap one;
    one.width = width;
    one.height = height;
    maps.add(one, std::make_shared<std::vector<uint64_t>>(kernels::alpha_tiles(width, height)));
  };
  format::Asset large = with_holes();
  large.alpha_maps.clear();
  for (int i = 0; i < 4; ++i) clear(kernels::kMaxAlphaSide, kernels::kMaxAlphaSide, large.alpha_maps);
  for (format::Object& object : large.objects)
    if (object.holes)
      for (kernels::AlphaPatch& patch : object.holes->patches) patch.map %= 4;
  const Bytes most = format::encode(large);
  EXPECT_LT(most.size(), 1u << 16);
  EXPECT_EQ(why_damaged(most), "");
  std::vector<test::Part> parts = test::parts_of(most);
  test::Part& maps = test::section_of(parts, format::kAlphaMaps);
  Record one_more{};
  one_more.width = one_more.height = 1;
  const auto bytes = std::as_bytes(std::span(&one_more, 1));
  maps.content.insert(maps.content.end(), bytes.begin(), bytes.end());
  const std::string sentence = why_damaged(test::file_of(most, parts));
  EXPECT_EQ(sentence.find("section ALPH, record 4: "), 0u) << sentence;
  EXPECT_NE(sentence.find("2^24 tiles"), std::string::npos) << sentence;
}

TEST(Refusal, Payload) {
  const format::Asset asset = format::to_asset(format::read_asset(good(), "file"));
  const format::PlanesData& object = *asset.objects[0].planes;
  ASSERT_GT(object.brick_states.size(), 1u);
  const auto changed_at = [](size_t at, auto value) {
    Bytes file = good();
    test::store(file, at, value);
    test::fix_checksums(file);
    return outcome_of(file).status;
  };
  const auto changed = [&](const test::PayloadKind& kind, size_t at, auto value) {
    return changed_at(test::payload_at(good(), kind, 0) + at, value);
  };
  const size_t names = test::section_entry(good(), test::find_section(good(), format::kNames)).offset;
  const size_t mixed = object.brick_states.size();
  EXPECT_EQ(changed(test::payload::kCorners, 0, asset.objects[0].network->brick_corners[0] ^ 1),
            Status::damaged_nif);
  EXPECT_EQ(changed(test::payload::kCorners, mixed * 8 + 4, uint32_t{0xfffffff0}), Status::damaged_nif);
  EXPECT_EQ(changed(test::payload::kOccupancy, mixed * 20, uint16_t(3 + mixed)), Status::damaged_nif);
  EXPECT_EQ(changed(test::payload::kOccupancy, mixed * 16 + 4, uint32_t{0xfffffff0}), Status::damaged_nif);
  EXPECT_EQ(changed(test::payload::kCells, 0, uint32_t{kernels::kEmptyVoxel}), Status::damaged_nif);
  EXPECT_EQ(changed(test::payload::kFeatures, 0, int8_t(-128)), Status::damaged_nif);
  EXPECT_EQ(changed(test::payload::kWeights, 0, int32_t(-(1 << 26) - 1)), Status::damaged_nif);
  EXPECT_EQ(changed(test::payload::kWeights, 0, int32_t(1 << 26)), Status::ok);
  EXPECT_EQ(changed_at(names, char(0)), Status::damaged_nif);
  EXPECT_EQ(changed_at(names, uint8_t(0xff)), Status::damaged_nif);
}

/// For such voxels, fast kernels would read beyond their tables of corners.
TEST(Refusal, VoxelsBeyondTheGrid) {
  const format::PlanesData object = *format::to_asset(format::read_asset(good(), "file")).objects[0].planes;
  const uint32_t across = format::bricks_for(object.voxels[0]), down = format::bricks_for(object.voxels[1]);
  // A mixed brick whose last voxel, the highest bit, is beyond the grid.
  uint32_t number = 0;
  while (object.brick_table[number] < kernels::kFirstMixedBrick ||
         (4 * (number % across) + 3 < object.voxels[0] &&
          4 * (number / across % down) + 3 < object.voxels[1] &&
          4 * (number / across / down) + 3 < object.voxels[2]))
    ASSERT_LT(++number, object.brick_table.size());
  const size_t brick = object.brick_table[number] - kernels::kFirstMixedBrick;
  for (const size_t word : {0, 1}) {
    Bytes file = good();
    const uint64_t at = test::payload_at(file, test::payload::kOccupancy, 0) + 16 * brick + 8 * word;
    test::store(file, at, test::load<uint64_t>(file, at) | uint64_t{1} << 63);
    test::fix_checksums(file);
    EXPECT_EQ(outcome_of(file).status, Status::damaged_nif) << word;
  }
}

/// Kernels look up features by 16-bit numbers of bricks.
TEST(Refusal, MixedBrickTwiceInTheTable) {
  const format::PlanesData object = *format::to_asset(format::read_asset(good(), "file")).objects[0].planes;
  const size_t mixed = object.brick_states.size();
  ASSERT_GT(mixed, 1u);
  size_t first = 0;
  while (object.brick_table[first] < kernels::kFirstMixedBrick) ++first;
  for (const uint16_t entry : {uint16_t(kernels::kFirstMixedBrick + 1), uint16_t(kernels::kBrickOutside)}) {
    Bytes file = good();
    const uint64_t table = test::payload_at(file, test::payload::kOccupancy, 0) + 20 * mixed;
    test::store(file, table + 2 * first, entry);
    test::fix_checksums(file);
    EXPECT_EQ(outcome_of(file).status, Status::damaged_nif) << entry;
  }
}

TEST(Refusal, MisalignedAddress) {
  Bytes shifted(good().size() + 16);
  std::copy(good().begin(), good().end(), shifted.begin() + 4);
  EXPECT_EQ(outcome_of(std::span(shifted).subspan(4, good().size())).status, Status::usage);
  std::copy(good().begin(), good().end(), shifted.begin() + 8);
  EXPECT_EQ(outcome_of(std::span(shifted).subspan(8, good().size())).status, Status::ok);
}

}  // namespace
}  // namespace nif
