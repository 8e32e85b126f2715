// Planes in cells: their words, the sides that follow from them, and files that say otherwise.
#include <gtest/gtest.h>

#include <functional>
#include <map>
#include <optional>
#include <set>
#include <stdexcept>

#include "formats/nif/planes/cell_sides.hpp"
#include "formats/nif/writer.hpp"
#include "kernels/reference/planes/grid_traversal.hpp"
#include "tests/support/random_asset.hpp"

namespace nif {
namespace {

using format::PlanesData, format::SideRegions;
using kernels::kSeenInside, kernels::kSeenOutside;

TEST(Cells, HaveUniqueNormalsOfOneSum) {
  std::map<std::tuple<int, int, int>, int> seen;
  for (uint32_t u = 0; u <= uint32_t(kernels::kNormalSum); ++u)
    for (uint32_t v = 0; v <= uint32_t(kernels::kNormalSum); ++v) {
      const kernels::CellNormal n = kernels::cell_normal(kernels::make_planes(0, u, v, 0, 256));
      ASSERT_EQ(std::abs(n.x) + std::abs(n.y) + n.z, kernels::kNormalSum) << u << " " << v;
      ASSERT_GE(n.z, 0);
      ++seen[{n.x, n.y, n.z}];
    }
  EXPECT_EQ(seen.size(), 63u * 63u);
  EXPECT_EQ(seen.count({0, 0, 62}), 1u);
  EXPECT_EQ(seen.count({62, 0, 0}), 1u);
  EXPECT_EQ(seen.count({0, -62, 0}), 1u);
}

TEST(Cells, KeepTheirFields) {
  const uint32_t planes = kernels::make_planes(13, 1, 62, 255, 256);
  EXPECT_EQ(kernels::word_kind(planes), 13u);
  EXPECT_EQ(kernels::lower_offset(planes), 255u);
  EXPECT_EQ(kernels::upper_offset(planes), 256u);
  const uint32_t link = kernels::make_link(0b10100010, 0xfffff);
  EXPECT_EQ(kernels::word_kind(link), kernels::kLink);
  EXPECT_EQ(kernels::link_mask(link), 0b10100010u);
  EXPECT_EQ(kernels::link_child(link, 1), 0xfffffu);
  EXPECT_EQ(kernels::link_child(link, 5), 0x100000u);
  EXPECT_EQ(kernels::link_child(link, 7), 0x100001u);
}

TEST(Cells, HaveKindsThatClaimNoMoreThanIsProven) {
  for (uint32_t above = 0; above < 3; ++above)
    for (uint32_t below = 0; below < 3; ++below)
      for (const bool wall : {false, true}) {
        const kernels::CellKind said = kernels::kCellKinds[kernels::kind_of({above, below, wall})];
        EXPECT_TRUE(said.above == above || said.above == 0);
        EXPECT_TRUE(said.below == below || said.below == 0);
        EXPECT_TRUE(wall || !said.wall);
        // What is lost: one side where both are inside, and a wall between outside and inside.
        if (above != kSeenInside || below != kSeenInside) {
          EXPECT_EQ(said.above, above);
          EXPECT_EQ(said.below, below);
        }
        if ((above | below) != kernels::kSeenBoth) {
          EXPECT_EQ(said.wall, wall);
        }
      }
}

TEST(Cells, AreNeverPassedAtTheFirstAndLastOffset) {
  const float direction[3] = {0.1f, 0.2f, 1.0f};
  for (const int size : {1, 2, 4, 8, 16})
    for (uint32_t corner = 0; corner < 8; ++corner) {
      const float half = 0.5f * static_cast<float>(size), middle[3] = {8.5f, 100, 3};
      float origin[3];
      for (uint32_t a = 0; a < 3; ++a)
        origin[a] = middle[a] + (corner >> a & 1 ? half + 0.01f : -half - 0.01f);
      for (uint32_t u = 0; u <= 62; u += 31) {
        const uint32_t word = kernels::make_planes(8, u, 31, 0, 256);
        const auto passed =
            kernels::pass_cell(word, middle, static_cast<float>(size), origin, direction, 0, 0);
        EXPECT_TRUE(passed.open);
        EXPECT_EQ(passed.seen, 0u);
      }
    }
}

/// A row of voxels along x that are all surface but where `states` says otherwise, cut `levels` times at
/// most.
struct Row {
  PlanesData data;
  explicit Row(const std::string& states, uint32_t levels = 0) {
    data.voxels = {uint32_t(states.size()), 1, 1};
    data.levels = levels;
    data.voxels_per_unit = 1;
    data.brick_table.assign(format::bricks_for(data.voxels[0]), 0);
    for (size_t b = 0; b * 4 < states.size(); ++b) {
      kernels::BrickStates brick{};
      for (size_t x = 0; x < 4 && 4 * b + x < states.size(); ++x) {
        const char state = states[4 * b + x];
        if (state == 's' || state == '?') brick.surface |= 1u << x;
        if (state == 'i' || state == '?') brick.aux |= 1u << x;
      }
      data.brick_table[b] = uint16_t(kernels::kFirstMixedBrick + b);
      data.brick_states.push_back(brick);
    }
    format::leave_bare(data);
  }
  SideRegions regions() const { return SideRegions(format::field_of(data)); }
};

/// Across x, between two places; the normal is (62, 0, 0).
uint32_t across_x(uint32_t lower, uint32_t upper) { return kernels::make_planes(0, 62, 62, lower, upper); }
/// Across z.
uint32_t across_z(uint32_t lower, uint32_t upper) { return kernels::make_planes(0, 31, 31, lower, upper); }

TEST(Sides, SpreadBetweenVoxelsWherePlanesLeaveRoom) {
  // Everything on the border of a grid that is one voxel high is outside; so the row is bare to its sides:
  // planes across x at both ends have nothing above or below on the other faces.
  Row row("sss");
  row.data.voxel_records[1] = across_z(100, 150);
  const SideRegions regions = row.regions();
  EXPECT_FALSE(regions.contradictory());
  EXPECT_EQ(regions.above(1), kSeenOutside);  // reaches the border of the grid
  EXPECT_EQ(regions.below(1), kSeenOutside);
  EXPECT_EQ(regions.above(0), 0u);  // bare
  EXPECT_EQ(regions.below(2), 0u);
}

TEST(Sides, OfAnInsideVoxelMeetThoseOutsideOnlyInDamagedFiles) {
  Row row("is");
  // Above: towards the border, outside. Below: towards the inside voxel, and also the border below and above:
  // both.
  row.data.voxel_records[0] = across_x(100, 150);
  EXPECT_TRUE(row.regions().contradictory());
  row.data.voxel_records[0] = kernels::kBareCell;
  EXPECT_FALSE(row.regions().contradictory());
}

/// Cells within a large one, so that its border is far away: the voxel in the middle of 3 x 3 x 3 bare ones
/// is cut, and its children have these words.
SideRegions regions_of_parts(const std::vector<std::pair<uint32_t, uint32_t>>& parts, bool inside_beside) {
  PlanesData data;
  data.voxels = {3, 3, 3};
  data.levels = 1;
  data.voxels_per_unit = 1;
  data.brick_table = {kernels::kFirstMixedBrick};
  kernels::BrickStates brick{};
  for (uint32_t bit = 0; bit < 64; ++bit)
    if (bit % 4 < 3 && bit / 4 % 4 < 3 && bit / 16 < 3) brick.surface |= uint64_t{1} << bit;
  const uint32_t beside = 0 + 4 * 1 + 16 * 1;  // at lower x
  if (inside_beside) {
    brick.surface &= ~(uint64_t{1} << beside);
    brick.aux |= uint64_t{1} << beside;
  }
  data.brick_states = {brick};
  format::leave_bare(data);
  const uint32_t middle = inside_beside ? 12 : 13;
  uint32_t mask = 0;
  for (const auto& [part, word] : parts) {
    mask |= 1u << part;
    data.children.push_back(word);
  }
  data.voxel_records[middle] = kernels::make_link(mask, 0);
  return SideRegions(format::field_of(data));
}

TEST(Sides, SpreadThroughMissingChildren) {
  // Child 0 is beside the inside voxel and empty; child 1, at higher x, has planes across x. All others are
  // bare.
  std::vector<std::pair<uint32_t, uint32_t>> parts = {{1, across_x(60, 180)}};
  for (uint32_t part = 2; part < 8; ++part) parts.push_back({part, kernels::kBareCell});
  const SideRegions regions = regions_of_parts(parts, true);
  EXPECT_FALSE(regions.contradictory());
  EXPECT_EQ(regions.below(26), kSeenInside);
  EXPECT_EQ(regions.above(26), 0u);  // what it meets is bare
  EXPECT_EQ(regions_of_parts(parts, false).below(26), 0u);
}

TEST(Sides, AreJoinedOnlyByPointsBeyondBothPlanes) {
  // Parts 0 and 1 share a face across x. Planes across z: the regions above meet if both leave room.
  const auto above_of_first = [&](uint32_t second) {
    std::vector<std::pair<uint32_t, uint32_t>> parts = {{0, across_z(40, 60)}, {1, second}};
    for (uint32_t part = 2; part < 8; ++part) parts.push_back({part, kernels::kBareCell});
    return regions_of_parts(parts, true).above(27);
  };
  EXPECT_EQ(above_of_first(across_z(10, 200)), kSeenInside);
  EXPECT_EQ(above_of_first(across_z(10, 256)), 0u);
  EXPECT_EQ(above_of_first(kernels::kBareCell), 0u);
}

/// As the definition says, with points of a fine lattice on each face in place of an exact decision: joins no
/// more than there are.
class SampledSides {
 public:
  explicit SampledSides(const kernels::PlanesField& field) : field_(field) {
    const int32_t cells[3] = {int32_t(field.voxels[0] << field.levels),
                              int32_t(field.voxels[1] << field.levels),
                              int32_t(field.voxels[2] << field.levels)};
    for (int axis = 0; axis < 3; ++axis)
      for (int32_t x = 0; x < cells[0]; ++x)
        for (int32_t y = 0; y < cells[1]; ++y)
          for (int32_t z = 0; z < cells[2]; ++z) {
            const int32_t low[3] = {x, y, z};
            join(axis, low, low[axis] + 1 == cells[axis]);
            if (low[axis] == 0) join_border(axis, low);
          }
  }

