// Codes the tiles of an alpha map (docs/format.md, "The alpha map payload"): for each row of tiles, first which of
// them are clear, solid or mixed, then the texels of the mixed ones, row by row. Each texel is coded in the context of
// twelve texels around it that are known, as in JBIG (ITU-T T.82). docs/results/cutouts.md says what that is worth.
#pragma once

#include <array>
#include <memory>

#include "formats/base/range_coder.hpp"
#include "kernels/reference/holes/holes_field.hpp"

namespace nif::format {

/// The texels of a tile that are in the picture, as bits.
constexpr uint64_t texels_of_tile(const kernels::AlphaMap& map, uint32_t column, uint32_t row) {
  constexpr uint32_t kTile = kernels::kAlphaTile;
  const uint32_t width = map.width - column * kTile, height = map.height - row * kTile;
  const uint64_t line = width >= kTile ? 0xff : (uint64_t{1} << width) - 1;
  const uint64_t all = line * 0x0101010101010101u;
  return height >= kTile ? all : all & ((uint64_t{1} << kTile * height) - 1);
}

/// One for both directions, as formats/base/range_coder.hpp has it.
template <class Coder>
class AlphaMapCoder {
 public:
  /// Fills `tiles`, all 0 at first, of a map. `truth` has those to encode, which a decoder does not read.
  AlphaMapCoder(Coder& coder, const kernels::AlphaMap& map, const uint64_t* truth, uint64_t* tiles)
      : coder_(coder),
        map_(map),
        truth_(truth),
        tiles_(tiles),
        columns_(kernels::alpha_tiles(map.width)),
        models_(std::make_unique<Models>()) {}

  /// Returns false if the file is damaged: then the tiles are undefined.
  bool code() {
    const uint32_t rows = kernels::alpha_tiles(map_.height);
    for (uint32_t row = 0; row < rows; ++row) {
      if (!coder_.possible()) return false;
      code_kinds(row);
      for (uint32_t y = 0; y < kernels::kAlphaTile && row * kernels::kAlphaTile + y < map_.height; ++y)
        for (uint32_t column = 0; column < columns_; ++column)
          if (kind_above_[column] == kMixed) code_line(column, row, y);
      for (uint32_t column = 0; column < columns_; ++column)
        if (kind_above_[column] == kMixed && kind_of(tile(column, row), texels(column, row)) != kMixed)
          return false;
    }
    return true;
  }

 private:
  enum Kind : uint8_t { kClear, kSolid, kMixed, kKinds };
  struct Models {
    BitModel mixed[kKinds][kKinds];  ///< kinds of the tile to the left and of that above
    BitModel solid[kKinds][kKinds];
    BitModel texel[1 << 12];
  };

  static Kind kind_of(uint64_t tile, uint64_t all) {
    return tile == 0 ? kClear : tile == all ? kSolid : kMixed;
  }
  uint64_t texels(uint32_t column, uint32_t row) const { return texels_of_tile(map_, column, row); }
  size_t place(uint32_t column, uint32_t row) const { return size_t{row} * columns_ + column; }
  uint64_t& tile(uint32_t column, uint32_t row) { return tiles_[place(column, row)]; }
  uint64_t truth(uint32_t column, uint32_t row) const {
    return truth_ == nullptr ? 0 : truth_[place(column, row)];
  }

  void code_kinds(uint32_t row) {
    kind_above_.resize(columns_, kClear);
    Kind left = kClear;
    for (uint32_t column = 0; column < columns_; ++column) {
      const uint64_t all = texels(column, row);
      const Kind above = kind_above_[column], kind = kind_of(truth(column, row), all);
      const bool mixed = coder_.bit(models_->mixed[left][above], kind == kMixed);
      const bool solid = !mixed && coder_.bit(models_->solid[left][above], kind == kSolid);
      if (solid) tile(column, row) = all;
      kind_above_[column] = left = mixed ? kMixed : solid ? kSolid : kClear;
    }
  }

  /// A line of texels of a tile and of the tiles beside it: the tile's own begin at bit 8. Beyond the picture they are 0.
  uint32_t around(uint32_t column, uint32_t y) const {
    const uint32_t row = y / kernels::kAlphaTile, shift = y % kernels::kAlphaTile * kernels::kAlphaTile;
    const auto line = [&](uint32_t from) { return uint32_t(tiles_[place(from, row)] >> shift & 255); };
    return (column > 0 ? line(column - 1) : 0) | line(column) << 8 |
           (column + 1 < columns_ ? line(column + 1) << 16 : 0);
  }

  void code_line(uint32_t column, uint32_t row, uint32_t line) {
    const uint32_t y = row * kernels::kAlphaTile + line, shift = line * kernels::kAlphaTile;
    const uint32_t above = y >= 1 ? around(column, y - 1) : 0, second = y >= 2 ? around(column, y - 2) : 0;
    const uint64_t wanted = truth(column, row) >> shift;
    uint32_t own = around(column, y);
    for (uint32_t x = 0; x < kernels::kAlphaTile && column * kernels::kAlphaTile + x < map_.width; ++x) {
      const uint32_t context =
          (own >> (x + 4) & 15) | (above >> (x + 6) & 31) << 4 | (second >> (x + 7) & 7) << 9;
      own |= uint32_t{coder_.bit(models_->texel[context], wanted >> x & 1)} << (x + 8);
    }
    tile(column, row) |= uint64_t{own >> 8 & 255} << shift;
  }

  Coder& coder_;
  const kernels::AlphaMap& map_;
  const uint64_t* truth_;
  uint64_t* tiles_;
  const uint32_t columns_;
  const std::unique_ptr<Models> models_;
  std::vector<Kind> kind_above_;  ///< by column: of the row of tiles that is coded, or of the one before
};

}  // namespace nif::format
