// docs/encodings/cutout.md, "Boxes around what blocks", derives why no rounding can put a point that blocks outside.
#include "kernels/cpu/holes/blocking_boxes.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace nif::kernels::cpu {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
/// A patch is looked at in at most this many rows, and columns, of cells; in fewer if there is a patch for each triangle or
/// two, because the time to load an object must not be far above that of its triangles.
constexpr double kMostCells = 128, kCellsOfATriangle = 512;
/// Of a patch whose place is computed with, in texels: then rounding moves no point by as much as kSlack.
constexpr double kMostTexels = 0x1p15, kLeastArea = 1;
/// Hulls are larger than what they are around by as many texels.
constexpr double kSlack = 1;
/// More than rounding can move a place, in texels.
constexpr double kRounding = 0x1p-8;

/// Texels from the first to the last, along an axis.
struct Span {
  int64_t first, last;
};

/// An alpha map, and in cells of 8, 64, 512 and 4096 texels along a side whether any blocks light.
class Cells {
 public:
  static constexpr uint32_t kLevels = 5;

  Cells(const AlphaMap& map, SharedCopies& copies) : map_(map) {
    size_t words = 0;
    for (uint32_t level = 1; level < kLevels; ++level) {
      row_words_[level] = (columns(level) + 31) / 32;
      start_[level] = words;
      words += row_words_[level] * rows(level);
    }
    cells_ = copies.get(Shared::alpha_map, map.tiles, words, [&](uint32_t* to) { fill(to); });
  }

  /// Does any texel block light? Whatever the map shows beyond its borders.
  bool any_blocks(uint32_t level, Span x, Span y) const {
    Span columns[2], rows[2];
    const int across = within(x, map_.width, map_.wrap[0], columns),
              down = within(y, map_.height, map_.wrap[1], rows);
    for (int i = 0; i < down; ++i)
      for (int k = 0; k < across; ++k)
        if (any_in_map(level, columns[k], rows[i])) return true;
    return false;
  }

 private:
  uint32_t columns(uint32_t level) const { return ((map_.width - 1) >> 3 * level) + 1; }
  uint32_t rows(uint32_t level) const { return ((map_.height - 1) >> 3 * level) + 1; }

  void fill(uint32_t* to) const {
    for (uint32_t level = 1; level < kLevels; ++level)
      for (uint32_t row = 0; row < rows(level); ++row)
        for (uint32_t column = 0; column < columns(level); ++column) {
          bool any = false;
          if (level == 1) {
            any = map_.tiles[size_t{row} * columns(1) + column] != 0;
          } else {
            const uint32_t end_row = std::min(8 * row + 8, rows(level - 1)),
                           end_column = std::min(8 * column + 8, columns(level - 1));
            for (uint32_t i = 8 * row; i < end_row; ++i)
              for (uint32_t k = 8 * column; k < end_column; ++k) any = any || bit(to, level - 1, k, i);
          }
          to[start_[level] + size_t{row} * row_words_[level] + column / 32] |= uint32_t(any) << column % 32;
        }
  }
  bool bit(const uint32_t* cells, uint32_t level, int64_t column, int64_t row) const {
    return (cells[start_[level] + size_t(row) * row_words_[level] + size_t(column / 32)] >> column % 32 &
            1) != 0;
  }

  /// The texels of the map that are shown, and perhaps others. Returns how many spans they are.
  static int within(Span span, uint32_t size, uint32_t wrap, Span to[2]) {
    const int64_t last = int64_t{size} - 1, more = span.last - span.first;
    to[0] = {0, last};
    if (span.first >= 0 && span.last <= last) {
      to[0] = span;
    } else if (wrap == kAlphaClamp) {
      to[0] = {std::clamp<int64_t>(span.first, 0, last), std::clamp<int64_t>(span.last, 0, last)};
    } else if (more < last) {
      const int64_t first = wrapped_texel(span.first, size, wrap), end = wrapped_texel(span.last, size, wrap);
      if (wrap == kAlphaRepeat && first > end) {
        to[0] = {0, end};
        to[1] = {first, last};
        return 2;
      }
      to[0] = {std::min(first, end), std::max(first, end)};
      // A mirrored span that passes a border goes on to it from both ends.
      const auto copy = [&](int64_t texel) { return int64_t(std::floor(double(texel) / double(size))); };
      if (wrap == kAlphaMirror && copy(span.first) != copy(span.last)) {
        if (copy(span.last) % 2 == 0)
          to[0].first = 0;
        else
          to[0].last = last;
      }
    }
    return 1;
  }
  bool any_in_map(uint32_t level, Span x, Span y) const {
    const uint32_t shift = 3 * level;
    for (int64_t row = y.first >> shift; row <= y.last >> shift; ++row)
      for (int64_t column = x.first >> shift; column <= x.last >> shift; ++column) {
        if (level == 0) {
          if (blocks_light(map_, column, row)) return true;
          continue;
        }
        if (!bit(cells_, level, column, row)) continue;
        // What of the cell is asked for?
        const auto part = [&](Span all, int64_t at, uint32_t size) {
          const int64_t end = std::min(((at + 1) << shift) - 1, int64_t{size} - 1);
          return Span{std::max(all.first, at << shift), std::min(all.last, end)};
        };
        const Span inside_x = part(x, column, map_.width), inside_y = part(y, row, map_.height);
        const auto is_whole = [&](Span inside, int64_t at, uint32_t size) {
          return inside.first == at << shift &&
                 inside.last == std::min(((at + 1) << shift) - 1, int64_t{size} - 1);
        };
        if ((is_whole(inside_x, column, map_.width) && is_whole(inside_y, row, map_.height)) ||
            any_in_map(level - 1, inside_x, inside_y))
          return true;
      }
    return false;
  }

