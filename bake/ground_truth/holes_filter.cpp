// Two filters, which differ in where they look: one computes the place of a hit anew, in double precision; the
// other scales the weights that Embree gives it. Both answer for single rays, packets and streams, because
// Embree hands them `N` hits side by side, 1 for a single ray.
#include "bake/ground_truth/holes_filter.hpp"

#include <embree3/rtcore.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "formats/base/vector.hpp"

namespace nif::bake {
namespace {

using mesh::AlphaMap;
using mesh::TriangleHoles;
using mesh::Wrap;

/// The texel of a map that one outside of it shows, along one axis.
uint32_t wrapped(int64_t texel, uint32_t size, Wrap wrap) {
  const auto modulo = [&](int64_t period) {
    const int64_t rest = texel % period;
    return rest < 0 ? rest + period : rest;
  };
  switch (wrap) {
    case Wrap::repeat:
      return uint32_t(modulo(size));
    case Wrap::mirror: {
      const int64_t period = 2 * int64_t(size), rest = modulo(period);
      return uint32_t(rest < int64_t(size) ? rest : period - 1 - rest);
    }
    case Wrap::clamp:
      break;
  }
  return uint32_t(std::clamp<int64_t>(texel, 0, int64_t(size) - 1));
}

/// The whole number below, far within 64 bits even for what is no number.
int64_t floor_of(double x) {
  constexpr double kFarthest = 0x1p60;
  return !(x > -kFarthest) ? -int64_t(kFarthest) : int64_t(std::floor(std::min(x, kFarthest)));
}

bool bit_of(const uint64_t* tiles, uint32_t tiles_of_row, uint32_t x, uint32_t y) {
  constexpr uint32_t kTile = AlphaMap::kTile;
  const uint64_t tile = tiles[size_t(y / kTile) * tiles_of_row + x / kTile];
  return (tile >> (x % kTile + kTile * (y % kTile)) & 1) != 0;
}

/// Calls a filter for each hit of a call, and rejects those in holes.
template <class Filter>
void reject_holes(const RTCFilterFunctionNArguments* arguments) {
  const auto& filter = *static_cast<const Filter*>(arguments->geometryUserPtr);
  const unsigned count = arguments->N;
  if (count == 1) {  // the compiler then knows how hits are stored
    if (arguments->valid[0] != 0 && !filter.blocks(*arguments, 1, 0)) arguments->valid[0] = 0;
    return;
  }
  for (unsigned i = 0; i < count; ++i)
    if (arguments->valid[i] != 0 && !filter.blocks(*arguments, count, i)) arguments->valid[i] = 0;
}

template <class Filter>
void set_filters(RTCGeometry geometry, Filter& filter) {
  rtcSetGeometryUserData(geometry, &filter);
  rtcSetGeometryIntersectFilterFunction(geometry, reject_holes<Filter>);
  rtcSetGeometryOccludedFilterFunction(geometry, reject_holes<Filter>);
}

size_t bytes_of(const mesh::AlphaMaps& maps) {
  size_t bytes = 0;
  for (const auto& map : maps) bytes += map->tiles.size() * sizeof(uint64_t);
  return bytes;
}

class ExactFilter final : public HolesFilter {
 public:
  explicit ExactFilter(const EmbreeObject& object)
      : holes_(object.holes.begin(), object.holes.end()),
        maps_(object.alpha_maps.begin(), object.alpha_maps.end()) {}

  void attach(RTCGeometry geometry) override {
    // The geometry's own, in which rays are given.
    vertices_ =
        static_cast<const mesh::Float3*>(rtcGetGeometryBufferData(geometry, RTC_BUFFER_TYPE_VERTEX, 0));
    triangles_ =
        static_cast<const mesh::Triangle*>(rtcGetGeometryBufferData(geometry, RTC_BUFFER_TYPE_INDEX, 0));
    set_filters(geometry, *this);
  }

  size_t bytes() const override { return holes_.size() * sizeof(holes_[0]) + bytes_of(maps_); }

  bool blocks(const RTCFilterFunctionNArguments& arguments, unsigned count, unsigned i) const {
    const uint32_t triangle = RTCHitN_primID(arguments.hit, count, i);
    const TriangleHoles& holes = holes_[triangle];
    if (!holes.any()) return true;
    RTCRayN* rays = arguments.ray;
    const Double3 origin{RTCRayN_org_x(rays, count, i), RTCRayN_org_y(rays, count, i),
                         RTCRayN_org_z(rays, count, i)},
        direction{RTCRayN_dir_x(rays, count, i), RTCRayN_dir_y(rays, count, i),
                  RTCRayN_dir_z(rays, count, i)};
    std::array<double, 2> weights;
    if (!find_weights(origin, direction, triangles_[triangle], weights))
      weights = {RTCHitN_u(arguments.hit, count, i), RTCHitN_v(arguments.hit, count, i)};
    return bake::blocks(holes, *maps_[holes.map], weights);
  }