  /// SeenBits of all that a region is joined to.
  uint32_t of(const std::array<int32_t, 3>& low, int32_t size, int side) {
    const Key key{low, size, side};
    return key_numbers_.count(key) ? states(find(number(key))) : 0u;
  }

 private:
  using Key = std::tuple<std::array<int32_t, 3>, int32_t, int>;  // low end, size, 1 above, -1 below, 0 all
  static constexpr int kSteps = 16;                              // along the side of a finest cell

  static kernels::Cube cube_at(const kernels::PlanesField& field, const int32_t (&cell)[3]) {
    return kernels::find_cube(field, cell);
  }

  /// Of which region of the cell a point, in finest cells, is; nullopt between planes.
  std::optional<Key> region_of(const kernels::Cube& cube, const double (&p)[3]) const {
    const std::array<int32_t, 3> low = {cube.low[0], cube.low[1], cube.low[2]};
    if (kernels::word_kind(cube.word) == kernels::kEmptyVoxel) return Key{low, cube.size, 0};
    const kernels::CellNormal n = kernels::cell_normal(cube.word);
    const double half = cube.size / 2.0;
    const double height =
        n.x * (p[0] - low[0] - half) + n.y * (p[1] - low[1] - half) + n.z * (p[2] - low[2] - half);
    const auto size = static_cast<float>(cube.size);
    if (height > double(kernels::plane_height(kernels::upper_offset(cube.word), size)))
      return Key{low, cube.size, 1};
    if (height < double(kernels::plane_height(kernels::lower_offset(cube.word), size)))
      return Key{low, cube.size, -1};
    return std::nullopt;
  }

