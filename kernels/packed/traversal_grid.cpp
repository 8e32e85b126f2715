// Builds the boxes for empty-space skipping. The box of an empty voxel grows as a cube, then side by side,
// while all voxels in it are alike. Summed-area tables in 3D (Crow 1984) test that in constant time.
#include "kernels/packed/traversal_grid.hpp"

#include <algorithm>
#include <utility>

#include "kernels/reference/planes/grid_traversal.hpp"

namespace nif::kernels::cpu {
namespace {

// make_voxels() has room for the words of a grid without empty bricks.
static_assert(uint64_t{kMaxVoxels} * kMaxVoxels * kMaxVoxels <= uint64_t{1} << 28);

/// How many voxels are alike in any box: sums over all voxels below and before each (Crow 1984).
class Counts {
 public:
  Counts(const uint32_t (&size)[3], std::pmr::memory_resource* memory)
      : row_(size[0] + 1), layer_(row_ * (size[1] + 1)), sums_(layer_ * (size[2] + 1), memory) {}

  /// Counts the voxels for which counted(voxel) is true.
  template <class Counted>
  void count(const uint32_t (&size)[3], const Counted& counted) {
    int32_t voxel[3];
    for (voxel[2] = 0; voxel[2] < int32_t(size[2]); ++voxel[2])
      for (voxel[1] = 0; voxel[1] < int32_t(size[1]); ++voxel[1]) {
        uint32_t in_row = 0;
        for (voxel[0] = 0; voxel[0] < int32_t(size[0]); ++voxel[0]) {
          in_row += counted(voxel) ? 1u : 0u;
          const size_t at =
              size_t(voxel[0] + 1) + row_ * size_t(voxel[1] + 1) + layer_ * size_t(voxel[2] + 1);
          sums_[at] = in_row + sums_[at - row_] + sums_[at - layer_] - sums_[at - row_ - layer_];
        }
      }
  }

  /// In voxels low to high, inclusive.
  uint32_t within(const int32_t (&low)[3], const int32_t (&high)[3]) const {
    const size_t x0 = size_t(low[0]), x1 = size_t(high[0]) + 1;
    const auto between = [&](int32_t y, int32_t z) {
      const uint32_t* row = sums_.data() + row_ * size_t(y) + layer_ * size_t(z);
      return row[x1] - row[x0];
    };
    return between(high[1] + 1, high[2] + 1) - between(low[1], high[2] + 1) - between(high[1] + 1, low[2]) +
           between(low[1], low[2]);
  }

 private:
  size_t row_, layer_;
  std::pmr::vector<uint32_t> sums_;
};

/// A box around a voxel or a brick. It grows as long as it holds only counted voxels.
struct Box {
  const uint32_t (&size)[3];
  const Counts& counts;
  int32_t low[3], high[3], most[6];  ///< most: limit of each side

  /// From one voxel to another, both inclusive.
  Box(const uint32_t (&size_)[3], const Counts& counts_, const uint32_t (&from)[3], const uint32_t (&to)[3])
      : size(size_), counts(counts_) {
    for (uint32_t a = 0; a < 3; ++a) {
      low[a] = int32_t(from[a]);
      high[a] = int32_t(to[a]);
      most[2 * a] = std::max(low[a] - int32_t(kMaxExtent), 0);
      most[2 * a + 1] = std::min(high[a] + int32_t(kMaxExtent), int32_t(size[a]) - 1);
    }
  }

