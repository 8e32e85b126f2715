// Codes cells, each in the context of its already known neighbours across its faces. The planes of a
// neighbour are extended into the cell, and what is coded is how the cell's own planes differ from that.
//
// Words come in the order of the payload: voxels, then parts of voxels, and so on. So all larger cells are
// known, and of the equally large ones those before. All of it is in integers. The proven sides follow from
// the planes (formats/nif/planes/sides.hpp), so they are coded only if a file says less.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdlib>
#include <memory>
#include <vector>

#include "formats/base/range_coder.hpp"
#include "formats/nif/planes/check.hpp"
#include "kernels/reference/planes/walk.hpp"

namespace nif::format {

template <class Coder>
class CellCoder {
 public:
  /// Reads only the occupancy, the levels and the numbers of voxels and parts of `field`, which must have
  /// been checked to fit together. `words` has room for the words of all voxels, then parts.
  CellCoder(Coder& coder, const kernels::PlanesField& field, uint32_t* words)
      : coder_(coder),
        field_(field),
        words_(words),
        cells_(size_t{field.surface_voxels} + field.part_count),
        models_(std::make_unique<Models>()) {}

  /// Fills the words. `truth` has the words to encode, such as a reader accepts; null when decoding.
  /// `kinds_stated`: kinds as they are; else a kind only says whether the cell separates, as kind_of({0, 0,
  /// separates}). Returns false if no encoder could have made this: then the words are undefined.
  bool code(const kernels::PlanesField* truth, bool kinds_stated) {
    std::fill_n(words_, cells_.size(), kUnknown);
    place_voxels();
    for (size_t i = 0; i < cells_.size(); ++i) {
      if (i >= size_t{field_.surface_voxels} + next_part_) return false;  // it belongs to no cell
      const uint32_t word = truth == nullptr            ? kernels::kBareCell
                            : i < field_.surface_voxels ? truth->voxel_records[i]
                                                        : truth->parts[i - field_.surface_voxels];
      const bool valid = code_cut(cells_[i], word) ? code_link(i, word) : code_planes(i, word, kinds_stated);
      if (!valid) return false;
    }
    return next_part_ == field_.part_count;
  }

 private:
  using Vector = std::array<int32_t, 3>;

  /// Marks a word that is not known yet.
  static constexpr uint32_t kUnknown = kernels::make_empty(0) | 1u << 8;

  /// A cube of finest cells.
  struct Cell {
    std::array<int16_t, 3> low;
    int16_t size;
  };

  /// The smallest cell at a place that is not smaller than was asked for.
  struct Found {
    uint32_t word = kernels::kEmptyPart;  ///< kEmptyPart: there is none
    Vector low{};
    int32_t size = 0;

    bool is_link() const { return kernels::word_kind(word) == kernels::kLink; }
    bool has_planes() const { return kernels::word_kind(word) < kernels::kPlaneKinds; }
    bool is_bare() const { return (word & ~15u) == kernels::kBareCell; }
    int32_t lower() const { return int32_t(kernels::lower_place(word)); }
    int32_t upper() const { return int32_t(kernels::upper_place(word)); }
  };

  /// The neighbours across the faces of a cell.
  struct Around {
    std::array<Found, 6> faces;                      ///< along x below and above, then y, then z
    uint32_t cut = 0, separating = 0, passable = 0;  ///< how many
    uint32_t thickest = 0;                           ///< of planes: bits of their distance in units of height
  };

  /// A neighbour's planes, extended to the middle of the shared face.
  struct Carried {
    Vector normal;
    std::array<int64_t, 3> point;  ///< between the planes, near the face's middle; in 1/256 of a finest cell
    int32_t weight;
    int32_t thickness;  ///< times the unit of places, as if the cell were as large as this one
  };
  static constexpr int32_t kFraction = 256;

  /// Prediction of the cell's planes.
  struct Expected {
    std::array<Carried, 6> carried;
    size_t count = 0;
    int32_t weight = 0;  ///< total
    int32_t u = kernels::kNormalHalf, v = kernels::kNormalHalf;
    uint32_t doubt = 0;  ///< 0: nothing is known; 1: one neighbour; 2 to 8: higher the less they agree
  };

  static constexpr uint32_t kDoubts = 9, kThicknesses = 4, kMisses = 4;
  struct Models {
    BitModel cut[kernels::kMaxLevels][8][5];
    BitModel mask[4][4][4][8];
    BitModel bare[kernels::kMaxLevels + 1];
    BitModel separating[2][5][4];
    SymbolModel<4> kind[2];
    BitModel turned[2];
    NumberModel<9> thickness[kernels::kMaxLevels + 1][2][16];
    DifferenceModel<6> u[kDoubts][kThicknesses], v[kDoubts][kThicknesses][kMisses];
    DifferenceModel<8> lower[8][5];
  };