  template <class Use>
  static void for_points(int axis, const int32_t (&low)[3], int32_t plane, const Use& use) {
    for (int i = 0; i <= kSteps; ++i)
      for (int j = 0; j <= kSteps; ++j) {
        double p[3];
        p[axis] = plane;
        p[(axis + 1) % 3] = low[(axis + 1) % 3] + double(i) / kSteps;
        p[(axis + 2) % 3] = low[(axis + 2) % 3] + double(j) / kSteps;
        use(p);
      }
  }

  void join(int axis, const int32_t (&low)[3], bool last) {
    int32_t high[3] = {low[0], low[1], low[2]};
    ++high[axis];
    const kernels::Cube a = cube_at(field_, low), b = last ? kernels::Cube{} : cube_at(field_, high);
    if (!last && a.low[0] == b.low[0] && a.low[1] == b.low[1] && a.low[2] == b.low[2] && a.size == b.size)
      return;
    for_points(axis, low, high[axis], [&](const double(&p)[3]) {
      const auto first = region_of(a, p);
      if (!first) return;
      if (last) {
        note(*first, a, kSeenOutside);
        return;
      }
      const auto second = region_of(b, p);
      if (!second) return;
      note(*first, a, 0);
      note(*second, b, 0);
      const bool both_empty = is_voxel(a) && is_voxel(b);
      const bool unknown = (is_voxel(a) && kernels::empty_side(a.word) == 0) ||
                           (is_voxel(b) && kernels::empty_side(b.word) == 0);
      if (!both_empty && !unknown) unite(number(*first), number(*second));
    });
  }
  void join_border(int axis, const int32_t (&low)[3]) {
    const kernels::Cube a = cube_at(field_, low);
    for_points(axis, low, low[axis], [&](const double(&p)[3]) {
      if (const auto region = region_of(a, p)) note(*region, a, kSeenOutside);
    });
  }