  /// Moves the sides from `first` to `last` outward by `by`: all of them, or none.
  bool grow(uint32_t first, uint32_t last, int32_t by) {
    int32_t new_low[3], new_high[3];
    uint32_t volume = 1;
    for (uint32_t a = 0; a < 3; ++a) {
      const bool down = first <= 2 * a && 2 * a <= last, up = first <= 2 * a + 1 && 2 * a + 1 <= last;
      new_low[a] = down ? std::max(low[a] - by, most[2 * a]) : low[a];
      new_high[a] = up ? std::min(high[a] + by, most[2 * a + 1]) : high[a];
      volume *= uint32_t(new_high[a] - new_low[a] + 1);
    }
    if (counts.within(new_low, new_high) != volume) return false;
    std::copy_n(new_low, 3, low);
    std::copy_n(new_high, 3, high);
    return true;
  }
};

/// The word of the voxels from `low` to `high`, with a box around them.
uint32_t with_box(uint32_t word, const uint32_t (&size)[3], const Counts& counts, const uint32_t (&low)[3],
                  const uint32_t (&high)[3]) {
  Box box(size, counts, low, high);
  // First as a cube, then each side by itself.
  for (int32_t by = 8; by > 0; by /= 2) box.grow(0, 5, by);
  for (int32_t by = 4; by > 0; by /= 2)
    for (uint32_t side = 0; side < 6; ++side) box.grow(side, side, by);
  uint32_t extents[6];
  for (uint32_t a = 0; a < 3; ++a) {
    extents[2 * a] = low[a] - uint32_t(box.low[a]);
    extents[2 * a + 1] = uint32_t(box.high[a]) - high[a];
  }
  return make_boxed(word, extents);
}

/// Calls visit(place) for all places of a grid, in order of z, y, x.
template <class Visit>
void for_all(const uint32_t (&size)[3], const Visit& visit) {
  uint32_t place[3];
  for (place[2] = 0; place[2] < size[2]; ++place[2])
    for (place[1] = 0; place[1] < size[1]; ++place[1])
      for (place[0] = 0; place[0] < size[0]; ++place[0]) visit(place);
}

/// The voxel at a place in a brick of 2^levels voxels along each axis. Returns false if it lies beyond the
/// grid.
bool voxel_in(const uint32_t (&brick)[3], uint32_t levels, uint32_t place, const uint32_t (&size)[3],
              uint32_t (&voxel)[3]) {
  bool within = true;
  for (uint32_t a = 0; a < 3; ++a) {
    voxel[a] = (brick[a] << levels) + (place >> a * levels & ((1u << levels) - 1));
    within &= voxel[a] < size[a];
  }
  return within;
}

}  // namespace

/// The words of all voxels of a field, without boxes.
struct VoxelWords {
  const uint32_t (&size)[3];
  std::pmr::vector<uint32_t> words;  ///< [z][y][x]

  template <class WordOf>
  VoxelWords(const PlanesField& field, const WordOf& word_of, std::pmr::memory_resource* memory)
      : size(field.voxels), words(memory) {
    words.reserve(size_t(size[0]) * size[1] * size[2]);
    for_all(size, [&](const uint32_t(&voxel)[3]) {
      words.push_back(word_of({int32_t(voxel[0]), int32_t(voxel[1]), int32_t(voxel[2])}));
    });
  }

