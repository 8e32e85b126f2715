// `bvh` objects in a file: what is written is what is read, each wrong field is refused, and files without
// such objects are what they were.
#include <gtest/gtest.h>

#include <functional>

#include "formats/nif/reader.hpp"
#include "formats/nif/triangles/check_triangles.hpp"
#include "formats/nif/writer.hpp"
#include "tests/format/damaged.hpp"
#include "tests/support/query_object.hpp"

namespace nif {
namespace {

using kernels::BvhNode;
using test::Bytes, test::outcome_of;

format::Asset asset_with_bvh(uint64_t seed) {
  test::RandomAssetOptions options;
  options.objects = 1;
  options.bvhs = 2;
  return test::random_asset(seed, options);
}

TEST(BvhFile, KeepsEveryFieldAndAnswer) {
  for (uint64_t seed = 0; seed < 20; ++seed) {
    const format::Asset asset = asset_with_bvh(seed);
    const Bytes bytes = format::encode(asset);
    const format::AssetView view = format::read_asset(bytes, "file");
    EXPECT_EQ(bytes, format::encode(format::to_asset(view)));
    test::Random random(seed);
    for (size_t i = 1; i < 3; ++i) {
      const format::Object& object = asset.objects[i];
      const format::ObjectView& seen = view.objects[i];
      EXPECT_EQ(format::encoding_of(seen).number, 3u);
      EXPECT_EQ(seen.name, object.name);
      EXPECT_EQ(seen.aabb_min, object.aabb_min);
      EXPECT_EQ(seen.bias, object.bias);
      EXPECT_EQ(seen.triangle_count, object.triangle_count);
      const auto& [tree, tree_bytes] = *seen.triangles;
      EXPECT_EQ(tree_bytes, object.triangles->bytes());
      const kernels::TrianglesField field = format::field_of(*object.triangles);
      EXPECT_EQ(tree.extent, field.extent);
      for (int ray = 0; ray < 500; ++ray) {
        const kernels::Segment segment = test::random_segment(random, field);
        const kernels::Answer ours = kernels::query(field, segment), theirs = kernels::query(tree, segment);
        ASSERT_EQ(ours.logit, theirs.logit);
        ASSERT_EQ(ours.certain, theirs.certain);
      }
    }
  }
}

TEST(BvhFile, HasItsSectionsOnlyWhereTheyAreNeeded) {
  const Bytes with = format::encode(asset_with_bvh(1)), without = format::encode(test::random_asset(1));
  for (const uint32_t type : test::sections_of(format::TrianglesPart())) {
    const uint32_t index = test::find_section(with, type);
    EXPECT_EQ(test::section_entry(with, index).flags, format::kRequired);
    for (uint32_t i = 0; i < test::load<format::Header>(without, 0).section_count; ++i)
      EXPECT_NE(test::section_entry(without, i).type, type);

    // The section under an unknown type, marked as optional.
    Bytes gone = with;
    auto entry = test::section_entry(gone, index);
    entry.type = format::fourcc("GONE");
    entry.flags = 0;
    test::store_entry(gone, index, entry);
    test::fix_checksums(gone);
    EXPECT_EQ(outcome_of(gone).status, Status::damaged_nif);
    entry.type = type;
    test::store_entry(gone, index, entry);
    test::fix_checksums(gone);
    EXPECT_NE(outcome_of(gone).sentence.find("not marked as required"), std::string::npos);
  }
}

TEST(BvhFile, RefusesWrongRecords) {
  const Bytes good = format::encode(asset_with_bvh(2));
  const auto object = [&](uint32_t index, const std::function<void(format::ObjectRecord&)>& change) {
    return outcome_of(test::with_record<format::ObjectRecord>(good, format::kObjects, index, change))
               .status == Status::damaged_nif;
  };
  EXPECT_FALSE(object(1, [](auto&) {}));
  EXPECT_TRUE(object(1, [](auto& r) { std::swap(r.triangles, r.planes); }));
  EXPECT_TRUE(object(1, [](auto& r) { r.triangles = 1; }));
  EXPECT_TRUE(object(2, [](auto& r) { r.triangles = 2; }));
  const auto tree = [&](uint32_t index, const std::function<void(format::TrianglesRecord&)>& change) {
    return outcome_of(test::with_record<format::TrianglesRecord>(good, format::kTriangles, index, change))
               .status == Status::damaged_nif;
  };
  EXPECT_FALSE(tree(1, [](auto&) {}));
  EXPECT_TRUE(tree(0, [](auto& r) { r.tree.offset += 64; }));
  EXPECT_TRUE(tree(1, [](auto& r) { r.tree.bytes += 3; }));
  EXPECT_TRUE(tree(1, [](auto& r) { r.tree.offset = ~uint64_t{0} - 63; }));
  EXPECT_TRUE(tree(0, [](auto& r) { r.nodes += 1; }));
  EXPECT_TRUE(tree(0, [](auto& r) { r.nodes = 0xffffffff; }));
  EXPECT_TRUE(tree(0, [](auto& r) { r.vertices -= 1; }));
  EXPECT_TRUE(tree(0, [](auto& r) { r.triangles += 1; }));
  EXPECT_TRUE(tree(0, [](auto& r) { r.reserved = 1; }));
}

/// The fault of a tree after a change, or "".
std::string fault_after(const std::function<void(format::TrianglesData&)>& change) {
  test::Random random(3);
  format::TrianglesData bvh = test::random_bvh(random, 300);
  change(bvh);
  const auto fault = format::fault_of(format::field_of(bvh));
  return fault ? format::text_of(*fault).what : "";
}

/// The first node with both an inner slot and a leaf slot, and those slots.
struct Mixed {
  uint32_t node = 0, inner = 0, leaf = 0;
};
Mixed find_mixed(const format::TrianglesData& bvh) {
  for (Mixed m;; ++m.node) {
    m.inner = m.leaf = kernels::kBvhWidth;
    for (uint32_t s = 0; s < kernels::kBvhWidth && bvh.nodes[m.node].slots[s] != 0; ++s)
      (kernels::slot_kind(bvh.nodes[m.node].slots[s]) == kernels::kInnerSlot ? m.inner : m.leaf) = s;
    if (m.inner < kernels::kBvhWidth && m.leaf < kernels::kBvhWidth) return m;
  }
}

TEST(BvhFile, RefusesWrongTrees) {
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  // Changes of a node with both kinds of slots, and the expected message.
  const auto after = [](const std::function<void(BvhNode&, const Mixed&)>& change) {
    return fault_after([&](format::TrianglesData& bvh) {
      const Mixed mixed = find_mixed(bvh);
      change(bvh.nodes[mixed.node], mixed);
    });
  };
  const auto says = [](const std::string& fault, const char* words) {
    EXPECT_NE(fault.find(words), std::string::npos) << "'" << fault << "' and not '" << words << "'";
  };
  EXPECT_EQ(fault_after([](auto&) {}), "");
  says(after([](auto& n, auto&) { n.frame[1] = (n.frame[1] & ~0xffu) | 26; }), "scale");
  says(after([](auto& n, auto&) { n.frame[2] |= 255; }), "scale");
  says(after([](auto& n, auto&) { n.frame[0] ^= 0x40000000; }), "reaches out");
  says(after([](auto& n, auto&) { n.first_node += 1; }), "next ones");
  says(after([](auto& n, auto&) { n.first_node = 0; }), "next ones");
  says(after([](auto& n, auto&) { n.first_triangle += 1; }), "next triangles");
  says(after([](auto& n, auto&) { n.first_vertex = 0xffffffff; }), "vertex that is not there");
  says(after([](auto& n, auto& m) { n.slots[m.leaf] = kernels::make_slot(5, 0); }), "no known kind");
  says(after([](auto& n, auto& m) { n.slots[m.leaf] = uint8_t(kernels::slot_rank(n.slots[m.leaf]) | 1); }),
       "no known kind");
  says(after([](auto& n, auto& m) { n.slots[m.inner] ^= 1; }), "another rank");
  says(after([](auto& n, auto& m) { n.slots[m.leaf] ^= 1; }), "another rank");
  says(after([](auto& n, auto& m) { std::swap(n.low[0][m.leaf], n.high[0][m.leaf]); }), "inside out");
  says(after([](auto& n, auto& m) { n.high[1][m.inner] = n.low[1][m.inner]; }), "reaches out");
  says(after([](auto& n, auto& m) { n.low[2][m.leaf] = n.high[2][m.leaf]; }), "outside of its box");
  says(fault_after([](auto& bvh) { bvh.nodes[0] = {}; }), "scale");
  says(fault_after([](auto& bvh) {
         BvhNode& root = bvh.nodes[0];
         std::fill_n(root.slots, 8, uint8_t{0});
       }),
       "empty");
  says(fault_after([](auto& bvh) { bvh.nodes[0].frame[0] = 0x7fffff00u | 187; }), "too large");
  says(fault_after([](auto& bvh) {
         uint32_t node = 0;
         while (bvh.nodes[node].slots[7] != 0) ++node;
         bvh.nodes[node].high[1][7] = 1;
       }),
       "empty slot");
  says(fault_after([](auto& bvh) {
         const auto inner_only = [](const BvhNode& node) {
           return std::all_of(node.slots, node.slots + kernels::kBvhWidth, [](uint8_t slot) {
             return slot == 0 || kernels::slot_kind(slot) == kernels::kInnerSlot;
           });
         };
         std::find_if(bvh.nodes.begin(), bvh.nodes.end(), inner_only)->first_vertex = 1;
       }),
       "for no triangle");
  says(fault_after([&](auto& bvh) { bvh.vertices[7][2] = kNan; }), "outside of its box");
  says(fault_after([](auto& bvh) { bvh.vertices[9][0] += 10; }), "outside of its box");
  says(fault_after([](auto& bvh) { bvh.vertices.resize(bvh.vertices.size() - 1); }), "not there");
  says(fault_after([](auto& bvh) { bvh.nodes.emplace_back(bvh.nodes.back()); }), "belongs to no other");
  says(fault_after([](auto& bvh) { bvh.nodes.pop_back(); }), "next ones");
  says(fault_after([](auto& bvh) { bvh.triangles.emplace_back(bvh.triangles.back()); }),
       "belongs to no node");
  says(fault_after([](auto& bvh) { bvh.triangles.pop_back(); }), "next triangles");
  says(fault_after([](auto& bvh) { bvh = {}; }), "empty");
}

/// A chain of nodes; each except the last has one inner slot.
format::TrianglesData chain(uint32_t length) {
  std::vector<std::array<float, 3>> positions{{0, 0, 0}, {1, 0, 0}, {0, 1, 1}};
  std::vector<std::array<uint32_t, 3>> triangles{{0, 1, 2}};
  std::deque<format::BvhBranch> branches(length + 1);
  for (uint32_t i = 0; i < length; ++i) {
    branches[i].child_count = 1;
    branches[i].children[0] = &branches[i + 1];
  }
  branches[length].triangle_count = 1;
  return format::pack_bvh(branches[0], positions, triangles);
}

TEST(BvhFile, BoundsTheDepth) {
  format::TrianglesData deep = chain(kernels::kMaxBvhDepth);
  EXPECT_EQ(format::fault_of(format::field_of(deep)), std::nullopt);
  EXPECT_THROW(chain(kernels::kMaxBvhDepth + 1), Error);
  // One node more: the last one is split in two.
  const auto last = uint32_t(deep.nodes.size() - 1);
  BvhNode above = deep.nodes[last];
  above.slots[0] = kernels::make_slot(kernels::kInnerSlot, 0);
  above.first_node = last + 1;
  above.first_vertex = 0;
  deep.nodes.push_back(deep.nodes[last]);
  deep.nodes[last] = above;
  EXPECT_EQ(format::fault_of(format::field_of(deep)), format::Rule::tree_deep);
}

TEST(BvhFile, EveryByteOfATreeChanged) {
  test::Random random(4);
  const format::TrianglesData good = test::random_bvh(random, 40);
  const auto kSize = good.nodes.size() * sizeof(BvhNode);
  uint32_t accepted = 0;
  for (size_t at = 0; at < kSize; ++at)
    for (const unsigned flip : {0x01u, 0x20u, 0x80u, 0xffu}) {
      format::TrianglesData changed = good;
      reinterpret_cast<uint8_t*>(changed.nodes.data())[at] ^= uint8_t(flip);
      const kernels::TrianglesField field = format::field_of(changed);
      if (format::fault_of(field)) continue;
      ++accepted;
      // Accepted trees answer like their triangles: boxes may only be larger than necessary.
      for (int ray = 0; ray < 20; ++ray) {
        const kernels::Segment segment = test::random_segment(random, field);
        ASSERT_EQ(kernels::query(field, segment).logit, test::ask_each_triangle(field, segment).logit);
      }
    }
  EXPECT_GT(accepted, 0u);
}

}  // namespace
}  // namespace nif
