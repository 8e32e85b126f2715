// Extends the planes of neighbours into a cell, and takes their weighted mean. See cell_prediction.hpp.
#include "formats/nif/planes/cell_prediction.hpp"

#include <algorithm>
#include <bit>
#include <cstdlib>
#include <span>

namespace nif::format {
namespace {

/// Planes that pass the shared face far from its middle say little about the cell. The bounds of that
/// distance are in 1/256 of the cell's side; hints beyond the last one have the last weight.
constexpr int32_t kFar[] = {90, 154, 230};
constexpr int32_t kWeights[] = {8, 5, 2, 1};
/// A larger neighbour was fitted to more than lies at the face.
constexpr int32_t weight_of_larger(int32_t weight) { return (weight + 1) / 2; }
/// Bounds of the mean difference of normals from their mean, which is kNormalSum long.
constexpr int32_t kNormalSpreads[] = {3, 6, 10, 16, 24, 40};
static_assert(std::size(kNormalSpreads) + 3 == kDoubts);
/// Bounds of half the distance between the heights that neighbours expect, in offsets.
constexpr int32_t kHeightSpreads[] = {4, 10, 20, 40, 80};
static_assert(std::size(kHeightSpreads) + 3 == kOffsetDoubts);

constexpr int32_t kFraction = 256;  // of a finest cell, and of a unit of height

/// To nearest, halves away from 0; `divisor` is above 0.
int64_t rounded(int64_t value, int64_t divisor) {
  return value >= 0 ? (value + divisor / 2) / divisor : -((-value + divisor / 2) / divisor);
}
int64_t dot(const CellVector& a, const CellVector& b) {
  return int64_t{a[0]} * b[0] + int64_t{a[1]} * b[1] + int64_t{a[2]} * b[2];
}
/// A normal and its opposite describe the same planes.
int32_t sign_along(const CellVector& normal, const CellVector& other) {
  return dot(normal, other) < 0 ? -1 : 1;
}

CellHint hint_of(const FoundCell& found, const CellCube& cell, size_t face) {
  CellHint hint;
  hint.normal = found.normal();
  CellVector middle = cell.middle(), from;  // of the face; and to it from the neighbour's middle; times two
  middle[face / 2] += face % 2 ? cell.side : -cell.side;
  for (size_t a = 0; a < 3; ++a) from[a] = middle[a] - 2 * found.low[a] - found.side;
  const int64_t between = int64_t{found.lower() + found.upper() - kFraction} * offset_unit(found.side),
                off = between - dot(hint.normal, from) * (kFraction / 2),  // height that the middle lacks
      length = dot(hint.normal, hint.normal);
  const int64_t along = off * 4096 / length;  // one division, which is slow, instead of three
  for (size_t a = 0; a < 3; ++a)
    hint.surface[a] = int64_t{middle[a]} * (kFraction / 2) + (along * hint.normal[a] >> 12);

  const auto beyond = [&](int32_t bound) {
    const int64_t distance = int64_t{bound} * cell.side;
    return off * off >= distance * distance * length;
  };
  size_t reach = 0;
  while (reach < std::size(kFar) && beyond(kFar[reach])) ++reach;
  hint.weight = found.side > cell.side ? weight_of_larger(kWeights[reach]) : kWeights[reach];
  hint.thickness = (found.upper() - found.lower()) * offset_unit(found.side) * cell.side / found.side;
  return hint;
}

/// Sets u, v and the doubt from the hints, of which there is at least one.
void predict_normal(CellPrediction& prediction) {
  const auto hints = std::span(prediction.hints).first(prediction.count);
  const CellHint& best = *std::max_element(
      hints.begin(), hints.end(), [](const CellHint& a, const CellHint& b) { return a.weight < b.weight; });
  CellVector sum{};
  for (const CellHint& hint : hints)
    for (size_t a = 0; a < 3; ++a)
      sum[a] += sign_along(hint.normal, best.normal) * hint.weight * hint.normal[a];
  if (sum[2] < 0) sum = {-sum[0], -sum[1], -sum[2]};
  const int32_t total = std::max(std::abs(sum[0]) + std::abs(sum[1]) + sum[2], 1);
  prediction.u = int32_t(rounded(int64_t{kernels::kNormalHalf} * (sum[0] + sum[1]), total));
  prediction.v = int32_t(rounded(int64_t{kernels::kNormalHalf} * (sum[0] - sum[1]), total));

  int32_t spread = 0;
  for (const CellHint& hint : hints) {
    const int32_t sign = sign_along(hint.normal, sum);
    for (size_t a = 0; a < 3; ++a)
      spread += hint.weight * std::abs(sign * hint.normal[a] - kernels::kNormalSum * sum[a] / total);
  }
  prediction.doubt = hints.size() == 1 ? 1 : 2 + rank(spread / prediction.weight, kNormalSpreads);
}

}  // namespace

CellPrediction predict_planes(const Neighbours& neighbours, const CellCube& cell) {
  CellPrediction prediction;
  for (size_t face = 0; face < 6; ++face) {
    const FoundCell& found = neighbours.faces[face];
    if (!found.has_planes() || found.is_bare()) continue;
    const CellHint& hint = prediction.hints[prediction.count++] = hint_of(found, cell, face);
    prediction.weight += hint.weight;
  }
  if (prediction.count > 0) predict_normal(prediction);
  return prediction;
}

uint32_t thickness_class(const CellPrediction& prediction, const CellCube& cell) {
  if (prediction.count == 0) return 0;
  int64_t sum = 0;
  for (size_t h = 0; h < prediction.count; ++h)
    sum += int64_t{prediction.hints[h].thickness} * prediction.hints[h].weight;
  const auto mean = uint32_t(sum / prediction.weight / offset_unit(cell.side));
  const auto bits = uint32_t(std::bit_width(mean));
  if (bits < 2) return 2 * bits;
  const uint32_t lower_half = ~mean >> (bits - 2) & 1;
  return std::min(2 * bits - lower_half, kThicknessClasses - 1);
}

OffsetPrediction predict_lower(const CellPrediction& prediction, const CellCube& cell,
                               const CellVector& normal, int32_t thickness) {
  constexpr int32_t kOffsets = kernels::kPlaneOffsets;
  const CellVector middle = cell.middle();
  const int32_t unit = offset_unit(cell.side);
  int32_t twice = kOffsets;  // the offset in the middle between the planes
  auto doubt = uint32_t(prediction.count);
  if (prediction.count > 0) {
    int64_t sum = 0, lowest = INT64_MAX, highest = INT64_MIN;  // heights of the surface, times 256
    for (size_t h = 0; h < prediction.count; ++h) {
      const CellHint& hint = prediction.hints[h];
      int64_t height = 0;
      for (size_t a = 0; a < 3; ++a)
        height += normal[a] * (hint.surface[a] - int64_t{middle[a]} * (kFraction / 2));
      sum += height * hint.weight;
      lowest = std::min(lowest, height);
      highest = std::max(highest, height);
    }
    twice += int32_t(std::clamp<int64_t>(rounded(sum / prediction.weight, unit), 1 - kOffsets, kOffsets - 1));
    if (prediction.count > 1) doubt = 2 + rank((highest - lowest) / unit / 2, kHeightSpreads);
  }
  return {std::clamp((twice - thickness) >> 1, 0, kOffsets - thickness), doubt};
}

}  // namespace nif::format
