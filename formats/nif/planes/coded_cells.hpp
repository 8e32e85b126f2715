// Codes the words of cells (docs/format.md, "Cells"): voxels, then children of voxels, and so on, so that all
// larger cells are known and of the equally large ones those before. What is coded is how a cell differs from
// what the cells around it let expect; contexts and predictions are in cell_neighbours.hpp and
// cell_prediction.hpp. The proven sides follow from the planes (cell_sides.hpp), so they are coded only if a
// file says less.
//
// There is one function for each element, in the order of docs/format.md, for both directions: it is given
// the value to encode, which a decoder does not look at, and returns the value that is in the file.
#pragma once

#include <algorithm>
#include <bit>
#include <cstdlib>
#include <memory>

#include "formats/base/range_coder.hpp"
#include "formats/nif/planes/cell_prediction.hpp"
#include "formats/nif/planes/check_planes.hpp"

namespace nif::format {

/// The models of all elements; contexts beyond the last model share it. docs/results/coding.md says what each
/// context is worth.
struct CellModels {
  static constexpr uint32_t kLevels = kernels::kMaxLevels + 1;
  /// Bounds of the distance between planes, in offsets: the closer they are, the better the normal is known,
  /// and the worse the offset.
  static constexpr int32_t kForNormal[] = {8, 20, 48}, kForOffset[] = {6, 12, 24, 48};
  /// Bounds of how far u was from what was expected.
  static constexpr int32_t kMisses[] = {1, 3, 7};
  /// From this |u| or |v| on, the normal may be nearer to the opposite of the expected one; and nearly z = 0.
  static constexpr int32_t kRim = 22, kOuterRim = 27;

  BitModel cut[kernels::kMaxLevels][8][5];  ///< level, Neighbours::thickest, ::cut
  BitModel mask[4][4][4][8];    ///< faces at siblings, siblings there, surface beyond, children so far
  BitModel bare[kLevels];       ///< level
  SymbolModel<4> kind[2];       ///< bare
  BitModel separates[2][5][4];  ///< bare, Neighbours::separating, ::passable
  NumberModel<9> thickness[kLevels][2][kThicknessClasses];  ///< level, separates, expected
  BitModel turned[2];                                       ///< beyond the outer rim
  DifferenceModel<6> u[kDoubts][4];                         ///< doubt, rank of the thickness
  DifferenceModel<6> v[kDoubts][4][4];                      ///< likewise, and rank of the miss of u
  DifferenceModel<8> lower[kOffsetDoubts][5];               ///< doubt of the offset, rank of the thickness
};

template <class Coder>
class CellCoder {
 public:
  /// As for KnownCells.
  CellCoder(Coder& coder, const kernels::PlanesField& grid, uint32_t* words)
      : coder_(coder), grid_(grid), cells_(grid, words), models_(std::make_unique<CellModels>()) {}

  /// Fills the words. `truth` has the words to encode, such as a reader accepts; null when decoding.
  /// `kinds_stated`: kinds as they are; else a kind only says whether the cell separates, as kind_of({0, 0,
  /// separates}). Returns false if the file is damaged: then the words are
  /// undefined.
  bool code(const kernels::PlanesField* truth, bool kinds_stated) {
    kinds_stated_ = kinds_stated;
    for (uint32_t i = 0; i < cells_.count(); ++i) {
      if (i >= cells_.named()) return false;  // a child of no cell
      const uint32_t word = truth == nullptr           ? kernels::kBareCell
                            : i < grid_.surface_voxels ? truth->voxel_records[i]
                                                       : truth->children[i - grid_.surface_voxels];
      if (!code_cell(i, word)) return false;
    }
    return cells_.named() == cells_.count();
  }

 private:
  bool code_cell(uint32_t i, uint32_t truth) {
    const CellCube cell = cells_[i];
    const Neighbours neighbours = neighbours_of(cells_, cell);
    if (code_cut(cell, neighbours, kernels::word_kind(truth) == kernels::kLink))
      return cells_.cut(i, code_mask(cell, kernels::link_mask(truth)));
    const bool bare = code_bare(cell, (truth & ~15u) == kernels::kBareCell);
    const uint32_t kind = code_kind(bare, neighbours, kernels::word_kind(truth));
    if (kind >= kernels::kPlaneKinds) return false;
    uint32_t word = kernels::kBareCell | kind;
    if (!bare && !code_planes(cell, neighbours, truth, word)) return false;
    cells_.set_planes(i, word);
    return true;
  }

  bool code_cut(const CellCube& cell, const Neighbours& neighbours, bool truth) {
    if (cell.side == 1) return false;
    const uint32_t thickest = std::min(neighbours.thickest, 7u), cut = std::min(neighbours.cut, 4u);
    return coder_.bit(models_->cut[cells_.level(cell)][thickest][cut], truth);
  }

