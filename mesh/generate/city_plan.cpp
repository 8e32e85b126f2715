// Plans blocks in a grid of streets. Towers stand in the middle, surrounded by apartment houses, terraces and
// detached houses; some blocks are parks.
#include "mesh/generate/city_plan.hpp"

#include <algorithm>

#include "formats/base/random.hpp"
#include "mesh/generate/city_objects.hpp"

namespace nif::generate {
namespace {

constexpr uint64_t kPlanStream = 0x63697479;  // "city"

enum class BlockUse { towers, apartments, terraces, detached, park };

class Planner {
 public:
  Planner(uint64_t seed, uint32_t blocks) : seed_(seed), blocks_(blocks) {
    const std::vector<BlockUse> uses = uses_of_blocks();
    for (uint32_t z = 0; z <= blocks; ++z)
      for (uint32_t x = 0; x <= blocks; ++x) {
        const Ground corner{middle(x, kPitch.x) - kPitch.x / 2, middle(z, kPitch.z) - kPitch.z / 2};
        needed_.push_back({CityKind::crossing, {corner.x, 0, corner.z}});
        if (x < blocks) needed_.push_back({CityKind::street, {corner.x + kPitch.x / 2, 0, corner.z}});
        if (z < blocks) needed_.push_back({CityKind::side_street, {corner.x, 0, corner.z + kPitch.z / 2}});
        if (x < blocks && z < blocks) plan_block(x, z, uses[z * blocks + x]);
      }
  }

  /// The places that a city of this many blocks must have, and the optional ones.
  const std::vector<CityPlace>& needed() const { return needed_; }
  std::vector<CityPlace>& wanted() { return wanted_; }

 private:
  double middle(uint32_t block, double pitch) const { return (block - (blocks_ - 1) / 2.0) * pitch; }

  std::vector<BlockUse> uses_of_blocks() const {
    Random random(seed_, kPlanStream, 0);
    struct Block {
      double away;
      uint32_t number;
    };
    std::vector<Block> order;
    for (uint32_t i = 0; i < blocks_ * blocks_; ++i) {
      const double x = middle(i % blocks_, 2.0 / blocks_), z = middle(i / blocks_, 2.0 / blocks_);
      order.push_back({x * x + z * z + random.uniform(0, 0.25), i});
    }
    std::sort(order.begin(), order.end(), [](const Block& a, const Block& b) {
      return a.away != b.away ? a.away < b.away : a.number < b.number;
    });
    std::vector<BlockUse> uses(order.size());
    for (size_t i = 0; i < order.size(); ++i) {
      const double part = double(i) / double(order.size());
      uses[order[i].number] = i % 9 == 4    ? BlockUse::park
                              : part < 0.1  ? BlockUse::towers
                              : part < 0.36 ? BlockUse::apartments
                              : part < 0.66 ? BlockUse::terraces
                                            : BlockUse::detached;
    }
    return uses;
  }

