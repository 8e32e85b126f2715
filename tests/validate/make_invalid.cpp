// make_invalid FOLDER: writes NUMBER-NAME.nif for each number that `nif validate` knows and of which the
// folder has no file: a small file about which that is found. Files that are there are never made anew: a
// number means the same for ever.
//
// What a rule needs is written down where chance would not find it; the rest is searched for, by changes of
// single fields, words and bits of small files with right checksums. The smallest file that breaks a rule is
// kept.
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <functional>
#include <map>
#include <string>

#include "formats/base/output_file.hpp"
#include "formats/nif/writer.hpp"
#include "formats/validate/validate.hpp"
#include "tests/format/damaged.hpp"
#include "tests/support/random_asset.hpp"

namespace nif::test {
namespace {

using format::Rule, validate::Advice;

/// Small assets of one encoding each, coded and not, with all that is optional.
std::vector<format::Asset> assets() {
  std::vector<format::Asset> all;
  for (const uint32_t coded : {0u, 7u})
    for (uint64_t seed = 1; seed <= 4; ++seed)
      for (uint32_t kind = 0; kind < 7; ++kind) {
        RandomAssetOptions options;
        options.objects = kind == 0 ? 2 : 0;
        options.instances = seed % 2 ? 1 : 0;
        options.max_voxels = 6;
        options.features = 1;
        options.bvhs = kind == 1;
        options.exacts = kind == 2;
        options.proofs = kind == 3;
        options.sphericals = kind == 4 ? 2 : 0;
        options.primaries = kind == 4;
        options.sources = kind == 1;
        options.colors = kind == 3;
        options.numbers = kind == 2;
        options.coded = coded;
        if (kind == 5) options.bvhs = 2;
        options.cutouts = kind == 6;
        all.push_back(random_asset(seed, options));
      }
  return all;
}

class Collection {
 public:
  explicit Collection(std::filesystem::path folder) : folder_(std::move(folder)) {}

  /// Keeps the file for its finding if it is the smallest so far.
  void offer(const Bytes& file) {
    const ExactBuffer buffer(file);
    const validate::Findings findings = validate::validate(buffer.bytes(), "x.nif");
    if (findings.kept().empty()) return;
    // A file that breaks a rule has no other finding.
    for (const validate::Finding& finding : findings.kept()) keep(finding.entry->number, file);
  }

  void write() const {
    for (const validate::Entry& entry : validate::all_entries()) {
      const std::string path = folder_ / (std::to_string(entry.number) + "-" + entry.name + ".nif");
      if (std::filesystem::exists(path)) continue;
      const auto found = smallest_.find(entry.number);
      if (found == smallest_.end()) {
        std::fprintf(stderr, "make_invalid: no file breaks %u (%s)\n", entry.number, entry.name);
        continue;
      }
      write_output(path, found->second);
    }
  }

 private:
  void keep(uint16_t number, const Bytes& file) {
    const auto [at, fresh] = smallest_.emplace(number, file);
    if (!fresh && file.size() < at->second.size()) at->second = file;
  }

