// A window is a recessed cell of the wall's grid, in an odd column and an odd row. Sills, bars, shutters,
// balconies and doors are beams that extend into the wall.
#include "mesh/generate/facade.hpp"

#include <algorithm>
#include <cmath>

namespace nif::generate {
namespace {

constexpr Double3 kUp{0, 1, 0};

size_t bays_of(const Facade& facade, const Wall& wall, size_t side) {
  return std::max<size_t>(1, size_t(wall.length_of(side) / facade.bay + 0.5));
}

}  // namespace

std::vector<Ground> rectangle(double x, double z, const Ground& c) {
  return {{c.x - x / 2, c.z + z / 2},
          {c.x + x / 2, c.z + z / 2},
          {c.x + x / 2, c.z - z / 2},
          {c.x - x / 2, c.z - z / 2}};
}

std::vector<Opening> windows_of(const Facade& facade, Wall& wall,
                                const std::function<bool(size_t, size_t, size_t)>& closed) {
  std::vector<Opening> openings;
  wall.heights = {0};
  for (size_t s = 0; s < facade.storeys; ++s) {
    const double floor = facade.plinth + facade.storey * double(s);
    wall.heights.push_back(floor + facade.sill);
    wall.heights.push_back(floor + facade.head);
  }
  wall.heights.push_back(facade.top());
  wall.lines.assign(wall.corners.size(), {});
  for (size_t side = 0; side < wall.corners.size(); ++side) {
    const size_t bays = bays_of(facade, wall, side);
    const double bay = wall.length_of(side) / double(bays), half = std::min(facade.window, 0.8 * bay) / 2;
    for (size_t b = 0; b < bays; ++b) {
      const double middle = bay * (double(b) + 0.5);
      wall.lines[side].push_back(middle - half);
      wall.lines[side].push_back(middle + half);
      for (size_t s = 0; s < facade.storeys; ++s)
        if (!closed(side, b, s))
          openings.push_back(
              {side, b, s, middle - half, middle + half, wall.heights[1 + 2 * s], wall.heights[2 + 2 * s]});
    }
  }
  wall.depth = [closed, recess = facade.recess](size_t side, size_t column, size_t row) {
    const bool opening = column % 2 == 1 && row % 2 == 1;
    return opening && !closed(side, column / 2, row / 2) ? recess : 0;
  };
  return openings;
}

void add_window(Assembly& assembly, const Facade& facade, const Wall& wall, const Opening& o,
                size_t transoms) {
  const double middle = (o.from + o.to) / 2, back = -facade.recess + 0.025;
  assembly.beam(wall.at(o.side, o.from - 0.1, o.low - 0.03, 0.02),
                wall.at(o.side, o.to + 0.1, o.low - 0.03, 0.02), kUp, 0.2, 0.08);
  assembly.beam(wall.at(o.side, middle, o.low + 0.011, back), wall.at(o.side, middle, o.high - 0.011, back),
                wall.outwards(o.side), 0.07, 0.06);
  for (size_t i = 1; i <= transoms; ++i) {
    const double height = o.low + (o.high - o.low) * (double(i) / double(transoms + 1));
    assembly.beam(wall.at(o.side, o.from + 0.012, height, back - 0.003),
                  wall.at(o.side, o.to - 0.012, height, back - 0.003), kUp, 0.05, 0.06);
  }
}

void add_shutters(Assembly& assembly, const Wall& wall, const Opening& o) {
  const double half = (o.to - o.from) / 4;
  for (const double middle : {o.from - half - 0.13, o.to + half + 0.13})
    assembly.beam(wall.at(o.side, middle, o.low + 0.02, 0.025), wall.at(o.side, middle, o.high - 0.02, 0.025),
                  wall.outwards(o.side), 2 * half, 0.06);
}

void add_balcony(Assembly& assembly, const Wall& wall, const Opening& o, double floor) {
  constexpr double kReach = 1.3, kRail = 1.05;
  const double from = o.from - 0.55, to = o.to + 0.55;
  const auto at = [&](double along, double height, double out) {
    return wall.at(o.side, along, floor + height, out);
  };
  assembly.beam(at(from, -0.1, kReach / 2 - 0.04), at(to, -0.1, kReach / 2 - 0.04), kUp, kReach + 0.05, 0.18);
  assembly.beam(at(from + 0.03, kRail, kReach - 0.08), at(to - 0.03, kRail, kReach - 0.08), kUp, 0.07, 0.06);
  for (const double along : {from + 0.06, to - 0.06})
    assembly.beam(at(along, kRail - 0.004, -0.05), at(along, kRail - 0.004, kReach - 0.05), kUp, 0.06, 0.05);
  const auto bars = size_t((to - from) / 0.24);
  for (size_t i = 0; i < bars; ++i) {
    const double along = from + 0.06 + (to - from - 0.12) * double(i) / double(bars - 1);
    assembly.beam(at(along, -0.05, kReach - 0.08), at(along, kRail, kReach - 0.08), wall.outwards(o.side),
                  0.028, 0.03);
  }
}

void add_door(Assembly& assembly, const Wall& wall, size_t side, double middle, double floor) {
  const auto at = [&](double along, double height, double out) {
    return wall.at(side, middle + along, height, out);
  };
  assembly.beam(at(0, floor - 0.02, 0.02), at(0, floor + 2.1, 0.02), wall.outwards(side), 1.0, 0.07);
  for (const double aside : {-0.58, 0.58})
    assembly.beam(at(aside, floor - 0.03, 0.05), at(aside, floor + 2.12, 0.05), wall.outwards(side), 0.15,
                  0.18);
  assembly.beam(at(-0.8, floor + 2.22, 0.2), at(0.8, floor + 2.22, 0.2), kUp, 0.75, 0.14);
  for (size_t panel = 0; panel < 4; ++panel) {
    const double x = panel % 2 ? 0.22 : -0.22, y = floor + (panel < 2 ? 0.5 : 1.45);
    assembly.beam(at(x, y - 0.35, 0.05), at(x, y + 0.35, 0.05), wall.outwards(side), 0.3, 0.04);
  }
  const auto steps = size_t(std::max(1.0, floor / 0.15));
  for (size_t i = 0; i < steps; ++i) {
    const double high = floor * double(i + 1) / double(steps), out = 0.5 + 0.3 * double(steps - i);
    assembly.beam(at(-0.8 - 0.01 * double(i), high / 2 - 0.03, out / 2),
                  at(0.8 + 0.01 * double(i), high / 2 - 0.03, out / 2), kUp, out, high + 0.02);
  }
}

}  // namespace nif::generate