  const AlphaMap map_;
  size_t start_[kLevels] = {}, row_words_[kLevels] = {};
  const uint32_t* cells_;
};

/// A triangle in a map.
struct Places {
  double corners[3][2];

  /// How far it reaches along `axis` between two values of the other coordinate. Returns false if it does not.
  bool reach(int axis, double low, double high, double& first, double& last) const {
    first = kInfinity;
    last = -kInfinity;
    const auto add = [&](double at) {
      first = std::min(first, at);
      last = std::max(last, at);
    };
    for (int k = 0; k < 3; ++k) {
      const double* const next = corners[(k + 1) % 3];
      const double from = corners[k][axis], other = corners[k][1 - axis];
      if (low <= other && other <= high) add(from);
      for (const double at : {low, high})
        if ((other < at) != (next[1 - axis] < at))
          add(from + (next[axis] - from) * ((at - other) / (next[1 - axis] - other)));
    }
    return first <= last;
  }
};

/// How far something reaches in each direction.
struct Reach {
  double directions[kHullSides][2], far[kHullSides];

  Reach() {
    for (uint32_t i = 0; i < kHullSides; ++i) {
      const double angle = 2 * std::numbers::pi / kHullSides * i;
      directions[i][0] = std::cos(angle);
      directions[i][1] = std::sin(angle);
      far[i] = -kInfinity;
    }
  }
  void add(const double at[2]) {
    for (uint32_t i = 0; i < kHullSides; ++i)
      far[i] = std::max(far[i], directions[i][0] * at[0] + directions[i][1] * at[1]);
  }
  /// Moves sides inwards that lie beyond where their neighbours meet.
  void tighten() {
    const double most = 1 / (2 * directions[1][0]);
    for (uint32_t n = 0; n < 3 * kHullSides; ++n) {
      const uint32_t i = n % kHullSides;
      const double both = far[(i + 1) % kHullSides] + far[(i + kHullSides - 1) % kHullSides];
      far[i] = std::min(far[i], both * most);
    }
  }
  /// Where two sides that follow each other meet. No direction between theirs reaches farther than this corner, even if
  /// a side is too far out: such a direction is a sum of theirs with positive weights.
  void corner(uint32_t i, double at[2]) const {
    const uint32_t k = (i + 1) % kHullSides;
    const double *const p = directions[i], *const q = directions[k], turn = p[0] * q[1] - p[1] * q[0];
    at[0] = (far[i] * q[1] - far[k] * p[1]) / turn;
    at[1] = (far[k] * p[0] - far[i] * q[0]) / turn;
  }
};

/// How far what blocks of a triangle reaches, as found in strips along `axis`, in cells of a level.
Reach reach_of(const Cells& cells, uint32_t level, const Places& places, int axis) {
  Reach reach;
  double low = kInfinity, high = -kInfinity;
  for (const auto& corner : places.corners) {
    low = std::min(low, corner[1 - axis]);
    high = std::max(high, corner[1 - axis]);
  }
  const int64_t cell = int64_t{1} << 3 * level;
  const auto cell_at = [&](double at) { return int64_t(std::floor(at)) >> 3 * level; };
  for (int64_t strip = cell_at(low - kRounding); strip <= cell_at(high + kRounding); ++strip) {
    const double begin = std::max(double(strip * cell), low) - kRounding,
                 end = std::min(double(strip * cell + cell), high) + kRounding;
    double left, right;
    if (!places.reach(axis, begin, end, left, right)) continue;
    left -= kRounding;
    right += kRounding;
    // A point that rounding puts into another strip is as near to what blocks there as kSlack allows.
    const Span across{std::max(strip * cell, int64_t(std::floor(low - kRounding))),
                      std::min(strip * cell + cell - 1, int64_t(std::floor(high + kRounding)))},
        whole{int64_t(std::floor(left)), int64_t(std::floor(right))};
    const auto blocks = [&](uint32_t at_level, int64_t at) {
      const Span along{std::max(at << 3 * at_level, whole.first),
                       std::min(((at + 1) << 3 * at_level) - 1, whole.last)};
      return axis == 0 ? cells.any_blocks(at_level, along, across)
                       : cells.any_blocks(at_level, across, along);
    };
    int64_t first = whole.first >> 3 * level, last = whole.last >> 3 * level;
    while (first <= last && !blocks(level, first)) ++first;
    if (first > last) continue;
    while (!blocks(level, last)) --last;
    // Where in these cells? There may be nothing, because within() may tell too much.
    const uint32_t finer = level == 0 ? 0 : level - 1;
    if (finer != level) {
      first = std::max(8 * first, whole.first >> 3 * finer);
      last = std::min(8 * last + 7, whole.last >> 3 * finer);
      for (int i = 0; i < 7 && first < last && !blocks(finer, first); ++i) ++first;
      for (int i = 0; i < 7 && first < last && !blocks(finer, last); ++i) --last;
    }
    const double from = std::max(left, double(first << 3 * finer) - kRounding),
                 to = std::min(right, double((last + 1) << 3 * finer) + kRounding);
    for (const double other : {begin, end})
      for (const double along : {from, to}) {
        double at[2];
        at[axis] = along;
        at[1 - axis] = other;
        reach.add(at);
      }
  }
  return reach;
}

}  // namespace