  /// An empty voxel, and not a child that no triangle touches.
  bool is_voxel(const kernels::Cube& cube) const {
    return kernels::word_kind(cube.word) == kernels::kEmptyVoxel && cube.size == 1 << field_.levels;
  }

  void note(const Key& key, const kernels::Cube& cube, uint32_t state) {
    const uint32_t i = number(key);
    // What the file says of empty voxels is not changed by the border.
    states_[i] |= is_voxel(cube) ? kernels::empty_side(cube.word) : state;
  }

  uint32_t number(const Key& key) {
    const auto [at, is_new] = key_numbers_.try_emplace(key, uint32_t(parents_.size()));
    if (is_new) {
      parents_.push_back(at->second);
      states_.push_back(0);
    }
    return at->second;
  }
  uint32_t find(uint32_t i) const { return parents_[i] == i ? i : find(parents_[i]); }
  void unite(uint32_t a, uint32_t b) {
    a = find(a), b = find(b);
    parents_[b] = a;
  }
  uint32_t states(uint32_t root) {
    uint32_t all = 0;
    for (uint32_t i = 0; i < parents_.size(); ++i)
      if (find(i) == root) all |= states_[i];
    return all;
  }

  const kernels::PlanesField& field_;
  std::map<Key, uint32_t> key_numbers_;
  std::vector<uint32_t> parents_, states_;
};

TEST(Sides, AgreeWithSampledFaces) {
  uint32_t known = 0, missed = 0, counted = 0;
  for (uint64_t seed = 1; seed <= 150; ++seed) {
    const format::Asset asset = test::random_asset(seed, {.objects = 2, .max_voxels = 3});
    for (const format::Object& object : asset.objects) {
      const auto& data = *object.planes;
      if (data.levels > 2) continue;
      const kernels::PlanesField field = format::field_of(data);
      const SideRegions regions(field);
      ASSERT_FALSE(regions.contradictory());
      SampledSides sampled(field);
      // Every cell with planes, by way of the finest cells that it holds.
      std::set<std::array<int32_t, 4>> done;
      const int32_t cells[3] = {int32_t(field.voxels[0] << field.levels),
                                int32_t(field.voxels[1] << field.levels),
                                int32_t(field.voxels[2] << field.levels)};
      for (int32_t z = 0; z < cells[2]; ++z)
        for (int32_t y = 0; y < cells[1]; ++y)
          for (int32_t x = 0; x < cells[0]; ++x) {
            const int32_t cell[3] = {x, y, z};
            const kernels::Cube cube = kernels::find_cube(field, cell);
            if (kernels::word_kind(cube.word) >= kernels::kPlaneKinds) continue;
            if (!done.insert({cube.low[0], cube.low[1], cube.low[2], cube.size}).second) continue;
            const kernels::CellKind kind = kernels::kCellKinds[kernels::word_kind(cube.word)];
            for (const int side : {1, -1}) {
              const uint32_t found = sampled.of({x, y, z}, cube.size, side),
                             said = side > 0 ? kind.above : kind.below;
              ++counted;
              known += said != 0;
              // What a file says is proven, and samples find nearly all of that.
              if (said != 0 && found != said) ++missed;
              ASSERT_TRUE((found & said) == found || said == 0) << found << " " << said;
            }
          }
    }
  }
  EXPECT_GT(counted, 1000u);
  EXPECT_GT(known, 300u);
  EXPECT_LT(missed, known / 20) << "of " << known;
}

/// What reading says of an asset: the writer lets the reader look at all that it makes. Empty where it is
/// good.
std::string refusal_of(const format::Asset& asset) {
  try {
    format::encode(asset);
    return {};
  } catch (const Error& error) {
    return error.what();
  }
}

/// Of an asset with one object whose cells have been changed.
std::string refusal_of(uint64_t seed, const std::function<void(PlanesData&)>& change) {
  format::Asset asset = test::random_asset(seed, {.objects = 1, .instances = 1, .max_voxels = 9});
  change(*asset.objects[0].planes);
  return refusal_of(asset);
}

/// A seed whose object is cut, and has planes in parts of parts.
uint64_t seed_of_levels(uint32_t levels) {
  for (uint64_t seed = 1;; ++seed) {
    const format::Asset asset = test::random_asset(seed, {.objects = 1, .instances = 1, .max_voxels = 9});
    const auto& data = *asset.objects[0].planes;
    if (data.levels == levels && data.children.size() > 20) return seed;
  }
}

void expect_refused(uint64_t seed, const std::string& words, const std::function<void(PlanesData&)>& change) {
  const std::string said = refusal_of(seed, change);
  EXPECT_NE(said.find(words), std::string::npos) << said << " and not " << words;
}

/// The first word for which `is` holds, of voxels or children.
uint32_t& word_where(PlanesData& data, bool in_parts, const std::function<bool(uint32_t)>& is) {
  for (uint32_t& word : in_parts ? data.children : data.voxel_records)
    if (is(word)) return word;
  throw std::logic_error("no such word");
}
bool is_link(uint32_t word) { return kernels::word_kind(word) == kernels::kLink; }
bool has_planes(uint32_t word) { return kernels::word_kind(word) < kernels::kPlaneKinds; }

TEST(CellRefusal, OfWords) {
  const uint64_t seed = seed_of_levels(2);
  EXPECT_EQ(refusal_of(seed, [](PlanesData&) {}), "");
  const auto refused = [&](const char* words, bool in_parts, bool link, uint32_t clear, uint32_t set) {
    expect_refused(seed, words, [&](PlanesData& data) {
      uint32_t& word = word_where(data, in_parts, link ? is_link : has_planes);
      word = (word & ~clear) | set;
    });
  };
  for (const bool in_parts : {false, true}) {
    refused("a cell is of an unknown kind", in_parts, false, 15, kernels::kEmptyVoxel);
    refused("a normal is out of range", in_parts, false, 0, 63 << 4);
    refused("a normal is out of range", in_parts, false, 0, 63 << 10);
    refused("lower plane is not below", in_parts, false, 0xffffu << 16, 0x7f80u << 16);
    refused("a cell is cut into no children", in_parts, true, 255 << 4, 0);
  }
  refused("links do not name all children in order", false, true, 0, 1 << 12);
}

TEST(CellRefusal, OfLinks) {
  const uint64_t seed = seed_of_levels(2);
  expect_refused(seed, "cut more often than levels says", [](PlanesData& data) { data.levels = 1; });
  expect_refused(seed, "cut more often than levels says", [](PlanesData& data) { data.levels = 0; });
  expect_refused(seed, "child_count is not the number", [](PlanesData& data) { data.children.pop_back(); });
  expect_refused(seed, "a child belongs to no cell",
                 [](PlanesData& data) { data.children.push_back(kernels::kBareCell); });
  expect_refused(seed, "levels is 5", [](PlanesData& data) { data.levels = 5; });
  expect_refused(seed, "is not the number of surface voxels",
                 [](PlanesData& data) { data.voxel_records.push_back(kernels::kBareCell); });
  expect_refused(seed, "voxel_base is not", [](PlanesData& data) { ++data.voxel_base.back(); });
  // Two cells that would share parts.
  expect_refused(seed, "links do not name all children in order", [](PlanesData& data) {
    uint32_t* first = nullptr;
    for (uint32_t& word : data.voxel_records) {
      if (!is_link(word)) continue;
      if (first) {
        word = *first;
        return;
      }
      first = &word;
    }
    throw std::logic_error("one link only");
  });
}

TEST(CellRefusal, OfSidesThatAreNotProven) {
  uint32_t tried = 0;
  for (uint64_t seed = 1; seed <= 40; ++seed) {
    const format::Asset asset = test::random_asset(seed, {.objects = 1, .instances = 1, .max_voxels = 9});
    const auto& data = *asset.objects[0].planes;
    const SideRegions regions(format::field_of(data));
    for (uint32_t i = 0; i < data.voxel_records.size() && tried < 200; ++i) {
      if (!has_planes(data.voxel_records[i])) continue;
      for (uint32_t kind = 0; kind < kernels::kPlaneKinds; ++kind) {
        const kernels::CellKind& said = kernels::kCellKinds[kind];
        if ((said.above == 0 || said.above == regions.above(i)) &&
            (said.below == 0 || said.below == regions.below(i)))
          continue;
        expect_refused(seed, "a side that its planes and its neighbours do not prove",
                       [&](PlanesData& changed) {
                         changed.voxel_records[i] = (changed.voxel_records[i] & ~15u) | kind;
                       });
        ++tried;
      }
    }
  }
  EXPECT_GT(tried, 100u);
}

TEST(CellRefusal, OfPlanesThatJoinOutsideAndInside) {
  const format::Asset empty = test::random_asset(1, {.objects = 1, .instances = 1});
  format::Asset asset = empty;
  auto& data = *asset.objects[0].planes;
  const Row row("isss");
  data.voxels = row.data.voxels;
  data.levels = 0;
  data.brick_table = row.data.brick_table;
  data.brick_states = row.data.brick_states;
  format::NetworkData& network = *asset.objects[0].network;
  network.brick_corners.assign(data.brick_states.size(), 0);
  network.corner_base.assign(data.brick_states.size(), 0);
  network.corners = 0;
  network.features.clear();
  format::leave_bare(data);
  EXPECT_EQ(refusal_of(asset), "");
  data.voxel_records[0] = across_x(100, 150);
  EXPECT_NE(refusal_of(asset).find("planes join what is outside with what is inside"), std::string::npos);
}

}  // namespace
}  // namespace nif
