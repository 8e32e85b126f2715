// Places become whole numbers, so that equal triangles have equal holes, wherever the picture is repeated.
#include "formats/mesh/hole_maker.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

namespace nif::mesh::detail {
namespace {

using Corners = std::array<TexelPoint, 3>;

double least_of(const Corners& corners, size_t axis) {
  return std::min({corners[0][axis], corners[1][axis], corners[2][axis]});
}

void move(Corners& corners, size_t axis, double periods, double period) {
  for (TexelPoint& corner : corners) corner[axis] = std::fma(periods, period, corner[axis]);
}

/// Moves them by whole periods, so that the least one is in the first.
void move_to_first(Corners& corners, size_t axis, double period) {
  move(corners, axis, -std::floor(least_of(corners, axis) / period), period);
  const double least = least_of(corners, axis);  // the quotient was rounded
  if (least < 0) move(corners, axis, 1, period);
  if (least >= period) move(corners, axis, -1, period);
}

/// In fixed point; nothing if they are too far away, or not numbers.
std::optional<TriangleHoles> fixed(const Corners& corners) {
  constexpr double kLeast = INT32_MIN, kMost = INT32_MAX;
  TriangleHoles holes;
  for (; holes.shift <= TriangleHoles::kFraction; ++holes.shift) {
    const double scale = std::ldexp(1.0, int(TriangleHoles::kFraction - holes.shift));
    bool fit = true;
    for (size_t i = 0; i < corners.size(); ++i)
      for (size_t a = 0; a < 2; ++a) {
        const double place = std::round(corners[i][a] * scale);
        const bool fits = place >= kLeast && place <= kMost;
        holes.places[i][a] = fits ? int32_t(place) : 0;
        fit = fit && fits;
      }
    if (fit) return holes;
  }
  return std::nullopt;
}

/// Where each texel of a map of `to` texels begins in a picture of `from`, along one axis, and the end: a texel belongs
/// to where its middle is. Each gets one at least.
std::vector<uint32_t> begins_of(uint64_t from, uint64_t to) {
  std::vector<uint32_t> begins;
  for (uint64_t i = 0; i <= to; ++i) begins.push_back(uint32_t((2 * from * i + to - 1) / (2 * to)));
  return begins;
}

void set(AlphaMap& map, uint32_t x, uint32_t y) {
  constexpr uint32_t kTile = AlphaMap::kTile;
  map.tiles[size_t{y / kTile} * map.tiles_of_row() + x / kTile] |= uint64_t{1}
                                                                   << (x % kTile + kTile * (y % kTile));
}

AlphaMap empty_map(const std::array<uint32_t, 2>& size, const std::array<Wrap, 2>& wrap) {
  AlphaMap map{size[0], size[1], wrap, {}};
  map.tiles.resize(size_t{map.tiles_of_row()} * ((map.height + AlphaMap::kTile - 1) / AlphaMap::kTile));
  return map;
}

/// A texel of the map blocks if at least half of those that it stands for do.
AlphaMap make_map(const AlphaPicture& picture, const std::array<Wrap, 2>& wrap, uint32_t least,
                  const std::array<uint32_t, 2>& size) {
  AlphaMap map = empty_map(size, wrap);
  const std::vector<uint32_t> columns = begins_of(picture.width(), map.width),
                              rows = begins_of(picture.height(), map.height);
  for (uint32_t y = 0; y < map.height; ++y)
    for (uint32_t x = 0; x < map.width; ++x) {
      uint64_t blocking = 0;
      for (uint32_t row = rows[y]; row < rows[y + 1]; ++row)
        for (uint32_t column = columns[x]; column < columns[x + 1]; ++column)
          blocking += picture.alpha(column, row) >= least;
      const uint64_t all = uint64_t{rows[y + 1] - rows[y]} * (columns[x + 1] - columns[x]);
      if (2 * blocking >= all) set(map, x, y);
    }
  return map;
}

}  // namespace

/// That of the picture, halved until it is small enough.
std::array<uint32_t, 2> HoleMaker::size_of(const AlphaPicture& picture) const {
  const uint32_t width = picture.width(), height = picture.height();
  const auto halved = [](uint32_t side, uint32_t times) {
    return uint32_t((side + (uint64_t{1} << times) - 1) >> times);
  };
  uint32_t times = 0;
  while (resolution_ != 0 && halved(std::max(width, height), times) > resolution_) ++times;
  return {halved(width, times), halved(height, times)};
}

size_t HoleMaker::values_below(const AlphaPicture& picture, uint32_t least) {
  const auto [known, fresh] = values_.try_emplace(&picture);
  std::vector<uint16_t>& values = known->second;
  if (fresh) {
    std::vector<bool> found(size_t{UINT16_MAX} + 1);
    for (uint32_t y = 0; y < picture.height(); ++y)
      for (uint32_t x = 0; x < picture.width(); ++x) found[picture.alpha(x, y)] = true;
    for (size_t value = 0; value < found.size(); ++value)
      if (found[value]) values.push_back(uint16_t(value));
  }
  return size_t(std::ranges::lower_bound(values, least) - values.begin());
}

/// Whether a map of this size is still allowed. Tiles at the borders count as a whole.
bool HoleMaker::take(const std::array<uint32_t, 2>& size) {
  constexpr uint64_t kTile = AlphaMap::kTile;
  const auto whole = [](uint64_t side) { return (side + kTile - 1) / kTile * kTile; };
  const uint64_t texels = std::max(whole(size[0]) * whole(size[1]), kLeastTexels);
  if (texels > texels_) return false;
  texels_ -= texels;
  return true;
}

HoleMaker::Map HoleMaker::map_of(const AlphaPicture& picture, const std::array<Wrap, 2>& wrap, uint32_t least,
                                 Filled& why) {
  const std::array<uint32_t, 2> size = size_of(picture);
  if (std::ranges::max(size) > AlphaMap::kMostSide) {
    why = Filled::large;
    return nullptr;
  }
  const auto [known, fresh] = maps_.try_emplace({&picture, values_below(picture, least), wrap});
  if (!known->second && take(size))
    known->second = std::make_shared<const AlphaMap>(make_map(picture, wrap, least, size));
  if (!known->second) why = Filled::many;
  return known->second;
}

NewHoles HoleMaker::of_picture(const AlphaPicture& picture, const std::array<Wrap, 2>& wrap, uint32_t least,
                               Corners corners) {
  const std::array<uint32_t, 2> sizes{picture.width(), picture.height()}, of_map = size_of(picture);
  for (size_t a = 0; a < 2; ++a) {
    const double size = sizes[a];
    if (wrap[a] != Wrap::clamp) move_to_first(corners, a, wrap[a] == Wrap::mirror ? 2 * size : size);
    if (of_map[a] != sizes[a])
      for (TexelPoint& corner : corners) corner[a] *= of_map[a] / size;
  }
  NewHoles made;
  if (const std::optional<TriangleHoles> holes = fixed(corners)) {
    made.holes = *holes;
    made.map = map_of(picture, wrap, least, made.why);
  } else {
    made.why = Filled::far;
  }
  return made;
}

/// The map has a texel that lets light through, left of one that blocks.
NewHoles HoleMaker::of_corners(const std::array<double, 3>& alphas) {
  NewHoles made{.map = nullptr, .why = Filled::far};
  const auto holes = fixed({TexelPoint{alphas[0], 0.5}, {alphas[1], 0.5}, {alphas[2], 0.5}});
  if (!holes) return made;
  if (!ramp_) {
    AlphaMap map = empty_map({2, 1}, {Wrap::clamp, Wrap::clamp});
    set(map, 1, 0);
    ramp_ = std::make_shared<const AlphaMap>(std::move(map));
  }
  made.map = ramp_;
  made.holes = *holes;
  return made;
}

}  // namespace nif::mesh::detail
