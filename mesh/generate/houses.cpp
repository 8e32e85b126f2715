// Builds the city's buildings: detached houses, terraces, apartment houses and towers.
#include <algorithm>
#include <cmath>

#include "mesh/generate/axes.hpp"
#include "mesh/generate/city_objects.hpp"
#include "mesh/generate/facade.hpp"

namespace nif::generate {
namespace {

constexpr Double3 kUpwards{0, 1, 0};

/// A roof over a rectangle around the origin; its ridge runs along x.
struct Roof {
  double x, z;       ///< the rectangle
  double eaves;      ///< their height
  double rise;       ///< height of the ridge above the eaves
  double over;       ///< overhang beyond the rectangle
  uint32_t courses;  ///< rows of tiles
};

/// Two slopes of tiles on two decks, on a block that closes the gables.
void add_gable_roof(Assembly& assembly, const Roof& roof, uint32_t tiles) {
  const double half = roof.z / 2, x = roof.x / 2 - 0.02, low = roof.eaves - 0.06,
               high = roof.eaves + roof.rise - 0.1;
  const auto end = [&](double at) { return Double3{at, roof.eaves + roof.rise / 3, 0}; };
  assembly.tube(3, 2, end(-x), end(x), [&](uint64_t ring, double turns) {
    const double at = ring == 0 ? -x : x;
    return turns < 0.1   ? Double3{at, low, 0.03 - half}
           : turns < 0.5 ? Double3{at, high, 0}
                         : Double3{at, low, half - 0.03};
  });
  const Double3 ridge{0, roof.eaves + roof.rise, 0};
  for (const double side : {-1.0, 1.0}) {
    const Double3 slope = Double3{0, -roof.rise, side * half} * ((half + roof.over) / half);
    const Double3 along = Double3{side, 0, 0}, away = unit(slope), above = cross(away, along);
    const double span = roof.x / 2 + roof.over;
    assembly.box(ridge + slope * 0.5, along * span, above * 0.06, slope * 0.5);
    const double step = length(slope) / roof.courses;
    for (uint32_t c = 0; c < roof.courses; ++c) {
      const Double3 middle = ridge + away * (step * (c + 0.5)) + above * 0.1;
      // The lower end of each course lies on the course below.
      const Double3 lie = unit(away + above * 0.1), over = cross(lie, along);
      const double each = 2 * (span + 0.05) / tiles;
      for (uint32_t t = 0; t < tiles; ++t) {
        const double shift = (t + 0.5) * each - span - 0.05;
        assembly.box(middle + along * shift, along * (tiles > 1 ? 0.485 * each : 0.5 * each), over * 0.02,
                     lie * (0.56 * step));
      }
    }
  }
  const double span = roof.x / 2 + roof.over + 0.08;
  assembly.rod([&](double t) { return ridge + Double3{(2 * t - 1) * span, 0.08, 0}; }, 0.13, 8, 5);
}

/// Four slopes, stepped like courses of tiles.
void add_hip_roof(Assembly& assembly, const Roof& roof) {
  const double x = roof.x / 2 + roof.over, z = roof.z / 2 + roof.over;
  const double slope = roof.rise / z, ridge = std::max(0.15, x - z), top = roof.eaves + roof.rise;
  const double foot = top - slope * z;
  assembly.tube(4, 2 * roof.courses + 1, {0, foot - 0.12, 0}, {0, top + 0.05, 0},
                [&](uint64_t ring, double turns) {
                  const double t = double(ring / 2) / roof.courses;
                  const double u = x + t * (ridge - x), v = z + t * (0.1 - z);
                  const double y = foot + t * (top - foot) + (ring == 0 ? -0.12 : ring % 2 ? 0.05 : 0.0);
                  switch (int(4 * turns + 0.5)) {
                    case 0:
                      return Double3{-u, y, v};
                    case 1:
                      return Double3{u, y, v};
                    case 2:
                      return Double3{u, y, -v};
                    default:
                      return Double3{-u, y, -v};
                  }
                });
}

void add_chimney(Assembly& assembly, const Double3& at, double height, uint32_t pots) {
  const double x = 0.28 + 0.19 * pots;
  assembly.block(at - Double3{x, 1.8, 0.33}, at + Double3{x, height, 0.33});
  assembly.block(at + Double3{-x - 0.07, height - 0.21, -0.4}, at + Double3{x + 0.07, height - 0.06, 0.4});
  for (uint32_t p = 0; p < pots; ++p)
    assembly.lathe(at + Double3{(p + 0.5 - pots / 2.0) * 0.42, height - 0.03, 0},
                   {{0.15, 0},
                    {0.16, 0.08},
                    {0.13, 0.12},
                    {0.11, 0.45},
                    {0.14, 0.5},
                    {0.14, 0.56},
                    {0.09, 0.56},
                    {0.08, 0.35}},
                   12);
}

/// A box on a roof with a window towards `side` of z.
void add_dormer(Assembly& assembly, double x, double z, double floor, double side) {
  const double y = floor + 1.5;
  assembly.block({x - 0.75, floor - 0.6, std::min(z, z - side * 2.2)},
                 {x + 0.75, y, std::max(z, z - side * 2.2)});
  assembly.block({x - 0.5, floor + 0.35, z - 0.04}, {x - 0.04, y - 0.2, z + 0.04});
  assembly.block({x + 0.04, floor + 0.35, z - 0.04}, {x + 0.5, y - 0.2, z + 0.04});
  assembly.block({x - 0.65, floor + 0.22, z - 0.1}, {x + 0.65, floor + 0.3, z + 0.1});
  for (const double aside : {-1.0, 1.0}) {
    const Double3 slope{aside * 0.95, -0.45, 0};
    const Double3 back{0, 0, -side};
    const Double3 z_axis = back * 1.25, x_axis = slope * 0.5;
    const Double3 y_axis = unit(cross(z_axis, x_axis)) * 0.05;
    assembly.box(Double3{x, y + 0.42, z - side * 0.95} + slope * 0.5, x_axis, y_axis, z_axis);
  }
}

void add_parapet(Assembly& assembly, const std::vector<Ground>& corners, double height) {
  Wall wall{corners, {}, {}, {}};
  for (size_t side = 0; side < corners.size(); ++side) {
    const double length = wall.length_of(side);
    assembly.beam(wall.at(side, -0.05, height, -0.12), wall.at(side, length - 0.31, height, -0.12), kUpwards,
                  0.36, 0.9);
    assembly.beam(wall.at(side, -0.1, height + 0.47, -0.12),
                  wall.at(side, length - 0.33, height + 0.47, -0.12), kUpwards, 0.48, 0.1);
  }
}

/// Machines and other things on flat roofs.
void add_roof_machines(Assembly& assembly, Random& random, double x, double z, double roof) {
  const uint32_t count = 3 + random.below(4);
  for (uint32_t i = 0; i < count; ++i) {
    const Double3 at{random.uniform(-x, x) / 2, roof - 0.1, random.uniform(-z, z) / 2};
    if (random.below(2)) {
      const double a = random.uniform(0.6, 1.4), b = random.uniform(0.5, 1), h = random.uniform(0.7, 1.3);
      assembly.block(at - Double3{a, 0, b}, at + Double3{a, h, b});
      for (uint32_t slat = 0; slat < 5; ++slat)
        assembly.block(at + Double3{-a * 0.9, 0.2 + 0.1 * slat, b - 0.03},
                       at + Double3{a * 0.9, 0.25 + 0.1 * slat, b + 0.04});
      assembly.lathe(at + Double3{0, h - 0.03, 0},
                     {{0.42 * b, 0}, {0.42 * b, 0.15}, {0.36 * b, 0.17}, {0.34 * b, 0.06}}, 20);
    } else {
      const double h = random.uniform(0.8, 2);
      assembly.lathe(at, {{0.16, 0}, {0.16, h}, {0.3, h + 0.03}, {0.3, h + 0.12}, {0.1, h + 0.25}}, 14);
    }
  }
}

void add_mast(Assembly& assembly, const Double3& foot, double height) {
  assembly.lathe(
      foot, {{0.3, 0}, {0.22, 0.4 * height}, {0.12, 0.42 * height}, {0.08, height}, {0.02, 1.02 * height}},
      12);
  for (uint32_t i = 1; i < 5; ++i) {
    const double y = height * (0.45 + 0.1 * i);
    assembly.block(foot + Double3{-0.6, y, -0.03}, foot + Double3{0.6, y + 0.06, 0.03});
  }
}

}  // namespace

void add_detached_house(Assembly& assembly, Random& random, uint32_t variant) {
  Facade facade;
  facade.storeys = 1 + (variant % 3 != 0);
  facade.storey = random.uniform(2.7, 3.0);
  facade.bay = random.uniform(2.5, 3.3);
  facade.window = random.uniform(1.05, 1.5);
  facade.plinth = random.uniform(0.3, 0.6);
  const double x = random.uniform(8.5, kDetachedPlot.x - 2.5), z = random.uniform(7, kDetachedPlot.z - 4);
  Wall wall{rectangle(x, z), {}, {}, {}};
  const size_t front_bays = std::max<size_t>(1, size_t(x / facade.bay + 0.5)),
               door = random.below(uint32_t(front_bays));
  const std::vector<Opening> openings = windows_of(facade, wall, [=](size_t side, size_t bay, size_t storey) {
    return side == 0 && storey == 0 && bay == door;
  });
  assembly.wall(wall);
  assembly.block({-x / 2 - 0.08, -0.1, -z / 2 - 0.08}, {x / 2 + 0.08, facade.plinth - 0.05, z / 2 + 0.08});
  const bool shutters = variant % 2 == 0;
  for (const Opening& opening : openings) {
    add_window(assembly, facade, wall, opening, 1 + variant % 2);
    if (shutters && facade.bay > 2.2 * facade.window) add_shutters(assembly, wall, opening);
  }
  add_door(assembly, wall, 0, x / double(front_bays) * (double(door) + 0.5), facade.plinth);
  const Roof roof{x,
                  z,
                  facade.top() - 0.05,
                  z * random.uniform(0.28, 0.5),
                  random.uniform(0.4, 0.8),
                  10 + random.below(8)};
  const double ridge = roof.eaves + roof.rise;
  if (variant % 4 == 3) {
    add_hip_roof(assembly, roof);
  } else {
    add_gable_roof(assembly, roof, variant % 4 == 2 ? 16 : 1);
    if (variant % 4 == 1)
      for (const double side : {-1.0, 1.0})
        add_dormer(assembly, side * x / 4.5, z * 0.36, roof.eaves + roof.rise * 0.28 + 0.3, 1);
  }
  add_chimney(assembly, {random.uniform(-0.25, 0.25) * x, ridge - 0.25, -0.12 * z}, 1.3, 1 + variant % 2);
  if (variant % 5 == 0) {  // a garage
    const double from = x / 2 - 0.1;
    const double to = std::min(from + 2.5, kDetachedPlot.x / 2);
    assembly.block({from, -0.1, -z / 4}, {to, 2.5, z / 3});
    assembly.block({from - 0.03, 2.45, -z / 4 - 0.15}, {to + 0.12, 2.62, z / 3 + 0.15});
    for (uint32_t slat = 0; slat < 7; ++slat)
      assembly.block({from + 0.2, 0.05 + 0.3 * slat, z / 3 - 0.05},
                     {to - 0.15, 0.32 + 0.3 * slat, z / 3 + 0.03});
  }
}

void add_terrace(Assembly& assembly, Random& random, uint32_t variant) {
  Facade facade;
  facade.storeys = 2 + variant % 2;
  facade.storey = random.uniform(2.9, 3.2);
  facade.plinth = random.uniform(0.4, 0.9);
  facade.bay = 2.6;
  facade.window = random.uniform(1.0, 1.25);
  facade.head = 2.35;
  const uint32_t houses = 4 + variant % 2;
  const double each = 2 * facade.bay, x = each * houses - 0.01, z = random.uniform(8, kTerracePlot.z - 2.2);
  Wall wall{rectangle(x, z), {}, {}, {}};
  const std::vector<Opening> openings = windows_of(facade, wall, [](size_t side, size_t bay, size_t storey) {
    return (side == 0 && storey == 0 && bay % 2 == 0) || side % 2 == 1;
  });
  assembly.wall(wall);
  for (const Opening& opening : openings) add_window(assembly, facade, wall, opening, 1 + (variant / 2) % 3);
  const Roof roof{x, z, facade.top() - 0.05, z * random.uniform(0.25, 0.45), 0.3, 12 + random.below(6)};
  add_gable_roof(assembly, roof, 1);
  assembly.block({-x / 2 - 0.06, facade.top() - 0.45, -z / 2 - 0.12},
                 {x / 2 + 0.06, facade.top() - 0.22, z / 2 + 0.12});
  for (uint32_t h = 0; h < houses; ++h) {
    const double left = -x / 2 + each * h;
    add_door(assembly, wall, 0, each * h + facade.bay / 2, facade.plinth);
    if (h > 0) add_chimney(assembly, {left, roof.eaves + roof.rise - 0.3, 0.07}, 1.2, 2);
    if (variant % 3 == 1)
      add_dormer(assembly, left + each / 2, z * 0.33, roof.eaves + roof.rise * 0.34 + 0.3, 1);
    if (variant % 4 == 2) {  // a bay window
      const double middle = left + 1.5 * facade.bay, y = facade.plinth;
      assembly.tube(
          5, 2, {middle, 0, z / 2 + 0.3}, {middle, y + 2.7, z / 2 + 0.3}, [&](uint64_t ring, double turns) {
            constexpr Ground kBay[5] = {{-1.15, 0}, {-0.65, 0.8}, {0.65, 0.8}, {1.15, 0}, {0, -0.15}};
            const Ground& c = kBay[size_t(5 * turns + 0.5)];
            return Double3{middle + c.x, ring == 0 ? 0.0 : y + 2.7, z / 2 + c.z};
          });
      for (const double pane : {-0.33, 0.33})
        assembly.block({middle + pane - 0.28, y + 0.8, z / 2 + 0.74},
                       {middle + pane + 0.28, y + 2.2, z / 2 + 0.83});
    }
    // A railing in front of each house.
    for (uint32_t bar = 0; bar < 9; ++bar) {
      const double at = left + each / 2 + 0.3 + 0.28 * bar;
      assembly.block({at - 0.015, -0.05, z / 2 + 1.2}, {at + 0.015, 0.95, z / 2 + 1.23});
    }
    assembly.block({left + each / 2 + 0.2, 0.8, z / 2 + 1.19}, {left + each - 0.05, 0.84, z / 2 + 1.24});
  }
}

void add_apartments(Assembly& assembly, Random& random, uint32_t variant) {
  Facade facade;
  facade.storeys = 4 + variant % 3;
  facade.storey = random.uniform(2.9, 3.1);
  facade.plinth = 0.45;
  facade.bay = random.uniform(3.1, 3.8);
  facade.window = random.uniform(1.3, 1.9);
  const double x = random.uniform(16, kApartmentPlot.x - 1), z = random.uniform(10, kApartmentPlot.z - 3.4);
  Wall wall{rectangle(x, z), {}, {}, {}};
  const size_t bays = std::max<size_t>(1, size_t(x / facade.bay + 0.5)), door = bays / 2;
  const std::vector<Opening> openings = windows_of(facade, wall, [=](size_t side, size_t bay, size_t storey) {
    return side == 0 && bay == door && storey == 0;
  });
  assembly.wall(wall);
  for (const Opening& opening : openings) {
    add_window(assembly, facade, wall, opening, variant % 3 == 0);
    const double floor = facade.plinth + facade.storey * double(opening.storey);
    if (opening.side == 0 && opening.storey > 0 && (opening.bay + variant) % 2 == 0)
      add_balcony(assembly, wall, opening, floor);
  }
  add_door(assembly, wall, 0, x / double(bays) * (double(door) + 0.5), facade.plinth);
  for (size_t s = 1; s < facade.storeys && variant % 2; ++s) {
    const double y = facade.plinth + facade.storey * double(s);
    assembly.block({-x / 2 - 0.07, y - 0.2, -z / 2 - 0.07}, {x / 2 + 0.07, y - 0.02, z / 2 + 0.07});
  }
  const double roof = facade.top();
  if (variant % 4 == 0) {
    add_hip_roof(assembly, {x, z, roof - 0.05, z * 0.3, 0.5, 12});
    return;
  }
  add_parapet(assembly, wall.corners, roof);
  assembly.block({-2, roof - 0.1, -z / 4 - 1.5}, {1.5, roof + 2.6, -z / 4 + 1.5});
  assembly.block({-2.2, roof + 2.5, -z / 4 - 1.7}, {1.7, roof + 2.7, -z / 4 + 1.7});
  add_roof_machines(assembly, random, x * 0.8, z * 0.7, roof);
}

void add_tower(Assembly& assembly, Random& random, uint32_t variant) {
  Facade facade;
  facade.storey = random.uniform(3.3, 3.7);
  facade.sill = variant % 2 ? 0.35 : 0.8;
  facade.head = facade.storey - 0.35;
  facade.bay = random.uniform(2.1, 2.6);
  facade.window = variant % 2 ? 0.78 * facade.bay : 0.55 * facade.bay;
  facade.recess = random.uniform(0.12, 0.3);
  facade.plinth = 0.4;
  double x = random.uniform(15, kTowerPlot.x), z = random.uniform(15, kTowerPlot.z), foot = 0;
  const double depth = z;
  const uint32_t tiers = 1 + variant % 3;
  const std::array<size_t, 3> storeys{9 + random.below(8), 4 + random.below(4), 2 + random.below(3)};
  const auto never = [](size_t, size_t, size_t) { return false; };
  for (uint32_t tier = 0; tier < tiers; ++tier) {
    facade.storeys = storeys[tier];
    std::vector<Ground> corners = rectangle(x, z);
    if (variant % 4 == 1) {
      const double cut = x / 5;
      corners = {{-x / 2 + cut, z / 2},  {x / 2 - cut, z / 2},  {x / 2, z / 2 - cut},
                 {x / 2, -z / 2 + cut},  {x / 2 - cut, -z / 2}, {-x / 2 + cut, -z / 2},
                 {-x / 2, -z / 2 + cut}, {-x / 2, z / 2 - cut}};
    }
    Wall wall{corners, {}, {}, {}};
    windows_of(facade, wall, never);
    for (double& height : wall.heights) height += foot;
    assembly.wall(wall);
    foot += facade.top() - 0.1;
    if (variant % 4 != 1) add_parapet(assembly, corners, foot);
    x *= 0.72, z *= 0.74;
  }
  add_roof_machines(assembly, random, x, z, foot + 0.1);
  assembly.block({-x / 5, foot - 0.1, -z / 5}, {x / 5, foot + 2.8, z / 5});
  if (variant % 3 != 1) add_mast(assembly, {0, foot + 2.7, 0}, random.uniform(6, 14));
  for (const double aside : {-1.0, 1.0}) {  // a canopy over the entrance
    assembly.lathe({aside * 2.6, 0, kTowerPlot.z / 2 + 0.2},
                   {{0.2, -0.05}, {0.2, 0.2}, {0.14, 0.25}, {0.14, 2.9}, {0.22, 3.0}}, 14);
  }
  assembly.block({-3, 2.95, depth / 2 - 0.5}, {3, 3.2, kTowerPlot.z / 2 + 0.6});
}

}  // namespace nif::generate