  static uint32_t bits_of(int32_t value) { return uint32_t(std::bit_width(uint32_t(value))); }
  /// How many of the bounds, which ascend, are at most the value.
  template <size_t kCount>
  static uint32_t rank(int64_t value, const int32_t (&bounds)[kCount]) {
    uint32_t rank = 0;
    while (rank < kCount && value >= bounds[rank]) ++rank;
    return rank;
  }
  /// Rounds to nearest, halves away from 0; `divisor` is above 0.
  static int64_t rounded(int64_t value, int64_t divisor) {
    return value >= 0 ? (value + divisor / 2) / divisor : -((-value + divisor / 2) / divisor);
  }
  static int64_t dot(const Vector& a, const Vector& b) {
    return int64_t{a[0]} * b[0] + int64_t{a[1]} * b[1] + int64_t{a[2]} * b[2];
  }
  static Vector normal_of(uint32_t word) {
    const kernels::CellNormal normal = kernels::cell_normal(word);
    return {normal.x, normal.y, normal.z};
  }
  /// A place is this many units of height, times 128.
  static int32_t unit(int32_t size) { return kernels::kNormalHalf * size + 1; }

  uint32_t level_of(const Cell& cell) const { return field_.levels + 1 - bits_of(cell.size); }

  void place_voxels() {
    size_t i = 0;
    for (uint32_t z = 0, b = 0; z < field_.bricks[2]; ++z)
      for (uint32_t y = 0; y < field_.bricks[1]; ++y)
        for (uint32_t x = 0; x < field_.bricks[0]; ++x, ++b) {
          if (field_.brick_table[b] < kernels::kFirstMixedBrick) continue;
          const kernels::BrickStates& states =
              field_.brick_states[field_.brick_table[b] - kernels::kFirstMixedBrick];
          for (uint64_t left = states.surface & ~states.aux; left != 0; left &= left - 1) {
            const uint32_t bit = uint32_t(std::countr_zero(left));
            const uint32_t at[3] = {4 * x + (bit & 3), 4 * y + (bit >> 2 & 3), 4 * z + (bit >> 4)};
            cells_[i].size = int16_t(1 << field_.levels);
            for (size_t a = 0; a < 3; ++a) cells_[i].low[a] = int16_t(at[a] << field_.levels);
            ++i;
          }
        }
  }

  Found find(const Vector& at, int32_t size) const {
    Found found;
    int32_t voxel[3];
    for (size_t a = 0; a < 3; ++a) {
      if (at[a] < 0) return found;
      voxel[a] = at[a] >> field_.levels;
      if (voxel[a] >= int32_t(field_.voxels[a])) return found;
    }
    const kernels::BrickPlace place = kernels::brick_place(field_, voxel);
    if (place.entry < kernels::kFirstMixedBrick) return found;
    const kernels::BrickStates& states = field_.brick_states[place.entry - kernels::kFirstMixedBrick];
    if (kernels::state_in(states, place.bit) != kernels::VoxelState::surface) return found;
    const uint64_t before = states.surface & ~states.aux & ((uint64_t{1} << place.bit) - 1);
    found.word =
        words_[field_.voxel_base[place.entry - kernels::kFirstMixedBrick] + uint32_t(std::popcount(before))];
    found.size = 1 << field_.levels;
    while (found.is_link() && found.size > size) {
      found.size /= 2;
      uint32_t part = 0;
      for (size_t a = 0; a < 3; ++a) part |= (at[a] & found.size) != 0 ? 1u << a : 0u;
      if (!(kernels::link_mask(found.word) >> part & 1)) return {};
      found.word = words_[field_.surface_voxels + kernels::link_part(found.word, part)];
    }
    for (size_t a = 0; a < 3; ++a) found.low[a] = at[a] & ~(found.size - 1);
    return found;
  }

