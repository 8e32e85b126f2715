// Goes down from the whole picture to squares that the triangle touches, until it has found a texel that blocks
// and one that does not.
#include "formats/mesh/alpha_picture.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace nif::mesh::detail {
namespace {

/// Coordinates beyond it are so far away that a double hardly tells one texel from the next.
constexpr double kFarthest = 0x1p31;
/// Triangles count as this much larger, in texels, so that no rounding of coordinates can make a difference.
constexpr double kSlack = 0x1p-6;

/// Along one axis.
struct Interval {
  double least, most;
};

/// Whether a triangle may touch a rectangle: they do unless one of five lines separates them.
bool touch(const std::array<TexelPoint, 3>& corners, const std::array<Interval, 2>& box) {
  for (size_t a = 0; a < 2; ++a) {
    const auto [least, most] = std::minmax({corners[0][a], corners[1][a], corners[2][a]});
    if (most < box[a].least || least > box[a].most) return false;
  }
  for (size_t i = 0; i < 3; ++i) {
    const TexelPoint &from = corners[i], &to = corners[(i + 1) % 3], &other = corners[(i + 2) % 3];
    const TexelPoint normal{to[1] - from[1], from[0] - to[0]};
    const double side = normal[0] * (other[0] - from[0]) + normal[1] * (other[1] - from[1]);
    // The box's corner that is farthest on the side of the triangle's third corner.
    const double sign = side < 0 ? -1 : 1;
    double reach = 0;
    for (size_t a = 0; a < 2; ++a)
      reach += normal[a] * ((sign * normal[a] > 0 ? box[a].most : box[a].least) - from[a]);
    // Without area, it lies on both sides of the line.
    if (side != 0 && sign * reach < 0) return false;
  }
  return true;
}

}  // namespace

AlphaPicture::AlphaPicture(AlphaTexels texels) {
  Level& first = levels_.emplace_back(Level{texels.width, texels.height, {}});
  first.ranges.reserve(texels.alpha.size());
  for (const uint16_t alpha : texels.alpha) first.ranges.push_back({alpha, alpha});
  while (levels_.back().ranges.size() > 1) {
    const Level& below = levels_.back();
    Level level{(below.width + kBlock - 1) / kBlock, (below.height + kBlock - 1) / kBlock, {}};
    level.ranges.resize(size_t{level.width} * level.height, {UINT16_MAX, 0});
    for (uint32_t y = 0; y < below.height; ++y)
      for (uint32_t x = 0; x < below.width; ++x) {
        const Range& from = below.ranges[size_t{y} * below.width + x];
        Range& to = level.ranges[size_t{y / kBlock} * level.width + x / kBlock];
        to = {std::min(to.least, from.least), std::max(to.most, from.most)};
      }
    levels_.push_back(std::move(level));
  }
}

/// Of one triangle, over all repetitions of the picture.
class AlphaPicture::Search {
 public:
  Search(const AlphaPicture& picture, uint32_t least, uint64_t& steps)
      : picture_(picture), least_(least), left_(steps) {}

  bool done() const { return blocks_ && passes_; }
  TriangleAlpha found() const {
    return done() ? TriangleAlpha::cut : passes_ ? TriangleAlpha::clear : TriangleAlpha::solid;
  }

  /// Looks at one repetition. `corners` are relative to it. `clamped`: texels at the borders go on for ever.
  void look(const std::array<TexelPoint, 3>& corners, const std::array<bool, 2>& clamped) {
    corners_ = corners;
    clamped_ = clamped;
    visit(uint32_t(picture_.levels_.size()) - 1, 0, 0);
  }
  /// Looks at everything.
  void look_everywhere() { note(picture_.levels_.back().ranges[0]); }

 private:
  void note(const Range& range) {
    blocks_ |= range.most >= least_;
    passes_ |= range.least < least_;
  }

  /// Recursion is as deep as there are levels: nine of the largest picture.
  void visit(uint32_t number, uint32_t x, uint32_t y) {
    if (left_ == 0 || ++taken_ > kMostStepsOfOne) return look_everywhere();
    --left_;
    const Level& level = picture_.levels_[number];
    const Range& range = level.ranges[size_t{y} * level.width + x];
    const bool blocks = range.most >= least_, passes = range.least < least_;
    if ((blocks_ || !blocks) && (passes_ || !passes)) return;  // nothing new
    const auto side = double(uint64_t{1} << (kBlockBits * number));
    if (!touch(corners_, {interval(0, x, side), interval(1, y, side)})) return;
    if (!blocks || !passes) return note(range);
    const Level& below = picture_.levels_[number - 1];  // a texel is not both
    for (uint32_t row = y * kBlock; row < std::min((y + 1) * kBlock, below.height); ++row)
      for (uint32_t column = x * kBlock; column < std::min((x + 1) * kBlock, below.width); ++column)
        visit(number - 1, column, row);
  }

  /// Of a square, with the slack.
  Interval interval(size_t axis, uint32_t at, double side) const {
    const double end = axis == 0 ? picture_.width() : picture_.height();
    Interval interval{at * side - kSlack, std::min((at + 1) * side, end) + kSlack};
    if (clamped_[axis] && at == 0) interval.least = -2 * kFarthest;
    if (clamped_[axis] && (at + 1) * side >= end) interval.most = 2 * kFarthest;
    return interval;
  }

  const AlphaPicture& picture_;
  const uint32_t least_;
  bool blocks_ = false, passes_ = false;  ///< texels of that kind have been found
  uint64_t& left_;                        ///< steps, for the file
  uint32_t taken_ = 0;                    ///< for the triangle
  std::array<TexelPoint, 3> corners_{};
  std::array<bool, 2> clamped_{};
};

TriangleAlpha AlphaPicture::show(const std::array<TexelPoint, 3>& corners, const std::array<Wrap, 2>& wrap,
                                 uint32_t least, uint64_t& steps) const {
  Search search(*this, least, steps);
  const std::array<double, 2> size{double(width()), double(height())};
  const std::array<bool, 2> clamped{wrap[0] == Wrap::clamp, wrap[1] == Wrap::clamp};
  std::array<double, 2> first{}, last{};
  bool far = false;
  for (size_t a = 0; a < 2; ++a) {
    const auto [low, high] = std::minmax({corners[0][a], corners[1][a], corners[2][a]});
    far = far || !(low >= -kFarthest && high <= kFarthest);  // also if one is NaN
    if (clamped[a]) continue;
    first[a] = std::floor((low - kSlack) / size[a]);
    last[a] = std::floor((high + kSlack) / size[a]);
  }
  if (far || (last[0] - first[0] + 1) * (last[1] - first[1] + 1) > kMostTiles) {
    search.look_everywhere();
    return search.found();
  }
  for (double row = first[1]; row <= last[1]; ++row)
    for (double column = first[0]; column <= last[0] && !search.done(); ++column) {
      const std::array<double, 2> tile{column, row};
      std::array<TexelPoint, 3> relative;
      for (size_t i = 0; i < 3; ++i)
        for (size_t a = 0; a < 2; ++a) {
          const double at = corners[i][a] - tile[a] * size[a];
          const bool mirrored = wrap[a] == Wrap::mirror && std::fmod(tile[a], 2) != 0;
          relative[i][a] = mirrored ? size[a] - at : at;
        }
      search.look(relative, clamped);
    }
  return search.found();
}

}  // namespace nif::mesh::detail