  std::filesystem::path folder_;
  std::map<uint16_t, Bytes> smallest_;
};

Bytes text_file(std::string_view text) {
  const auto bytes = std::as_bytes(std::span(text));
  return {bytes.begin(), bytes.end()};
}

/// Breaks the shell of a file.
void break_shell(const Bytes& good, Collection& collection) {
  collection.offer({});
  collection.offer(text_file("NetImmerse File Format, Version 4.0.0.2\n"));
  collection.offer(text_file("solid cube\n"));
  Bytes dos;
  for (const std::byte b : good) {
    if (b == std::byte{'\n'}) dos.push_back(std::byte{'\r'});
    dos.push_back(b);
  }
  collection.offer(dos);
  collection.offer(Bytes(good.begin(), good.begin() + 40));
  collection.offer(Bytes(good.begin(), good.end() - 10));
  Bytes longer = good;
  longer.resize(good.size() + 10);
  collection.offer(longer);

  const auto with_header = [&](const std::function<void(format::Header&)>& change, bool right) {
    Bytes file = good;
    auto header = load<format::Header>(file, 0);
    change(header);
    header.header_crc = 0;
    if (right) header.header_crc = format::crc32c(std::as_bytes(std::span(&header, 1)));
    store(file, 0, header);
    collection.offer(file);
  };
  with_header([](auto&) {}, false);
  with_header([](auto& h) { h.version = 3; }, true);
  with_header([](auto& h) { h.reserved[0] = 1; }, true);
  with_header([](auto& h) { h.flags = 2; }, true);
  with_header([](auto& h) { h.arithmetic = 0; }, true);
  with_header([](auto& h) { h.prover = 0; }, true);
  with_header([](auto& h) { h.flags = format::kPlacesNothing; }, true);
  with_header([](auto& h) { h.section_count = 0; }, true);
  with_header([](auto& h) { h.table_crc ^= 1; }, true);
  Bytes short_file(good.begin(), good.begin() + sizeof(format::Header));
  auto header = load<format::Header>(short_file, 0);
  header.file_bytes = short_file.size();
  header.header_crc = 0;
  header.header_crc = format::crc32c(std::as_bytes(std::span(&header, 1)));
  store(short_file, 0, header);
  collection.offer(short_file);

  const auto with_entry = [&](uint32_t index, const std::function<void(format::SectionEntry&)>& change) {
    Bytes file = good;
    auto entry = section_entry(file, index);
    change(entry);
    store_entry(file, index, entry);
    fix_checksums(file);
    collection.offer(file);
  };
  const uint32_t last = load<format::Header>(good, 0).section_count - 1;
  with_entry(0, [](auto& e) { e.offset += 64; });
  with_entry(0, [](auto& e) { e.flags ^= format::kRequired; });
  with_entry(last, [](auto& e) { e.bytes += 1; });
  with_entry(last, [](auto& e) { e.bytes -= 1; });
  for (uint32_t i = 0; i < last; ++i) {
    const auto entry = section_entry(good, i);
    if (format::aligned(entry.offset + entry.bytes) == entry.offset + entry.bytes) continue;
    Bytes file = good;
    file[entry.offset + entry.bytes] = std::byte{1};
    collection.offer(file);
  }
  for (uint32_t i = 0; i <= last; ++i) {  // of a section, of a payload
    Bytes wrong = good;
    wrong[section_entry(good, i).offset] ^= std::byte{1};
    collection.offer(wrong);
  }
  Bytes with_two = good;
  auto data = section_entry(good, find_section(good, format::kData));
  data.crc = 1;
  store_entry(with_two, find_section(good, format::kData), data);
  header = load<format::Header>(good, 0);
  header.table_crc = format::crc32c(std::span<const std::byte>(with_two).subspan(
      sizeof(header), header.section_count * sizeof(format::SectionEntry)));
  header.header_crc = 0;
  header.header_crc = format::crc32c(std::as_bytes(std::span(&header, 1)));
  store(with_two, 0, header);
  collection.offer(with_two);
}

/// Adds, removes and changes whole sections.
void break_sections(const Bytes& good, Collection& collection) {
  const std::vector<Part> parts = parts_of(good);
  const auto offer = [&](const std::vector<Part>& changed) { collection.offer(file_of(good, changed)); };
  for (const uint32_t flags : {0u, uint32_t{format::kRequired}}) {
    std::vector<Part> more = parts;
    more.push_back({format::fourcc("XTRA"), flags, text_file("later")});
    offer(more);
  }
  std::vector<Part> unused = parts;
  unused.push_back({format::kTriangles, format::kRequired, {}, sizeof(format::TrianglesRecord)});
  offer(unused);
  std::vector<Part> turned = parts;
  std::swap(turned.front(), turned.back());
  offer(turned);
  for (size_t i = 0; i < parts.size(); ++i) {
    std::vector<Part> twice = parts, without = parts, longer = parts, shorter = parts, empty = parts;
    twice.push_back(parts[i]);
    offer(twice);
    without.erase(without.begin() + ptrdiff_t(i));
    offer(without);
    for (const size_t bytes : {1, 8, 64}) {
      longer[i].content.resize(parts[i].content.size() + bytes);
      offer(longer);
      shorter[i].content.resize(parts[i].content.size() - std::min(bytes, parts[i].content.size()));
      offer(shorter);
    }
    empty[i].content.clear();
    offer(empty);
    if (parts[i].record_size != 0) {
      std::vector<Part> wider = parts;
      wider[i].content.resize(wider[i].count() * (parts[i].record_size + 8));
      wider[i].record_size += 8;
      if (wider[i].count() <= 1) offer(wider);
    }
    if (parts[i].type == format::kMetadata)
      for (const char* text : {"\xff", "[1]", "{", "{}"}) {
        std::vector<Part> other = parts;
        other[i].content = text_file(text);
        offer(other);
      }
    if (parts[i].type == format::kNames && !parts[i].content.empty()) {
      std::vector<Part> other = parts;
      other[i].content[0] = std::byte{0xff};
      offer(other);
    }
  }
  // One more record of each part, which no object uses.
  for (size_t i = 0; i < parts.size(); ++i)
    for (const size_t record : {sizeof(format::PlanesRecord), sizeof(format::TrianglesRecord)}) {
      if (parts[i].content.size() < record) continue;
      std::vector<Part> more = parts;
      more[i].content.insert(more[i].content.end(), parts[i].content.end() - ptrdiff_t(record),
                             parts[i].content.end());
      offer(more);
    }
}

/// Values that are often wrong for a number in a file.
constexpr uint32_t kWords[] = {0,          1,          2,          3,          4,          5,
                               6,          14,         15,         31,         32,         33,
                               64,         77,         128,        129,        255,        257,
                               300,        2049,       65534,      0xffff,     0x100001,   0x7fc00000,
                               0x7f800000, 0x7f61b1e6, 0xbf800000, 0x45800001, 0x80000000, 0xffffffff};

/// One change of a field, a word or a bit.
Bytes changed(const Bytes& good, Random& random) {
  std::vector<Part> parts = parts_of(good);
  Part& part = parts[random.below(uint32_t(parts.size()))];
  if (part.content.empty()) return good;
  const uint32_t width = 1u << random.below(3);
  const size_t at = random.below(uint32_t(part.content.size() / width)) * width;
  if (part.content.size() < width) return good;
  uint32_t word = 0;
  std::memcpy(&word, part.content.data() + at, width);
  switch (random.below(3)) {
    case 0:
      word = kWords[random.below(std::size(kWords))];
      break;
    case 1:
      word ^= 1u << random.below(8 * width);
      break;
    default:
      word += uint32_t(random.between(-2, 2));
  }
  std::memcpy(part.content.data() + at, &word, width);
  return file_of(good, parts);
}

/// Files that random changes do not find.
void break_content(Collection& collection) {
  RandomAssetOptions options;
  options.objects = 1;
  options.instances = 1;
  options.max_voxels = 6;
  options.features = 1;
  const auto with = [&](const std::function<void(format::Asset&)>& change) {
    for (uint64_t seed = 1; seed <= 8; ++seed) {
      format::Asset asset = random_asset(seed, options);
      change(asset);
      collection.offer(format::encode(asset));
    }
  };
  with([](auto& a) { a.metadata.clear(); });
  with([](auto& a) {
    for (const size_t k : {0, 1, 2}) a.instances[0].transform[k] = 0;
  });
  with([](auto& a) { a.instances[0].transform[0] = 1e6f; });
  with([](auto& a) { a.objects[0].bias = 1e9f; });
  with([](auto& a) { a.objects[0].aabb_max[0] += 1e6f; });
  with([](auto& a) {
    a.instances[0].object = 0;
    a.objects.push_back(a.objects[0]);
  });
  with([](auto& a) { a.mlps.push_back(a.mlps[0]); });
  with([](auto& a) {
    auto& weights = a.mlps[0].layers.back().weights;
    std::fill(weights.begin(), weights.end(), int8_t{0});
  });
  with([](auto& a) {
    for (uint32_t& word : a.objects[0].planes->voxel_records)
      if (kernels::word_kind(word) != kernels::kLink) word &= ~15u;
  });
  options.odd_corners = true;
  with([](auto&) {});
  options.odd_corners = false;

  // Metadata with too few members, too many, or about something else.
  const auto says = [&](const std::string& text) { with([&](auto& a) { a.metadata = text; }); };
  const std::string start =
      R"({"tool":{"name":"nifkit","version":"0"},"seed":1,"options":{"encoding":"segment"},"source":{"hash":""},)";
  says(start + R"("accuracy":{"sun":{"rays":-1}},"objects":[]})");
  says(
      start +
      R"("accuracy":{"sun":{"rays":10,"error":0,"leak":0,"spurious":0,"certain":1,"certain_wrong":3,"brier":0}},)" +
      R"("objects":[{"name":"another","bias":-1}]})");
  says(start +
       R"("accuracy":{},"objects":[{}],"hierarchy":{"nodes":[{"node":1,"parent":2}],"instances":[7]}})");
  says(start + R"("accuracy":{},"objects":[{}],"merge":{"objects":[{"instance":5}]}})");

  options.objects = 0;
  options.bvhs = 1;
  with([](auto& a) { a.objects[0].triangle_count = 0; });
  with([](auto& a) { a.objects[0].aabb_max[1] = a.objects[0].aabb_min[1]; });
}

/// Links that name more parts than there are.
void break_links(const Bytes& good, Collection& collection) {
  const std::vector<Part> parts = parts_of(good);
  std::vector<Part> changed = parts;
  const Bytes words = payload_of(changed, payload::kCells, 0);
  for (size_t at = 0; at < words.size(); at += 4)
    for (uint32_t part = 0; part < 8; ++part) {
      const uint32_t word = load<uint32_t>(words, at) | 1u << (4 + part);
      if (kernels::word_kind(word) != kernels::kLink) continue;
      Bytes other = words;
      store(other, at, word);
      set_payload(changed = parts, payload::kCells, 0, other);
      collection.offer(file_of(good, changed));
    }
}

/// A table with more bricks than there are, and numbers too large for a grid.
void break_grid(const format::Asset& asset, Collection& collection) {
  const Bytes good = format::encode(asset);
  const std::vector<Part> parts = parts_of(good);
  std::vector<Part> changed = parts;
  auto record = load<format::PlanesRecord>(section_of(changed, format::kPlanes).content, 0);
  Bytes occupancy = payload_of(changed, payload::kOccupancy, 0);
  const auto last = load<uint16_t>(occupancy, occupancy.size() - 2);
  if (last < kernels::kFirstMixedBrick) {
    store(occupancy, occupancy.size() - 2, uint16_t(kernels::kFirstMixedBrick + record.mixed_bricks));
    set_payload(changed, payload::kOccupancy, 0, occupancy);
    collection.offer(file_of(good, changed));
  }
  record.voxels_per_unit = 3e38f;
  record.levels = kernels::kMaxLevels;
  store(section_of(changed = parts, format::kPlanes).content, 0, record);
  collection.offer(file_of(good, changed));
}

/// The record and payload of the triangles of a file with one tree.
struct Tree {
  std::vector<Part> parts;
  format::TrianglesRecord record;
  Bytes content;

