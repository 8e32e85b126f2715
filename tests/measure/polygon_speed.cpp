// A study, not a test: how fast polygons are cut into triangles. docs/results/reading.sh runs it.
//
// polygon_speed POLYGONS
//
// Prints millions of corners per second of processor time: for convex quads, and for random polygons of 3 to
// 200 corners, most of them concave, half of them with holes.
#include <fmt/format.h>

#include <cstdlib>
#include <ctime>

#include "formats/mesh/polygon.hpp"
#include "tests/support/polygons.hpp"

namespace {

using namespace nif;

double seconds() {
  timespec time{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return double(time.tv_sec) + 1e-9 * double(time.tv_nsec);
}

/// Millions of corners per second.
template <class Next>
double speed(size_t polygons, const Next& next) {
  std::vector<mesh::Float3> positions;
  std::vector<mesh::Triangle> triangles;
  std::vector<std::pair<size_t, size_t>> each;  // first triangle and number of corners
  size_t corners = 0;
  for (size_t i = 0; i < polygons; ++i) {
    const test::GridPolygon polygon = next();
    if (polygon.size() < 4) continue;
    const auto base = uint32_t(positions.size());
    each.push_back({triangles.size(), polygon.size()});
    for (const test::GridPoint& p : polygon)
      positions.push_back({float(p.x), float(p.y), float(p.x - 2 * p.y)});
    for (uint32_t k = 2; k < polygon.size(); ++k) triangles.push_back({base, base + k - 1, base + k});
    corners += polygon.size();
  }
  mesh::detail::PolygonCutter cutter;
  const double start = seconds();
  for (const auto& [first, count] : each)
    (void)cutter.cut(positions, std::span(triangles).subspan(first, count - 2));
  return double(corners) / 1e6 / (seconds() - start);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2 || std::atoi(argv[1]) <= 0) {
    fmt::print(stderr, "usage: polygon_speed POLYGONS\n");
    return 2;
  }
  const auto polygons = size_t(std::atoi(argv[1]));
  test::RandomPolygons random(1);
  const double quads = speed(20 * polygons, [&]() -> test::GridPolygon {
    const auto x = int64_t(random.below(1000)), y = int64_t(random.below(1000));
    return {{x, y}, {x + 2, y}, {x + 3, y + 4}, {x - 1, y + 2}};
  });
  const double others = speed(polygons, [&] { return random.next(3 + random.below(198)); });
  fmt::print("{:.1f} {:.1f}\n", quads, others);
}