  /// Also finds the cell's neighbours, for the rest.
  bool code_cut(const Cell& cell, uint32_t truth) {
    around_ = {};
    for (size_t face = 0; face < 6; ++face) {
      Vector at{cell.low[0], cell.low[1], cell.low[2]};
      at[face / 2] += face % 2 ? cell.size : -cell.size;
      const Found& found = around_.faces[face] = find(at, cell.size);
      around_.cut += found.is_link();
      if (!found.has_planes()) continue;
      ++(separates(kernels::word_kind(found.word)) ? around_.separating : around_.passable);
      const int32_t apart = (found.upper() - found.lower()) * unit(found.size) / 128;
      around_.thickest = std::max(around_.thickest, bits_of(apart));
    }
    if (cell.size == 1) return false;
    BitModel& model = models_->cut[level_of(cell)][std::min(around_.thickest, 7u)][std::min(around_.cut, 4u)];
    return coder_.bit(model, kernels::word_kind(truth) == kernels::kLink);
  }

  bool code_link(size_t i, uint32_t truth) {
    const Cell cell = cells_[i];
    const uint32_t wanted = kernels::link_mask(truth);
    uint32_t mask = 0;
    for (uint32_t part = 0; part < 8; ++part) {
      uint32_t siblings = 0, there = 0;  // known, on its faces
      for (uint32_t a = 0; a < 3; ++a) {
        if (!(part >> a & 1)) continue;
        ++siblings;
        there += mask >> (part ^ 1u << a) & 1;
      }
      BitModel& model = models_->mask[siblings][there][std::min(surface_beside(cell, part), 6u) / 2]
                                     [std::min(uint32_t(std::popcount(mask)), 7u)];
      mask |= uint32_t{coder_.bit(model, (wanted >> part & 1) != 0)} << part;
    }
    const uint32_t parts = uint32_t(std::popcount(mask));
    if (parts == 0 || parts > field_.part_count - next_part_) return false;
    words_[i] = kernels::make_link(mask, next_part_);
    size_t next = size_t{field_.surface_voxels} + next_part_;
    for (uint32_t part = 0; part < 8; ++part)
      if (mask >> part & 1) cells_[next++] = part_of(cell, part);
    next_part_ += parts;
    return true;
  }

  static Cell part_of(Cell cell, uint32_t part) {
    cell.size = int16_t(cell.size / 2);
    for (size_t a = 0; a < 3; ++a)
      if (part >> a & 1) cell.low[a] = int16_t(cell.low[a] + cell.size);
    return cell;
  }

  /// How likely a surface meets the faces that a part shares with cells other than its siblings: 2 for each
  /// face that is met, 1 if nothing is known.
  uint32_t surface_beside(const Cell& cell, uint32_t part) const {
    const Cell child = part_of(cell, part);
    uint32_t sure = 0;
    for (size_t a = 0; a < 3; ++a) {
      const bool up = part >> a & 1;
      Vector at{child.low[0], child.low[1], child.low[2]};
      at[a] += up ? child.size : -child.size;
      const Found found = find(at, child.size);
      if (found.word == kUnknown)
        sure += found.size == child.size ? 2 : 1;
      else if (found.has_planes() && meets(found, child, a, up))
        sure += 2;
    }
    return sure;
  }

  /// Is a point of the child's face between the planes of the larger cell beyond it? The planes count as
  /// unbounded.
  static bool meets(const Found& found, const Cell& child, size_t axis, bool up) {
    const Vector normal = normal_of(found.word);
    Vector from;  // from the middle of the larger cell to that of the face, times two
    int32_t reach = 0;
    for (size_t a = 0; a < 3; ++a) {
      from[a] = 2 * (child.low[a] - found.low[a]) + child.size - found.size;
      if (a != axis) reach += std::abs(normal[a]) * child.size;
    }
    from[axis] += up ? child.size : -child.size;
    const int64_t height = dot(normal, from);
    const int64_t lower = int64_t{found.lower() - 128} * unit(found.size),
                  upper = int64_t{found.upper() - 128} * unit(found.size);
    return 64 * (height + reach) >= lower && 64 * (height - reach) <= upper;
  }