  uint32_t code_mask(const CellCube& cell, uint32_t truth) {
    uint32_t mask = 0;
    for (uint32_t octant = 0; octant < 8; ++octant) {
      uint32_t siblings = 0, there = 0;  // known, on its faces
      for (uint32_t a = 0; a < 3; ++a) {
        if (!(octant >> a & 1)) continue;
        ++siblings;
        there += mask >> (octant ^ 1u << a) & 1;
      }
      const uint32_t beyond = surface_beyond(cells_, cell, octant) / 2,
                     before = std::min(uint32_t(std::popcount(mask)), 7u);
      mask |= uint32_t{coder_.bit(models_->mask[siblings][there][beyond][before], truth >> octant & 1)}
              << octant;
    }
    return mask;
  }

  bool code_bare(const CellCube& cell, bool truth) {
    return coder_.bit(models_->bare[cells_.level(cell)], truth);
  }

  /// May be no kind of planes.
  uint32_t code_kind(bool bare, const Neighbours& neighbours, uint32_t truth) {
    if (kinds_stated_) return models_->kind[bare].code(coder_, truth);
    const uint32_t separating = std::min(neighbours.separating, 4u),
                   passable = std::min(neighbours.passable, 3u);
    return kernels::kind_of(
        {0, 0, coder_.bit(models_->separates[bare][separating][passable], separates(truth))});
  }

  /// `word` has the kind, and receives the rest. Returns false if that is out of range.
  bool code_planes(const CellCube& cell, const Neighbours& neighbours, uint32_t truth, uint32_t& word) {
    constexpr int32_t kHalf = kernels::kNormalHalf, kOffsets = kernels::kPlaneOffsets;
    const uint32_t kind = kernels::word_kind(word);
    const CellPrediction prediction = predict_planes(neighbours, cell);
    const int32_t thickness =
        code_thickness(cell, separates(kind), prediction,
                       int32_t(kernels::upper_offset(truth)) - int32_t(kernels::lower_offset(truth)));
    if (thickness > kOffsets) return false;
    int32_t u = int32_t(truth >> 4 & 63) - kHalf, v = int32_t(truth >> 10 & 63) - kHalf;
    if (!code_normal(prediction, thickness, u, v)) return false;
    const uint32_t u_bits = uint32_t(u + kHalf), v_bits = uint32_t(v + kHalf);
    const CellVector normal = FoundCell{kernels::make_planes(kind, u_bits, v_bits, 0, 1)}.normal();
    const int32_t lower = code_lower(predict_lower(prediction, cell, normal, thickness), thickness,
                                     int32_t(kernels::lower_offset(truth)));
    if (lower < 0 || lower + thickness > kOffsets) return false;
    word = kernels::make_planes(kind, u_bits, v_bits, uint32_t(lower), uint32_t(lower + thickness));
    return true;
  }

  /// Of the planes, in offsets.
  int32_t code_thickness(const CellCube& cell, bool separates, const CellPrediction& prediction,
                         int32_t truth) {
    auto& models = models_->thickness[cells_.level(cell)][separates];
    return 1 + int32_t(models[thickness_class(prediction, cell)].code(coder_, uint32_t(truth - 1)));
  }

  /// Codes u and v. Returns false if they are out of range.
  bool code_normal(const CellPrediction& prediction, int32_t thickness, int32_t& u, int32_t& v) {
    int32_t like_u = prediction.u, like_v = prediction.v;
    const int32_t rim = std::max(std::abs(like_u), std::abs(like_v));
    const bool may_turn = prediction.count > 0 && rim >= CellModels::kRim;
    const bool nearer = std::max(std::abs(u + like_u), std::abs(v + like_v)) <
                        std::max(std::abs(u - like_u), std::abs(v - like_v));  // to the opposite
    if (may_turn && coder_.bit(models_->turned[rim >= CellModels::kOuterRim], nearer))
      like_u = -like_u, like_v = -like_v;
    const uint32_t closeness = rank(thickness, CellModels::kForNormal);
    const int32_t missed = models_->u[prediction.doubt][closeness].code(coder_, u - like_u);
    const uint32_t miss = rank(std::abs(missed), CellModels::kMisses);
    u = like_u + missed;
    v = like_v + models_->v[prediction.doubt][closeness][miss].code(coder_, v - like_v);
    return std::max(std::abs(u), std::abs(v)) <= kernels::kNormalHalf;
  }

  /// May be out of range.
  int32_t code_lower(const OffsetPrediction& prediction, int32_t thickness, int32_t truth) {
    auto& models = models_->lower[prediction.doubt];
    return prediction.lower +
           models[rank(thickness, CellModels::kForOffset)].code(coder_, truth - prediction.lower);
  }

  Coder& coder_;
  const kernels::PlanesField& grid_;
  KnownCells cells_;
  const std::unique_ptr<CellModels> models_;
  bool kinds_stated_ = false;
};

}  // namespace nif::format