  /// Calls visit(word, its place in the brick) for each voxel of the grid in a brick of 2^levels.
  template <class Visit>
  void for_brick(const uint32_t (&brick)[3], uint32_t levels, const Visit& visit) const {
    for (uint32_t place = 0; place < 1u << 3 * levels; ++place) {
      uint32_t voxel[3];
      if (voxel_in(brick, levels, place, size, voxel))
        visit(words[voxel[0] + size[0] * (voxel[1] + size[1] * size_t(voxel[2]))], place);
    }
  }
  /// The word that all of the brick's voxels share, or a word of kind kLink if they differ or are surface.
  uint32_t word_of_brick(const uint32_t (&brick)[3], uint32_t levels) const {
    uint32_t all = kLink;
    for_brick(brick, levels, [&](uint32_t word, uint32_t place) {
      if (place == 0 && word_kind(word) == kEmptyVoxel) all = word;
      if (word != all) all = kLink;
    });
    return all;
  }
};

namespace {

/// Number of words with bricks of 2^levels voxels, those of bricks and those of voxels.
size_t words_with(const VoxelWords& voxels, uint32_t levels) {
  if (levels == 0) return voxels.words.size();
  const uint32_t bricks[3] = {traversal_bricks(voxels.size[0], levels),
                              traversal_bricks(voxels.size[1], levels),
                              traversal_bricks(voxels.size[2], levels)};
  size_t words = 0;
  for_all(bricks, [&](const uint32_t(&brick)[3]) {
    words += 1 + (voxels.word_of_brick(brick, levels) == kLink ? size_t{1} << 3 * levels : 0);
  });
  return words;
}

struct BrickChoice {
  uint32_t levels;
  size_t words;
};
BrickChoice choose_bricks(const VoxelWords& voxels, size_t most_without_bricks) {
  BrickChoice best{0, words_with(voxels, 0)};
  if (!kWithBricks || best.words * sizeof(uint32_t) <= most_without_bricks) return best;
  for (const uint32_t levels : {1u, 2u})
    if (const size_t words = words_with(voxels, levels); words < best.words) best = {levels, words};
  return best;
}

}  // namespace

TraversalGrid::TraversalGrid(const PlanesField& field, std::pmr::memory_resource* memory,
                             size_t most_without_bricks)
    : bricks(memory), voxels(memory), children(field.children, field.children + field.child_count, memory) {
  {
    VoxelWords all(
        field, [&](const int32_t(&voxel)[3]) { return voxel_word(field, voxel); }, memory);
    const BrickChoice choice = choose_bricks(all, most_without_bricks);
    brick_levels = choice.levels;
    for (uint32_t a = 0; a < 3; ++a) size[a] = traversal_bricks(field.voxels[a], brick_levels);
    if (has_bricks())
      fill_bricks(all, choice.words);
    else
      voxels = std::move(all.words);
  }
  add_boxes(field.voxels, memory);
}

void TraversalGrid::fill_bricks(const VoxelWords& all, size_t words) {
  const size_t count = size_t(size[0]) * size[1] * size[2];
  bricks.reserve(count);
  voxels.reserve(std::max<size_t>(words - count, 1));
  for_all(size, [&](const uint32_t(&brick)[3]) {
    const uint32_t word = all.word_of_brick(brick, brick_levels);
    bricks.push_back(word == kLink ? make_voxels(uint32_t(voxels.size())) : word | kBrickBit);
    if (word != kLink) return;
    const size_t first = voxels.size();
    voxels.resize(first + (size_t{1} << 3 * brick_levels), make_empty(0));
    all.for_brick(brick, brick_levels, [&](uint32_t own, uint32_t place) { voxels[first + place] = own; });
  });
  // Kernels read one word even for lanes that need none.
  if (voxels.empty()) voxels.push_back(make_empty(0));
}

void TraversalGrid::add_boxes(const uint32_t (&voxel_count)[3], std::pmr::memory_resource* memory) {
  // Boxes that are written meanwhile leave these bits as they are.
  constexpr uint32_t kPlainBits = 0xff;
  Counts counts(voxel_count, memory);
  for (uint32_t side = 0; side < kSeenBoth; ++side) {
    const uint32_t plain = make_empty(side);
    bool any = false;
    counts.count(voxel_count, [&](const int32_t(&voxel)[3]) {
      const bool counted = (word_at(voxel) & (kPlainBits & ~kBrickBit)) == plain;
      any |= counted;
      return counted;
    });
    if (!any) continue;
    const auto add_box = [&](uint32_t& word, const uint32_t(&low)[3], uint32_t levels) {
      uint32_t high[3];
      for (uint32_t a = 0; a < 3; ++a) high[a] = std::min(low[a] + (1u << levels), voxel_count[a]) - 1;
      word = with_box(word, voxel_count, counts, low, high);
    };
    size_t number = 0;
    for_all(size, [&](const uint32_t(&brick)[3]) {
      uint32_t& word = has_bricks() ? bricks[number] : voxels[number];
      ++number;
      if (!has_bricks()) {
        if (word == plain) word = with_box(word, voxel_count, counts, brick, brick);
        return;
      }
      const uint32_t low[3] = {brick[0] << brick_levels, brick[1] << brick_levels, brick[2] << brick_levels};
      if (word == (plain | kBrickBit)) add_box(word, low, brick_levels);
      if (word_kind(word) != kLink) return;
      for (uint32_t place = 0; place < 1u << 3 * brick_levels; ++place) {
        uint32_t voxel[3];
        uint32_t& own = voxels[voxels_first(word) + place];
        if (own == plain && voxel_in(brick, brick_levels, place, voxel_count, voxel)) add_box(own, voxel, 0);
      }
    });
  }
}

uint32_t TraversalGrid::word_at(const int32_t (&voxel)[3]) const {
  if (!has_bricks()) {
    const auto at = [&](uint32_t a) { return uint32_t(voxel[a]); };
    return voxels[at(0) + size[0] * (at(1) + size[1] * size_t(at(2)))];
  }
  uint32_t number[3], place = 0;
  for (uint32_t a = 0; a < 3; ++a) {
    number[a] = uint32_t(voxel[a]) >> brick_levels;
    place |= (uint32_t(voxel[a]) - (number[a] << brick_levels)) << a * brick_levels;
  }
  const uint32_t word = bricks[number[0] + size[0] * (number[1] + size[1] * size_t(number[2]))];
  return is_brick(word) ? word : voxels[voxels_first(word) + place];
}

size_t traversal_bytes(const PlanesField& field) {
  const auto word_of = [&](const int32_t(&voxel)[3]) {
    const VoxelState state = voxel_state(field, voxel);
    return state == VoxelState::surface ? kBareCell : make_empty(seen_in(state));
  };
  const VoxelWords voxels(field, word_of, std::pmr::get_default_resource());
  return (choose_bricks(voxels, kMostWithoutBricks).words + field.child_count) * sizeof(uint32_t);
}

}  // namespace nif::kernels::cpu