  void plan_block(uint32_t x, uint32_t z, BlockUse use) {
    Random random(seed_, kPlanStream, 1 + z * blocks_ + x);
    const Ground c{middle(x, kPitch.x), middle(z, kPitch.z)};
    const auto place = [&](CityKind kind, double at_x, double at_z, double turns = 0, double scale = 1) {
      return CityPlace{kind, {c.x + at_x, kPavement, c.z + at_z}, turns, scale};
    };
    const auto tree = [&](double at_x, double at_z, double conifers) {
      const bool conifer = random.uniform() < conifers;
      wanted_.push_back(place(conifer ? CityKind::conifer : CityKind::broadleaf, at_x, at_z, random.uniform(),
                              random.uniform(0.75, 1.15)));
    };
    needed_.push_back(
        {use == BlockUse::towers ? CityKind::square : CityKind::lawn, {c.x, 0, c.z}, 0.5 * random.below(2)});

    // Buildings face the streets along x.
    const auto buildings = [&](CityKind kind, const std::vector<double>& along, double aside) {
      for (const double side : {1.0, -1.0})
        for (const double at : along) needed_.push_back(place(kind, at, side * aside, side > 0 ? 0 : 0.5));
    };
    switch (use) {
      case BlockUse::towers:
        buildings(CityKind::tower, {-15.7, 15.7}, 10);
        break;
      case BlockUse::apartments:
        buildings(CityKind::apartments, {-14.3, 14.3}, 12.2);
        for (uint32_t i = 0; i < 4; ++i) tree(random.uniform(-27, 27), random.uniform(-3, 3), 0.2);
        break;
      case BlockUse::terraces:
        buildings(CityKind::terrace, {-14.1, 14.1}, 14.2);
        for (uint32_t i = 0; i < 7; ++i) tree(-25.5 + 8.5 * i, random.uniform(-6.5, 6.5), 0.15);
        for (const double at : {-21.5, -14.5, -7.5, 7.5, 14.5, 21.5})
          wanted_.push_back(place(CityKind::hedge, at, random.uniform(-0.2, 0.2)));
        break;
      case BlockUse::detached:
        buildings(CityKind::detached, {-19, 0, 19}, 10.5);
        for (const double side : {-1.0, 1.0}) {
          for (const double at : {-24.0, -14.0, -5.0, 5.0, 14.0, 24.0})
            wanted_.push_back(place(CityKind::hedge, at + random.uniform(-0.4, 0.4), side * 19.7));
          for (const double at : {-28.0, -9.5, 9.5, 28.0})
            tree(at + random.uniform(-1, 1), side * random.uniform(2, 17), 0.4);
        }
        for (const double at : {-9.5, 9.5}) wanted_.push_back(place(CityKind::hedge, at, 0, 0.25));
        break;
      case BlockUse::park:
        needed_.push_back(place(CityKind::statue, 0, 0, random.uniform()));
        for (uint32_t i = 0; i < 30; ++i) {
          const double at_x = random.uniform(-27, 27), at_z = random.uniform(-19, 19);
          if (at_x * at_x + at_z * at_z > 60) tree(at_x, at_z, 0.3);
        }
        for (uint32_t i = 0; i < 8; ++i) {
          const double way = i < 4 ? 6.5 : 12;
          const double sides[4][3] = {{0, way, 0.5}, {way, 0, 0.75}, {0, -way, 0}, {-way, 0, 0.25}};
          const auto& [at_x, at_z, turns] = sides[i % 4];
          wanted_.push_back(place(CityKind::bench, at_x, at_z, turns));
          wanted_.push_back(
              place(i % 2 ? CityKind::lamp : CityKind::bin, at_x + 1.6, at_z + 1.6, random.uniform()));
        }
        break;
    }
    plan_pavement(random, c);
  }

  /// Plans the things along the four sides of a block, and the cars in front of them.
  void plan_pavement(Random& random, const Ground& c) {
    struct Side {
      double half, aside;  ///< along the side, and away from the middle
      double turns;        ///< rotation of things that face the street
    };
    const Side sides[] = {{kBlockHalf.x, kBlockHalf.z, 0},
                          {kBlockHalf.z, kBlockHalf.x, 0.25},
                          {kBlockHalf.x, kBlockHalf.z, 0.5},
                          {kBlockHalf.z, kBlockHalf.x, 0.75}};
    for (const Side& side : sides) {
      const auto add = [&](CityKind kind, double along, double inwards, double turns, double height,
                           double scale = 1) {
        const double out = side.aside - inwards;
        Double3 p{c.x, height, c.z};
        if (side.turns == 0) p = p + Double3{along, 0, out};
        if (side.turns == 0.25) p = p + Double3{out, 0, -along};
        if (side.turns == 0.5) p = p + Double3{-along, 0, -out};
        if (side.turns == 0.75) p = p + Double3{-out, 0, along};
        wanted_.push_back({kind, p, turns, scale});
      };
      for (double at = 6 - side.half; at < side.half - 5; at += 11)
        add(CityKind::broadleaf, at + random.uniform(-0.5, 0.5), 1.1, random.uniform(), kPavement,
            random.uniform(0.6, 0.85));
      for (const double at : {-0.62 * side.half, 0.05 * side.half, 0.68 * side.half})
        add(CityKind::lamp, at, 0.7, side.turns, kPavement);
      if (random.below(2))
        add(CityKind::bench, random.uniform(-0.8, 0.8) * side.half, 2.4, side.turns, kPavement);
      if (random.below(3) == 0)
        add(CityKind::bin, random.uniform(-0.8, 0.8) * side.half, 2.5, side.turns, kPavement);
      for (double at = 9 - side.half; at < side.half - 8; at += 5.6) {
        const bool turned = random.below(2) == 1;
        if (random.below(5) < 3)
          add(CityKind::car, at + random.uniform(-0.3, 0.3), -1.25, side.turns + (turned ? 0.5 : 0), -0.08);
      }
      // A car on the move, on the right.
      if (random.below(3) == 0)
        add(CityKind::car, random.uniform(-0.9, 0.9) * side.half, -4.0, side.turns, -0.04);
    }
  }

  uint64_t seed_;
  uint32_t blocks_;
  std::vector<CityPlace> needed_, wanted_;
};

}  // namespace

std::vector<CityPlace> plan_city(uint64_t seed, uint32_t count) {
  return smallest_plan<CityPlace>(count, Random(seed, kPlanStream, UINT64_MAX),
                                  [&](uint32_t blocks) { return Planner(seed, blocks); });
}

}  // namespace nif::generate