  explicit Tree(const Bytes& file) : parts(parts_of(file)) {
    record = load<format::TrianglesRecord>(section_of(parts, format::kTriangles).content, 0);
    content = payload_of(parts, payload::kTree, 0);
  }
  void offer(const Bytes& file, Collection& collection) {
    store(section_of(parts, format::kTriangles).content, 0, record);
    set_payload(parts, payload::kTree, 0, content);
    collection.offer(file_of(file, parts));
  }
};

/// A frame whose planes are at base * 2^(scale - 127) and so on.
constexpr uint32_t frame_of(int32_t base, uint32_t scale) { return uint32_t(base) << 8 | scale; }

void break_tree(const Bytes& good, Collection& collection) {
  const Tree tree(good);
  const size_t nodes = tree.record.nodes * sizeof(kernels::BvhNode);
  auto empty = tree;
  empty.record.nodes = empty.record.vertices = empty.record.triangles = 0;
  empty.content.clear();
  empty.offer(good, collection);
  auto node = tree;
  node.content.insert(node.content.begin() + ptrdiff_t(nodes), sizeof(kernels::BvhNode), std::byte{0});
  node.record.nodes += 1;
  node.offer(good, collection);
  auto triangle = tree;
  triangle.content.resize(triangle.content.size() + 3);
  triangle.record.triangles += 1;
  triangle.offer(good, collection);
  auto large = tree;
  auto root = load<kernels::BvhNode>(large.content, 0);
  for (uint32_t& frame : root.frame) frame = frame_of(-128, 187);
  store(large.content, 0, root);
  large.offer(good, collection);
  if (tree.record.nodes != 1) return;
  // A chain of nodes above the existing one, longer than a path may be.
  auto deep = tree;
  constexpr uint32_t kChain = kernels::kMaxBvhDepth;
  Bytes chain(kChain * sizeof(kernels::BvhNode));
  for (uint32_t i = 0; i < kChain; ++i) {
    kernels::BvhNode above{};
    std::copy_n(load<kernels::BvhNode>(tree.content, 0).frame, 3, above.frame);
    above.first_node = i + 1;
    above.slots[0] = uint8_t(kernels::kInnerSlot << 5);
    for (auto& ends : above.high) ends[0] = 255;
    store(chain, i * sizeof(above), above);
  }
  deep.content.insert(deep.content.begin(), chain.begin(), chain.end());
  deep.record.nodes += kChain;
  deep.offer(good, collection);
}

/// A tree of one node whose boxes exceed the range of exact objects.
void break_reach(const Bytes& good, Collection& collection) {
  Tree tree(good);
  if (tree.record.nodes != 1) return;
  auto root = load<kernels::BvhNode>(tree.content, 0);
  for (int a = 0; a < 3; ++a) {
    root.frame[a] = frame_of(-128, 127 + 36);
    for (uint32_t s = 0; s < kernels::kBvhWidth && root.slots[s] != 0; ++s)
      root.low[a][s] = 0, root.high[a][s] = 255;
  }
  store(tree.content, 0, root);
  tree.offer(good, collection);
}

/// Source triangles and colours for an object that cannot have them.
void break_optional(Collection& collection) {
  RandomAssetOptions options;
  options.objects = options.instances = 0;
  options.max_voxels = 6;
  options.bvhs = options.proofs = options.sources = options.colors = 1;
  const Bytes good = format::encode(random_asset(1, options));
  collection.offer(with_record<format::NumbersRecord>(good, format::kNumbersRecords, 0,
                                                      [](auto& record) { record.object = 1; }));
  collection.offer(with_record<format::ColorsRecord>(good, format::kColorRecords, 0,
                                                     [](auto& record) { record.object = 0; }));
}

/// A map of clear tiles.
void add_clear_map(uint32_t side, format::AlphaMaps& maps) {
  kernels::AlphaMap map;
  map.width = map.height = side;
  maps.add(map, std::make_shared<std::vector<uint64_t>>(kernels::alpha_tiles(side, side)));
}

/// Alpha maps, and the places of triangles in them.
void break_holes(Collection& collection) {
  RandomAssetOptions options;
  options.objects = options.instances = 0;
  options.cutouts = 1;
  for (uint64_t seed = 1; seed <= 20; ++seed) {
    format::Asset asset = random_asset(seed, options);
    asset.alpha_maps.clear();
    add_clear_map(1, asset.alpha_maps);
    format::HolesData holes;
    holes.patches = {{}};
    holes.set_numbers(std::vector<uint32_t>(asset.objects[0].triangles->triangles.size(), 1));
    asset.objects[0].holes = holes;
    const Bytes good = format::encode(asset);
    const auto map = [&](const std::function<void(format::AlphaMapRecord&)>& change) {
      collection.offer(with_record<format::AlphaMapRecord>(good, format::kAlphaMaps, 0, change));
    };
    map([](auto& r) { r.width = 0; });
    map([](auto& r) { r.wrap[1] = kernels::kAlphaWraps; });
    const auto with = [&](const std::function<void(format::HolesData&)>& change) {
      format::HolesData changed = holes;
      change(changed);
      collection.offer(with_holes(good, 0, changed));
    };
    with([](auto& h) { h.patches[0].map = 1; });
    with([](auto& h) { h.patches[0].shift = kernels::kAlphaFraction + 1; });
    with([](auto& h) {
      h.patches.resize(h.triangles + 1);
      h.set_numbers(std::vector<uint32_t>(h.triangles));
    });
    with([](auto& h) {
      h.patches.resize(2);  // so numbers of two bits
      h.set_numbers(std::vector<uint32_t>(h.triangles, 3));
    });
    add_clear_map(1, asset.alpha_maps);
    collection.offer(format::encode(asset));
  }
  // More tiles than a file may have.
  format::Asset large = random_asset(1, options);
  large.alpha_maps.clear();
  for (int i = 0; i < 4; ++i) add_clear_map(kernels::kMaxAlphaSide, large.alpha_maps);
  const Bytes good = format::encode(large);
  std::vector<Part> parts = parts_of(good);
  Part& maps = section_of(parts, format::kAlphaMaps);
  maps.content.insert(maps.content.end(), maps.content.end() - ptrdiff_t(maps.record_size),
                      maps.content.end());
  collection.offer(file_of(good, parts));
}

/// Skins that do not go with their objects, and values that are out of range.
void break_skins(Collection& collection) {
  RandomAssetOptions options;
  options.objects = options.instances = 0;
  options.max_voxels = 6;
  options.exacts = options.bvhs = options.skins = 1;
  format::Asset asset = random_asset(1, options);
  Random random(1);
  format::Skin& skin = *asset.objects[0].skin;
  skin = random_skin(random, skin.vertex_count, 4, 1);
  const Bytes good = format::encode(asset);
  const auto record = [&](const std::function<void(format::SkinRecord&)>& change) {
    collection.offer(with_record<format::SkinRecord>(good, format::kSkinRecords, 0, change));
  };
  record([](auto& r) { r.object = 1; });
  record([](auto& r) { ++r.vertices; });
  record([](auto& r) { r.joints = kernels::kMostJoints + 1; });
  record([](auto& r) { r.influences = 5; });
  const auto value = [&](const std::function<void(format::Skin&)>& change) {
    format::Skin changed = skin;
    change(changed);
    collection.offer(with_skin(good, 0, changed));
  };
  value([](auto& s) { s.weights[0] = 2; });
  value([](auto& s) { s.joints[0] = uint16_t(s.joint_count); });
  value([](auto& s) { s.targets[0][0] = 2 * format::kMostMove; });
}

/// Levels, instances and flags that contradict each other, or that are unknown.
void break_placing(Collection& collection) {
  const Bytes good =
      format::encode(random_asset(1, {.objects = 0, .instances = 2, .max_voxels = 4, .bvhs = 2}));
  const auto object = [&](const std::function<void(format::ObjectRecord&)>& change) {
    collection.offer(with_record<format::ObjectRecord>(good, format::kObjects, 0, change));
  };
  object([](auto& r) { r.level = 2; });
  object([](auto& r) { r.level = 1; });
  object([](auto& r) { r.error = -1; });
  object([](auto& r) { r.flags = format::kDeforms; });
  const auto instance = [&](const std::function<void(format::InstanceRecord&)>& change) {
    collection.offer(with_record<format::InstanceRecord>(good, format::kInstances, 0, change));
  };
  instance([](auto& r) { r.translation[0] = 1.0 / 3; });
  instance([](auto& r) { r.parent = 1; });
  // A coarser level that is placed.
  format::Asset levels = random_asset(1, {.objects = 0, .instances = 1, .max_voxels = 4, .bvhs = 2});
  levels.objects[0].level = 1;
  levels.instances[0].object = 1;
  collection.offer(with_record<format::InstanceRecord>(format::encode(levels), format::kInstances, 0,
                                                       [](auto& r) { r.object = 0; }));
}

void break_by_hand(Collection& collection) {
  RandomAssetOptions options;
  options.objects = options.instances = 0;
  options.max_voxels = 6;
  for (uint64_t seed = 1; seed <= 60; ++seed) {
    RandomAssetOptions grid = options, segment = options, tree = options, exact = options;
    segment.objects = 1;
    grid.proofs = tree.bvhs = exact.exacts = 1;
    break_grid(random_asset(seed, grid), collection);
    break_links(format::encode(random_asset(seed, segment)), collection);
    break_tree(format::encode(random_asset(seed, tree)), collection);
    break_reach(format::encode(random_asset(seed, exact)), collection);
  }
  break_optional(collection);
  break_holes(collection);
  break_skins(collection);
  break_placing(collection);
}

void make(const std::filesystem::path& folder, uint32_t tries) {
  Collection collection(folder);
  break_content(collection);
  break_by_hand(collection);
  Random random(1);
  for (const format::Asset& asset : assets()) {
    const Bytes good = format::encode(asset);
    collection.offer(good);
    break_shell(good, collection);
    break_sections(good, collection);
    for (uint32_t i = 0; i < tries; ++i) collection.offer(changed(good, random));
  }
  collection.write();
}

}  // namespace
}  // namespace nif::test

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fprintf(stderr, "usage: make_invalid FOLDER [TRIES]\n");
    return int(nif::Status::usage);
  }
  try {
    nif::test::make(argv[1], argc > 2 ? uint32_t(std::stoul(argv[2])) : 4000);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "make_invalid: %s\n", error.what());
    return int(nif::Status::internal);
  }
}
