// Coded payloads of planes and networks: what is read is what was written, also if it is coded otherwise than
// our writer codes it, and bytes that are no code are refused before they take memory.
#include <gtest/gtest.h>

#include <algorithm>

#include "formats/nif/network/coded_features.hpp"
#include "formats/nif/planes/coded_cells.hpp"
#include "formats/nif/writer.hpp"
#include "tests/format/damaged.hpp"
#include "tests/support/query_object.hpp"
#include "tests/support/test_meter.hpp"

namespace nif {
namespace {

using format::NetworkData, format::NetworkRecord, format::PlanesData, format::PlanesRecord;
using test::Bytes;

/// The bits of the seed say what is coded; every second pair of seeds has odd corners.
format::Asset coded_asset(uint64_t seed, uint32_t objects = 2, uint32_t max_voxels = 14) {
  test::RandomAssetOptions options;
  options.objects = objects;
  options.instances = 1;
  options.max_voxels = max_voxels;
  options.coded = 1 + uint32_t(seed % test::kCodedAll);
  options.odd_corners = seed / 2 % 2 == 0;
  return test::random_asset(seed, options);
}

struct Forms {
  uint32_t planes, network;
  bool operator==(const Forms&) const = default;
};
constexpr Forms kAllCoded{format::kCodedPlanes, format::kNetworkForms};

Forms forms_of(const Bytes& file, uint32_t object) {
  const auto record = [&]<class Record>(uint32_t section, const Record&) {
    const auto entry = test::section_entry(file, test::find_section(file, section));
    return test::load<Record>(file, entry.offset + object * sizeof(Record)).forms;
  };
  return {record(format::kPlanes, PlanesRecord()), record(format::kNetworks, NetworkRecord())};
}

bool operator==(const kernels::BrickStates& a, const kernels::BrickStates& b) {
  return a.surface == b.surface && a.aux == b.aux;
}

void expect_same(const PlanesData& a, const PlanesData& b) {
  EXPECT_EQ(a.brick_table, b.brick_table);
  EXPECT_TRUE(std::ranges::equal(a.brick_states, b.brick_states,
                                 [](const auto& one, const auto& other) { return one == other; }));
  EXPECT_EQ(a.voxel_base, b.voxel_base);
  EXPECT_EQ(a.voxel_records, b.voxel_records);
  EXPECT_EQ(a.children, b.children);
}
void expect_same(const NetworkData& a, const NetworkData& b) {
  EXPECT_EQ(a.brick_corners, b.brick_corners);
  EXPECT_EQ(a.corner_base, b.corner_base);
  EXPECT_EQ(a.features, b.features);
}

TEST(Coded, IsReadAsItWasWritten) {
  size_t with[5] = {}, smaller = 0, files = 0;  // [bit of PlanesForm, then of NetworkForm]
  for (uint64_t seed = 0; seed < 84; ++seed) {
    SCOPED_TRACE(seed);
    format::Asset asset = coded_asset(seed);
    const Bytes file = format::encode(asset);
    EXPECT_EQ(format::encoded_bytes(asset), file.size());
    const format::Asset again = format::to_asset(format::read_asset(file, "coded"));
    EXPECT_EQ(format::encode(again), file);
    for (uint32_t i = 0; i < asset.objects.size(); ++i) {
      const format::Object& object = asset.objects[i];
      expect_same(*again.objects[i].planes, *object.planes);
      expect_same(*again.objects[i].network, *object.network);
      const Forms forms = forms_of(file, i);
      EXPECT_EQ(forms.planes & format::kCodedPlanes & ~object.planes->coded, 0u);
      EXPECT_EQ(forms.network & ~object.network->coded, 0u);
      for (uint32_t bit = 0; bit < 5; ++bit) with[bit] += (forms.planes | forms.network << 3) >> bit & 1;
    }
    for (format::Object& object : asset.objects) test::set_coded(0, object);
    const Bytes uncoded = format::encode(asset);
    EXPECT_EQ(forms_of(uncoded, 0), Forms());
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

/// Reads what another writer may have written, and returns what our writer makes of it: another file perhaps,
/// but of the same asset.
Bytes written_again(const Bytes& other) {
  const test::ExactBuffer exact(other);
  const format::Asset asset = format::to_asset(format::read_asset(exact.bytes(), "other"));
  const Bytes ours = format::encode(asset);
  const format::Asset again = format::to_asset(format::read_asset(ours, "ours"));
  for (size_t i = 0; i < asset.objects.size(); ++i) {
    expect_same(*again.objects[i].planes, *asset.objects[i].planes);
    if (asset.objects[i].network) expect_same(*again.objects[i].network, *asset.objects[i].network);
  }
  EXPECT_EQ(format::encode(again), ours);
  return ours;
}

TEST(Coded, IsRefusedOrReadWhereItIsChanged) {
  uint64_t accepted = 0, refused = 0;
  for (uint64_t seed = 0; seed < 14; ++seed) {
    const Bytes file = format::encode(coded_asset(6 + seed, 1, seed % 2 ? 5 : 9));
    test::Random random(seed);
    for (const uint32_t type :
         {uint32_t{format::kData}, uint32_t{format::kPlanes}, uint32_t{format::kNetworks}}) {
      const auto section = test::section_entry(file, test::find_section(file, type));
      for (int change = 0; change < (type == format::kData ? 450 : 150) && section.bytes > 0; ++change) {
        Bytes changed = file;
        const bool at_end = random.below(4) == 0;
        const uint64_t at =
            at_end ? section.bytes - 1 - random.below(uint32_t(std::min<uint64_t>(section.bytes, 6)))
                   : random.below(uint32_t(section.bytes));
        changed[section.offset + at] ^= std::byte(1u << random.below(8));
        test::fix_checksums(changed);
        const test::ReadOutcome outcome = test::outcome_of(changed);
        ++(outcome.status == Status::ok ? accepted : refused);
        if (outcome.status == Status::ok)
          written_again(changed);
        else
          EXPECT_EQ(outcome.status, Status::damaged_nif) << outcome.sentence;
      }
    }
  }
  EXPECT_GT(accepted, 20u);
  EXPECT_GT(refused, 3000u);
}

/// A file of one object with another payload.
Bytes with_payload(const Bytes& file, const test::PayloadKind& kind,
                   const std::function<void(Bytes&)>& change) {
  std::vector<test::Part> parts = test::parts_of(file);
  Bytes payload = test::payload_of(parts, kind, 0);
  change(payload);
  test::set_payload(parts, kind, 0, payload);
  return test::file_of(file, parts);
}

/// Where one bit is encoded as the opposite of what our coder wants: which cell that is in.
class OtherEncoder {
 public:
  OtherEncoder(uint64_t other, const std::vector<uint32_t>& words) : other_(other), words_(words) {}

  bool bit(BitModel& model, bool value) {
    if (at_++ == other_) {
      value = !value;
      cell_ = size_t(std::ranges::find(words_, format::kUnknownWord) - words_.begin());
    }
    return encoder_.bit(model, value);
  }
  Bytes finish() { return encoder_.finish(); }
  uint64_t bits() const { return at_; }
  size_t cell() const { return cell_; }

 private:
  RangeEncoder encoder_;
  const uint64_t other_;
  const std::vector<uint32_t>& words_;
  uint64_t at_ = 0;
  size_t cell_ = 0;
};

/// The cells of the only object of a file, coded in any way.
class OtherCells {
 public:
  explicit OtherCells(const Bytes& file) : file_(file), view_(format::read_asset(file_, "file")) {}

  const kernels::PlanesField& grid() const { return view_.objects[0].planes->field; }
  bool are_coded() const { return view_.objects[0].planes->coded & format::kCodedCells; }
  bool states_kinds() const {
    const format::SideRegions sides(grid());
    const std::vector<uint32_t> all = words();
    for (uint32_t i = 0; i < all.size(); ++i) {
      const uint32_t kind = kernels::word_kind(all[i]);
      if (kind != kernels::kLink && format::proven_kind(sides, i, format::separates(kind)) != kind)
        return true;
    }
    return false;
  }
  std::vector<uint32_t> words() const {
    std::vector<uint32_t> all(grid().voxel_records, grid().voxel_records + grid().surface_voxels);
    all.insert(all.end(), grid().children, grid().children + grid().child_count);
    return all;
  }
  Bytes with(const Bytes& cells, uint32_t forms) const {
    const Bytes file = with_payload(file_, test::payload::kCells, [&](Bytes& payload) { payload = cells; });
    return test::with_record<PlanesRecord>(file, format::kPlanes, 0, [&](auto& record) {
      record.forms = (record.forms & format::kCodedOccupancy) | forms;
    });
  }

 private:
  const Bytes file_;
  const format::AssetView view_;
};

/// Of 3 x 3 x 3 voxels with surface, all with the same planes, and the one in the middle perhaps without.
format::Asset cube_of_voxels(uint32_t word, bool inside) {
  format::PlanesData grid;
  grid.voxels = {3, 3, 3};
  grid.voxels_per_unit = 1;
  grid.brick_table = {kernels::kFirstMixedBrick};
  grid.voxel_base = {0};
  constexpr uint32_t kMiddle = 1 + 4 + 16;
  kernels::BrickStates states{};
  if (inside) states.aux = uint64_t{1} << kMiddle;
  for (uint32_t bit = 0; bit < 43; ++bit) {
    if (bit % 4 == 3 || bit / 4 % 4 == 3 || (inside && bit == kMiddle)) continue;
    states.surface |= uint64_t{1} << bit;
    grid.voxel_records.push_back(word);
  }
  grid.brick_states = {states};
  grid.coded = format::kCodedPlanes;
  format::Asset asset;
  format::Object& object = asset.objects.emplace_back();
  object.aabb_min = {1, 1, 1};
  object.aabb_max = {2, 2, 2};
  object.planes = std::move(grid);
  return asset;
}

/// The planes at the left of the one inside tell outside from inside; all others prove nothing.
format::Asset shell_of_voxels() {
  format::Asset asset = cube_of_voxels(kernels::kBareCell, true);
  constexpr uint32_t kInsideAbove = 7, kLeft = 9 + 3;
  asset.objects[0].planes->voxel_records[kLeft] = kernels::make_planes(kInsideAbove, 62, 62, 100, 156);
  return asset;
}

/// Everything is outside, and normals lie nearly in the plane z = 0.
format::Asset slanted_voxels() {
  constexpr uint32_t kOutsideBoth = 5;
  return cube_of_voxels(kernels::make_planes(kOutsideBoth, 60, 57, 100, 156), false);
}

/// Only our writer makes one code of given contents: bare cells are said to be bare, normals are turned where
/// that brings them nearer, and cells between outside and inside separate. A reader takes the others, too.
TEST(Coded, IsReadIfItIsCodedOtherwise) {
  uint64_t bare = 0, turned = 0, separating = 0;
  for (uint64_t seed = 0; seed < 8; ++seed) {
    SCOPED_TRACE(seed);
    test::RandomAssetOptions options{.objects = 0, .instances = 0, .max_voxels = 3, .proofs = 1};
    options.coded = test::kCodedAll;
    const Bytes file = format::encode(seed == 0   ? shell_of_voxels()
                                      : seed == 1 ? slanted_voxels()
                                                  : test::random_asset(seed, options));
    const OtherCells cells(file);
    const std::vector<uint32_t> truth = cells.words();
    if (cells.states_kinds()) continue;
    for (uint64_t other = 0, bits = 1; other < bits; ++other) {
      std::vector<uint32_t> words(truth.size(), format::kUnknownWord);
      OtherEncoder encoder(other, words);
      const bool done = format::CellCoder(encoder, cells.grid(), words.data()).code(&cells.grid(), false);
      bits = std::max(bits, encoder.bits());
      const auto without_kind = [](uint32_t word) { return word >> 4; };
      if (!done || !std::ranges::equal(words, truth, {}, without_kind, without_kind)) continue;
      const Bytes changed = cells.with(encoder.finish(), format::kCodedCells);
      const uint32_t word = truth[encoder.cell()], kind = kernels::word_kind(words[encoder.cell()]);
      const bool other_kind =
          kind != kernels::kLink && format::separates(kind) != format::separates(kernels::word_kind(word));
      if (other_kind && OtherCells(changed).words() != truth) continue;  // it says something else
      ++(other_kind ? separating : (word & ~15u) == kernels::kBareCell ? bare : turned);
      const Bytes ours = written_again(changed);
      EXPECT_TRUE(OtherCells(ours).words() == truth) << other;
      EXPECT_TRUE(ours == file || !cells.are_coded()) << other;
    }
  }
  EXPECT_GT(bare, 0u);
  EXPECT_GT(turned, 0u);
  EXPECT_GT(separating, 0u);
}

TEST(Coded, MayStateKindsThatFollow) {
  const Bytes file = format::encode(shell_of_voxels());
  const OtherCells cells(file);
  std::vector<uint32_t> words(cells.words().size());
  RangeEncoder encoder;
  ASSERT_TRUE(format::CellCoder(encoder, cells.grid(), words.data()).code(&cells.grid(), true));
  const Bytes stated = cells.with(encoder.finish(), format::kCodedCells | format::kStatedKinds);
  EXPECT_NE(stated, file);
  EXPECT_EQ(written_again(stated), file);
}

TEST(Coded, MayBeNoSmaller) {
  format::Asset asset = coded_asset(test::kCodedAll - 1, 1);
  NetworkData& network = *asset.objects[0].network;
  test::Random random(1);
  for (int8_t& feature : network.features) feature = int8_t(random.between(-127, 127));
  const Bytes file = format::encode(asset);
  ASSERT_EQ(forms_of(file, 0).network & format::kCodedFeatures, 0u);
  RangeEncoder encoder;
  std::vector<int8_t> same(network.features.size());
  format::code_features(encoder, same.size(), network.features_per_corner, network.features.data(),
                        same.data());
  const Bytes coded = encoder.finish();
  ASSERT_GE(coded.size(), same.size());
  const Bytes changed = test::with_record<NetworkRecord>(
      with_payload(file, test::payload::kFeatures, [&](Bytes& payload) { payload = coded; }),
      format::kNetworks, 0, [](auto& record) { record.forms |= format::kCodedFeatures; });
  EXPECT_EQ(written_again(changed), file);
}

/// Empty arrays have no memory.
TEST(Coded, MayHaveNoSurface) {
  format::Asset asset = coded_asset(test::kCodedAll - 1, 1);
  PlanesData& data = *asset.objects[0].planes;
  NetworkData& network = *asset.objects[0].network;
  data.voxels = {24, 24, 24};
  data.brick_table.assign(7 * 7 * 7, 2);
  data.brick_states = {}, data.voxel_base = {}, data.voxel_records = {}, data.children = {};
  network.brick_corners = {}, network.corner_base = {}, network.features = {};
  network.corners = 0;
  const Bytes file = format::encode(asset);
  EXPECT_EQ(format::encode(format::to_asset(format::read_asset(file, "file"))), file);
}

/// A fully coded file of one object, and ways to change it.
class CodedFile : public testing::Test {
 protected:
  void SetUp() override {
    test::RandomAssetOptions options;
    options.objects = 1;
    options.instances = 0;
    options.coded = test::kCodedAll;
    for (uint64_t seed = 1; file_.empty(); ++seed) {
      asset_ = test::random_asset(seed, options);
      if (asset_.objects[0].planes->children.empty()) continue;
      file_ = format::encode(asset_);
      if (forms_of(file_, 0) != kAllCoded) file_.clear();
    }
  }

  Bytes with(const test::PayloadKind& kind, const std::function<void(Bytes&)>& change) const {
    return with_payload(file_, kind, change);
  }
  Bytes with_planes(const std::function<void(PlanesRecord&)>& change) const {
    return test::with_record<PlanesRecord>(file_, format::kPlanes, 0, change);
  }
  Bytes with_network(const std::function<void(NetworkRecord&)>& change) const {
    return test::with_record<NetworkRecord>(file_, format::kNetworks, 0, change);
  }
  static void expect_refused(const Bytes& file, const std::string& why) {
    const test::ExactBuffer exact(file);
    const test::ReadOutcome outcome = test::outcome_of(exact.bytes());
    EXPECT_EQ(outcome.status, Status::damaged_nif);
    EXPECT_NE(outcome.sentence.find(", record 0: "), std::string::npos) << outcome.sentence;
    EXPECT_NE(outcome.sentence.find(why), std::string::npos) << outcome.sentence;
  }

  format::Asset asset_;
  Bytes file_;
};

constexpr std::pair<const char*, test::PayloadKind> kCodedPayloads[] = {
    {"occupancy", test::payload::kOccupancy},
    {"cells", test::payload::kCells},
    {"features", test::payload::kFeatures}};

TEST_F(CodedFile, ThatEndsEarlyOrLateIsRefused) {
  for (const auto& [name, section] : kCodedPayloads) {
    SCOPED_TRACE(name);
    std::vector<test::Part> parts = test::parts_of(file_);
    const size_t bytes = test::payload_of(parts, section, 0).size();
    for (const size_t missing : {5, 8})
      expect_refused(with(section, [&](Bytes& payload) { payload.resize(bytes - missing); }),
                     "is not what an encoder makes");
    for (const size_t more : {size_t{1}, size_t{4}})
      for (const unsigned value : {0u, 255u})
        expect_refused(with(section, [&](Bytes& payload) { payload.resize(bytes + more, std::byte(value)); }),
                       "is not what an encoder makes");
    // It may be less than a sixteenth of its decoded size.
    expect_refused(with(section, [&](Bytes& payload) { payload.resize(bytes / 2); }), "");
    expect_refused(with(section, [](Bytes& payload) { payload.clear(); }), "");
    expect_refused(with(section, [](Bytes& payload) { payload.resize(1 << 20); }),
                   "is not what an encoder makes");
  }
}

TEST_F(CodedFile, WithWrongCountsIsRefused) {
  for (const int by : {-1, 1}) {
    const auto changed = [&](uint32_t PlanesRecord::*count) {
      return with_planes([&](PlanesRecord& record) { record.*count += uint32_t(by); });
    };
    expect_refused(changed(&PlanesRecord::mixed_bricks), "occupancy payload is not what an encoder makes");
    expect_refused(changed(&PlanesRecord::surface_voxels), "surface_voxels is not the number of");
    expect_refused(changed(&PlanesRecord::child_count), "cells payload is not what an encoder makes");
    expect_refused(with_network([&](auto& record) { record.corners += uint32_t(by); }),
                   "corners is not the number of bits");
  }
  expect_refused(with_planes([](auto& record) { ++record.levels; }), "");
  expect_refused(with_planes([](auto& record) { record.child_count = 1 << 20; }),
                 "payloads decode to more than 16 times their bytes");
  // An empty brick takes two bytes in an uncoded table, but almost none in a coded one.
  const uint32_t most = uint32_t(file_.size());
  expect_refused(with_planes([&](auto& record) {
                   record.levels = 0;
                   uint32_t& side = record.voxels[0] = record.voxels[1] = record.voxels[2] = 4;
                   while (side / 4 * (side / 4) * (side / 4) < most) side += 4;
                   record.voxels[1] = record.voxels[2] = side;
                 }),
                 "or have more bricks than half as many");
}

TEST_F(CodedFile, WithUnknownOrIdleFormsIsRefused) {
  const auto planes = [&](uint32_t forms) {
    return with_planes([&](auto& record) { record.forms = forms; });
  };
  const auto network = [&](uint32_t forms) {
    return with_network([&](auto& record) { record.forms = forms; });
  };
  for (const uint32_t unknown : {8u, 0x80000000u}) {
    expect_refused(planes(kAllCoded.planes | unknown), "unknown bits");
    expect_refused(network(kAllCoded.network | unknown), "unknown bits");
  }
  expect_refused(with_network([](auto& record) { record.reserved[0] = 1; }), "reserved bytes are not zero");
  expect_refused(planes(format::kCodedOccupancy | format::kStatedKinds), "states kinds");
  // Reading coded data as uncoded, or the reverse, gives something else.
  for (uint32_t forms = 0; forms <= format::kPlanesForms; ++forms)
    if (forms != kAllCoded.planes) expect_refused(planes(forms), "");
  for (uint32_t forms = 0; forms < kAllCoded.network; ++forms) expect_refused(network(forms), "");
}

/// Counts that are too large for a small payload are refused before memory is allocated.
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
  for (uint32_t bit = 0; bit < 32; ++bit) {
    for (uint32_t PlanesRecord::*count :
         {&PlanesRecord::mixed_bricks, &PlanesRecord::surface_voxels, &PlanesRecord::child_count}) {
      const Bytes changed = with_planes([&](PlanesRecord& record) { record.*count = 1u << bit; });
      EXPECT_LT(memory_for(changed), bound(changed)) << bit;
    }
    const Bytes changed = with_network([&](NetworkRecord& record) { record.corners = 1u << bit; });
    EXPECT_LT(memory_for(changed), bound(changed)) << bit;
  }
  const Bytes wide = with_planes([](auto& record) {
    record.levels = 0;
    for (uint32_t& voxels : record.voxels) voxels = 256;
  });
  EXPECT_LT(memory_for(wide), bound(wide));
}

TEST(Coded, LeavesPayloadsThatCodingDoesNotHelp) {
  test::RandomAssetOptions options{.objects = 1, .max_voxels = 40, .features = 8};
  options.coded = test::kCodedAll;
  format::Asset asset = test::random_asset(3, options);
  PlanesData& planes = *asset.objects[0].planes;
  std::vector<int8_t>& features = asset.objects[0].network->features;
  EXPECT_EQ(forms_of(format::encode(asset), 0), kAllCoded);
  test::Random random(1);
  for (int8_t& feature : features) feature = int8_t(random.between(-127, 127));
  EXPECT_EQ(forms_of(format::encode(asset), 0), (Forms{format::kCodedPlanes, format::kCornersAround}));
  // To less than a sixteenth.
  std::ranges::fill(features, int8_t{5});
  planes.levels = 0;
  format::leave_bare(planes);
  EXPECT_EQ(forms_of(format::encode(asset), 0), Forms());
}

/// Coded tables have the same limits as uncoded ones. Otherwise a small file could take much memory, because
/// loading builds a word for each voxel.
TEST(Coded, HasTwoBytesForEachBrick) {
  test::RandomAssetOptions options{.objects = 1, .features = 8};
  options.coded = test::kCodedAll;
  for (const uint32_t side : {4u, 60u}) {
    format::Asset asset = test::random_asset(3, options);
    PlanesData& data = *asset.objects[0].planes;
    NetworkData& network = *asset.objects[0].network;
    const uint32_t bricks = format::bricks_for(side);
    data.levels = 0;
    data.voxels = {side, side, side};
    data.brick_table.assign(size_t{bricks} * bricks * bricks, 0);
    data.brick_table[0] = kernels::kFirstMixedBrick;
    data.brick_states = {{0x7fffffffffffffffu, 0}};
    format::leave_bare(data);
    test::Random random(1);
    for (uint32_t& word : data.voxel_records) word = test::random_planes(random);
    network.brick_corners = {~uint64_t{0}};
    network.corner_base = {0};
    network.corners = 64;
    network.features.resize(8 * 64);
    EXPECT_EQ(forms_of(format::encode(asset), 0).planes != 0, side == 4) << side;
  }
}

/// Coding repairs nothing: data that a reader would refuse is refused by the writer, coded or not.
TEST_F(CodedFile, IsNotMadeOfDamagedData) {
  const auto refused = [&](const std::function<void(PlanesData&, NetworkData&)>& damage) {
    format::Asset damaged = asset_;
    damage(*damaged.objects[0].planes, *damaged.objects[0].network);
    std::string sentences[2];
    for (const uint32_t coded : {0u, test::kCodedAll}) {
      test::set_coded(coded, damaged.objects[0]);
      try {
        format::encode(damaged);
        ADD_FAILURE() << "was written";
      } catch (const Error& error) {
        sentences[coded != 0] = error.what();
      }
    }
    EXPECT_EQ(sentences[0], sentences[1]);
  };
  refused([](auto& planes, auto&) { planes.voxel_records[0] = kernels::kEmptyVoxel; });
  refused([](auto& planes, auto&) { planes.voxel_records[0] |= 63u << 4; });
  refused([](auto& planes, auto&) { planes.children.pop_back(); });
  refused([](auto& planes, auto&) { planes.children.push_back(kernels::kBareCell); });
  refused([](auto& planes, auto&) { planes.children[0] = kernels::make_link(255, 0); });
  refused([](auto& planes, auto&) { ++planes.voxel_base.back(); });
  refused([](auto& planes, auto&) { planes.brick_table[0] = 0xffff; });
  refused([](auto& planes, auto&) { planes.brick_states[0].surface ^= 1; });
  refused([](auto& planes, auto&) { planes.brick_table.pop_back(); });
  refused([](auto& planes, auto&) { planes.levels = 9; });
  refused([](auto& planes, auto&) { planes.voxels[2] = 300; });
  refused([](auto&, auto& network) { ++network.corners; });
  refused([](auto&, auto& network) { ++network.corner_base.back(); });
  refused([](auto&, auto& network) { network.features.pop_back(); });
  refused([](auto&, auto& network) { network.features[0] = -128; });
}

}  // namespace
}  // namespace nif