  bool code_planes(size_t i, uint32_t truth, bool kinds_stated) {
    const Cell cell = cells_[i];
    const uint32_t level = level_of(cell);
    const bool bare = coder_.bit(models_->bare[level], (truth & ~15u) == kernels::kBareCell);
    uint32_t kind = 0;
    if (kinds_stated) {
      kind = models_->kind[bare].code(coder_, kernels::word_kind(truth));
      if (kind >= kernels::kPlaneKinds) return false;
    } else {
      BitModel& model =
          models_->separating[bare][std::min(around_.separating, 4u)][std::min(around_.passable, 3u)];
      kind = kernels::kind_of({0, 0, coder_.bit(model, separates(kernels::word_kind(truth)))});
    }
    words_[i] = kernels::kBareCell | kind;
    if (bare) return true;

    const Expected expected = expect(cell);
    const int32_t thickness = code_thickness(cell, separates(kind), expected, truth);
    if (thickness > int32_t(kernels::kPlanePlaces)) return false;
    int32_t u = int32_t(truth >> 4 & 63), v = int32_t(truth >> 10 & 63);
    const int32_t missed = code_normal(expected, thickness, u, v);
    if (missed < 0) return false;
    const uint32_t normal = kernels::make_planes(kind, uint32_t(u), uint32_t(v), 0, 1);
    const int32_t lower = code_lower(cell, expected, normal, thickness, truth);
    if (lower < 0 || lower + thickness > int32_t(kernels::kPlanePlaces)) return false;
    words_[i] =
        kernels::make_planes(kind, uint32_t(u), uint32_t(v), uint32_t(lower), uint32_t(lower + thickness));
    return (words_[i] & ~15u) != kernels::kBareCell;
  }

  /// The planes of neighbours, and their mean.
  Expected expect(const Cell& cell) const {
    Expected expected;
    size_t surest = 0;
    for (size_t face = 0; face < 6; ++face) {
      const Found& found = around_.faces[face];
      if (!found.has_planes() || found.is_bare()) continue;
      expected.carried[expected.count] = carry(found, cell, face);
      expected.weight += expected.carried[expected.count].weight;
      if (expected.carried[expected.count].weight > expected.carried[surest].weight) surest = expected.count;
      ++expected.count;
    }
    if (expected.count == 0) return expected;

    // A normal and its opposite describe the same planes.
    Vector sum{};
    for (size_t c = 0; c < expected.count; ++c) {
      const Carried& carried = expected.carried[c];
      const int32_t sign = dot(carried.normal, expected.carried[surest].normal) < 0 ? -1 : 1;
      for (size_t a = 0; a < 3; ++a) sum[a] += sign * carried.weight * carried.normal[a];
    }
    if (sum[2] < 0) sum = {-sum[0], -sum[1], -sum[2]};
    const int32_t total = std::max(std::abs(sum[0]) + std::abs(sum[1]) + sum[2], 1);
    expected.u += int32_t(rounded(int64_t{kernels::kNormalHalf} * (sum[0] + sum[1]), total));
    expected.v += int32_t(rounded(int64_t{kernels::kNormalHalf} * (sum[0] - sum[1]), total));

    int32_t spread = 0;
    for (size_t c = 0; c < expected.count; ++c) {
      const Carried& carried = expected.carried[c];
      const int32_t sign = dot(carried.normal, sum) < 0 ? -1 : 1;
      for (size_t a = 0; a < 3; ++a)
        spread += carried.weight * std::abs(sign * carried.normal[a] - kernels::kNormalSum * sum[a] / total);
    }
    expected.doubt = expected.count == 1 ? 1 : 2 + rank(spread / expected.weight, {3, 6, 10, 16, 24, 40});
    return expected;
  }

  static Carried carry(const Found& found, const Cell& cell, size_t face) {
    Carried carried;
    carried.normal = normal_of(found.word);
    Vector middle, from;  // of the face; and to it from the middle of the other cell; times two
    for (size_t a = 0; a < 3; ++a) middle[a] = 2 * cell.low[a] + cell.size;
    middle[face / 2] += face % 2 ? cell.size : -cell.size;
    for (size_t a = 0; a < 3; ++a) from[a] = middle[a] - 2 * found.low[a] - found.size;
    // 256 times the heights of the middle between the planes, and of the face's middle.
    const int64_t height = int64_t{found.lower() + found.upper() - kFraction} * unit(found.size),
                  off = height - dot(carried.normal, from) * (kFraction / 2),
                  length = dot(carried.normal, carried.normal);
    const int64_t along = off * 4096 / length;  // one division, which is slow, instead of three
    for (size_t a = 0; a < 3; ++a)
      carried.point[a] = int64_t{middle[a]} * (kFraction / 2) + (along * carried.normal[a] >> 12);
    // Planes that pass the face far away say little about this cell.
    static constexpr int32_t kNear[] = {90, 154, 230}, kWeights[] = {8, 5, 2, 1};  // kNear: of 256, of a side
    uint32_t far = 0;
    while (far < 3 && off * off >= int64_t{kNear[far] * cell.size} * (kNear[far] * cell.size) * length) ++far;
    carried.weight = found.size > cell.size ? (kWeights[far] + 1) / 2 : kWeights[far];
    carried.thickness = (found.upper() - found.lower()) * unit(found.size) * cell.size / found.size;
    return carried;
  }