 private:
  /// Those of the second and the third vertex: vertices are sheared so that the ray runs along its longest axis (Woop,
  /// Benthin and Wald 2013). False if it lies in the triangle's plane.
  bool find_weights(const Double3& origin, const Double3& direction, const mesh::Triangle& triangle,
                    std::array<double, 2>& weights) const {
    size_t along = 0;
    for (size_t a = 1; a < 3; ++a)
      if (std::abs(direction[a]) > std::abs(direction[along])) along = a;
    const std::array<size_t, 2> across{(along + 1) % 3, (along + 2) % 3};
    double seen[3][2];
    for (size_t k = 0; k < 3; ++k) {
      const Double3 from = to_double(vertices_[triangle[k]]) - origin;
      for (size_t a = 0; a < 2; ++a)
        seen[k][a] = from[across[a]] - direction[across[a]] / direction[along] * from[along];
    }
    const auto side = [&](size_t i, size_t j) { return seen[i][0] * seen[j][1] - seen[i][1] * seen[j][0]; };
    const double second = side(0, 2), third = side(1, 0), sum = side(2, 1) + second + third;
    if (!(sum > 0 || sum < 0)) return false;
    weights = {second / sum, third / sum};
    return true;
  }

  std::vector<TriangleHoles> holes_;
  mesh::AlphaMaps maps_;
  const mesh::Float3* vertices_ = nullptr;
  const mesh::Triangle* triangles_ = nullptr;
};

class FastFilter final : public HolesFilter {
 public:
  explicit FastFilter(const EmbreeObject& object)
      : shared_(object.alpha_maps.begin(), object.alpha_maps.end()) {
    for (const auto& map : shared_)
      maps_.push_back({map->tiles.data(), map->tiles_of_row(), {map->width, map->height}, map->wrap});
    triangles_.reserve(object.holes.size());
    for (const TriangleHoles& holes : object.holes) {
      Places& places = triangles_.emplace_back();
      places.map = holes.map;
      if (!holes.any()) continue;
      for (size_t axis = 0; axis < 2; ++axis) place(holes, axis, places.axes[axis]);
    }
  }

  void attach(RTCGeometry geometry) override { set_filters(geometry, *this); }

  size_t bytes() const override {
    return triangles_.size() * sizeof(triangles_[0]) + maps_.size() * sizeof(maps_[0]) + bytes_of(shared_);
  }

  bool blocks(const RTCFilterFunctionNArguments& arguments, unsigned count, unsigned i) const {
    const Places& places = triangles_[RTCHitN_primID(arguments.hit, count, i)];
    if (places.map == TriangleHoles::kNoMap) return true;
    const Map& map = maps_[places.map];
    const float u = RTCHitN_u(arguments.hit, count, i), v = RTCHitN_v(arguments.hit, count, i);
    return bit_of(map.tiles, map.tiles_of_row, texel(places, map, 0, u, v), texel(places, map, 1, u, v));
  }

 private:
  struct Map {
    const uint64_t* tiles;
    uint32_t tiles_of_row;
    std::array<uint32_t, 2> size;
    std::array<Wrap, 2> wrap;
  };
  /// A triangle's part of its map, in texels. Half a cache line.
  struct alignas(32) Places {
    uint32_t map;
    struct Axis {
      float start, along_u, along_v;
    } axes[2];
  };

  void place(const TriangleHoles& holes, size_t axis, Places::Axis& to) const {
    const Map& map = maps_[holes.map];
    std::array<double, 3> at;
    for (size_t k = 0; k < 3; ++k)
      at[k] = std::ldexp(holes.places[k][axis], int(holes.shift) - int(TriangleHoles::kFraction));
    double start = at[0];
    // Close to 0, floats are most accurate, and most triangles lie within the map, which needs no wrapping.
    if (map.wrap[axis] != Wrap::clamp) {
      const double period = map.size[axis] * (map.wrap[axis] == Wrap::mirror ? 2.0 : 1.0);
      start -= period * std::floor(std::min({at[0], at[1], at[2]}) / period);
    }
    to = {float(start), float(at[1] - at[0]), float(at[2] - at[0])};
  }

  static uint32_t texel(const Places& places, const Map& map, size_t axis, float u, float v) {
    const Places::Axis& line = places.axes[axis];
    const float at = line.start + u * line.along_u + v * line.along_v;
    // Conversion by way of signed integers is the fast one.
    if (at >= 0 && at < float(int32_t(map.size[axis]))) return uint32_t(int32_t(at));
    return wrapped(floor_of(double(at)), map.size[axis], map.wrap[axis]);
  }

  mesh::AlphaMaps shared_;
  std::vector<Map> maps_;
  std::vector<Places> triangles_;
};

}  // namespace

bool blocks(const TriangleHoles& holes, const AlphaMap& map, const std::array<double, 2>& weights) {
  const auto texel = [&](size_t axis, uint32_t size) {
    const auto place = [&](size_t corner) { return double(holes.places[corner][axis]); };
    const double at = (place(0) + weights[0] * (place(1) - place(0))) + weights[1] * (place(2) - place(0));
    const int exponent = int(holes.shift) - int(TriangleHoles::kFraction);
    return wrapped(floor_of(std::ldexp(at, exponent)), size, map.wrap[axis]);
  };
  return bit_of(map.tiles.data(), map.tiles_of_row(), texel(0, map.width), texel(1, map.height));
}

std::unique_ptr<HolesFilter> HolesFilter::make(const EmbreeObject& object, HoleTest test) {
  if (std::ranges::none_of(object.holes, &TriangleHoles::any)) return nullptr;
  if (test == HoleTest::exact) return std::make_unique<ExactFilter>(object);
  return std::make_unique<FastFilter>(object);
}

}  // namespace nif::bake