BlockingBoxes::BlockingBoxes(const HolesField& holes, SharedCopies& copies, std::pmr::memory_resource* memory)
    : holes_(holes), hulls_(memory) {
  const double triangles = double(holes.numbers.count) / std::max(1.0, double(holes.patch_count));
  most_cells_ = std::min(kMostCells, std::sqrt(kCellsOfATriangle * triangles));
  hulls_.reserve(holes.patch_count);
  for (uint32_t i = 0; i < holes.patch_count; ++i) hulls_.push_back(hull_of(holes.patches[i], copies));
}

BlockingBoxes::Hull BlockingBoxes::hull_of(const AlphaPatch& patch, SharedCopies& copies) const {
  Hull hull{};
  Places places;
  double low[2] = {kInfinity, kInfinity}, high[2] = {-kInfinity, -kInfinity};
  for (int k = 0; k < 3; ++k)
    for (int a = 0; a < 2; ++a) {
      const double at = std::ldexp(double(patch.places[k][a]), int(patch.shift) - int(kAlphaFraction));
      places.corners[k][a] = at;
      low[a] = std::min(low[a], at);
      high[a] = std::max(high[a], at);
    }
  const double size = std::max(high[0] - low[0], high[1] - low[1]);
  const auto edge = [&](int k, int a) { return places.corners[k][a] - places.corners[0][a]; };
  const double area = edge(1, 0) * edge(2, 1) - edge(1, 1) * edge(2, 0);
  if (!(size <= kMostTexels && std::abs(area) >= kLeastArea)) return hull;

  const Cells cells(holes_.maps[patch.map], copies);
  uint32_t level = 0;
  while (size > most_cells_ * double(1 << 3 * level)) ++level;
  Reach reach = reach_of(cells, level, places, 0);
  const Reach other = reach_of(cells, level, places, 1);
  for (uint32_t i = 0; i < kHullSides; ++i) reach.far[i] = std::min(reach.far[i], other.far[i]) + kSlack;
  if (!(reach.far[0] > -kInfinity)) return hull;  // nothing blocks
  reach.tighten();
  for (uint32_t i = 0; i < kHullSides; ++i) {
    double at[2];
    reach.corner(i, at);
    for (int a = 0; a < 2; ++a) at[a] -= places.corners[0][a];
    hull.second[i] = (at[0] * edge(2, 1) - at[1] * edge(2, 0)) / area;
    hull.third[i] = (at[1] * edge(1, 0) - at[0] * edge(1, 1)) / area;
  }
  hull.known = true;
  return hull;
}

void BlockingBoxes::shrink(uint32_t triangle, const float* const corners[3], float low[3],
                           float high[3]) const {
  const AlphaPatch* const patch = patch_of(holes_, triangle);
  if (patch == nullptr) return;
  const Hull& hull = hulls_[size_t(patch - holes_.patches)];
  if (!hull.known) return;
  for (int a = 0; a < 3; ++a) {
    const double from = double{corners[0][a]};
    double least = kInfinity, most = -kInfinity;
    for (uint32_t i = 0; i < kHullSides; ++i) {
      const double at = (from + hull.second[i] * (double{corners[1][a]} - from)) +
                        hull.third[i] * (double{corners[2][a]} - from);
      least = std::min(least, at);
      most = std::max(most, at);
    }
    // A float may be on the other side by half a unit.
    low[a] = std::max(low[a], std::nextafter(float(least), -std::numeric_limits<float>::infinity()));
    high[a] = std::min(high[a], std::nextafter(float(most), std::numeric_limits<float>::infinity()));
  }
}

}  // namespace nif::kernels::cpu