  /// In places; above 256 if it is wrong.
  int32_t code_thickness(const Cell& cell, bool wall, const Expected& expected, uint32_t truth) {
    int64_t sum = 0;
    for (size_t c = 0; c < expected.count; ++c)
      sum += int64_t{expected.carried[c].thickness} * expected.carried[c].weight;
    const int32_t mean = expected.count == 0 ? 0 : int32_t(sum / expected.weight / unit(cell.size));
    // Two classes between powers of two.
    const uint32_t bits = bits_of(mean);
    const bool upper_half = bits < 2 || (mean >> (bits - 2) & 1);
    const uint32_t about = bits == 0 ? 0 : std::min(2 * bits - (upper_half ? 0 : 1), 15u);
    return 1 + int32_t(models_->thickness[level_of(cell)][wall][about].code(
                   coder_, kernels::upper_place(truth) - kernels::lower_place(truth) - 1));
  }

  /// Codes u and v. Returns how far they are from the prediction; below 0 if they are wrong.
  int32_t code_normal(const Expected& expected, int32_t thickness, int32_t& u, int32_t& v) {
    constexpr int32_t kHalf = kernels::kNormalHalf, kMost = kernels::kNormalSum;
    int32_t like_u = expected.u, like_v = expected.v;
    const int32_t rim = std::max(std::abs(like_u - kHalf), std::abs(like_v - kHalf));
    const bool may_turn = expected.count > 0 && rim >= 22;
    // If z is about 0, the normal may be nearer to the opposite of the prediction.
    const auto nearer_turned = [&] {
      return std::max(std::abs(u - (kMost - expected.u)), std::abs(v - (kMost - expected.v))) <
             std::max(std::abs(u - expected.u), std::abs(v - expected.v));
    };
    const bool turned = may_turn && coder_.bit(models_->turned[rim >= 27], nearer_turned());
    if (turned) like_u = kMost - like_u, like_v = kMost - like_v;
    const uint32_t thick = rank(thickness, {8, 20, 48});
    const int32_t du = models_->u[expected.doubt][thick].code(coder_, u - like_u);
    const uint32_t miss = rank(std::abs(du), {1, 3, 7});
    const int32_t dv = models_->v[expected.doubt][thick][miss].code(coder_, v - like_v);
    u = like_u + du;
    v = like_v + dv;
    if (u < 0 || u > kMost || v < 0 || v > kMost) return -1;
    return may_turn && turned != nearer_turned() ? -1 : std::abs(du) + std::abs(dv);
  }

  /// The place of the lower plane; may be out of range. `word` has the normal.
  int32_t code_lower(const Cell& cell, const Expected& expected, uint32_t word, int32_t thickness,
                     uint32_t truth) {
    constexpr int32_t kPlaces = kernels::kPlanePlaces;
    const Vector normal = normal_of(word);
    int64_t sum = 0, lowest = 0, highest = 0;  // 256 times the heights at which neighbours have the surface
    for (size_t c = 0; c < expected.count; ++c) {
      const Carried& carried = expected.carried[c];
      int64_t height = 0;
      for (size_t a = 0; a < 3; ++a)
        height += normal[a] * (carried.point[a] - int64_t{2 * cell.low[a] + cell.size} * (kFraction / 2));
      sum += height * carried.weight;
      lowest = c == 0 ? height : std::min(lowest, height);
      highest = c == 0 ? height : std::max(highest, height);
    }
    const int32_t step = unit(cell.size);
    int64_t twice_middle = kPlaces;  // in places
    if (expected.count > 0)
      twice_middle += std::clamp<int64_t>(rounded(sum / expected.weight, step), 1 - kPlaces, kPlaces - 1);
    const int32_t like = std::clamp((int32_t(twice_middle) - thickness) >> 1, 0, kPlaces - thickness);
    const uint32_t spread = expected.count < 2 ? uint32_t(expected.count)
                                               : 2 + rank((highest - lowest) / step / 2, {4, 10, 20, 40, 80});
    DifferenceModel<8>& model = models_->lower[spread][rank(thickness, {6, 12, 24, 48})];
    return like + model.code(coder_, int32_t(kernels::lower_place(truth)) - like);
  }

  Coder& coder_;
  const kernels::PlanesField& field_;
  uint32_t* const words_;
  std::vector<Cell> cells_;
  const std::unique_ptr<Models> models_;
  Around around_;
  uint32_t next_part_ = 0;  ///< parts that links have named so far
};

}  // namespace nif::format
