// Wrong proofs: cells as the baker has fitted them, changed afterwards, so that tests can show that a wrong
// proof would be noticed.
#pragma once

#include <algorithm>

#include "formats/nif/planes/planes_part.hpp"
#include "kernels/reference/planes/cells.hpp"

namespace nif::test {

/// Changes the words of a grid; null: they stay right.
using CellFlaw = void (*)(format::PlanesData& data);

/// Replaces each word with planes by `change` of it.
template <class Change>
void change_planes(format::PlanesData& data, const Change& change) {
  for (std::vector<uint32_t>* words : {&data.voxel_records, &data.children})
    for (uint32_t& word : *words)
      if (kernels::word_kind(word) != kernels::kLink) word = change(word);
}

inline uint32_t with_kind(uint32_t word, const kernels::CellKind& kind) {
  return (word & ~15u) | kernels::kind_of(kind);
}

/// Every cell is a wall.
inline void walls_everywhere(format::PlanesData& data) {
  change_planes(data, [](uint32_t word) { return with_kind(word, {0, 0, true}); });
}

/// Planes are moved towards one another, each by a tenth of its cell or a little more.
inline void narrow_planes(format::PlanesData& data) {
  change_planes(data, [](uint32_t word) {
    constexpr uint32_t kTenth = 20;
    const uint32_t lower = std::min(kernels::lower_offset(word) + kTenth, kernels::kPlaneOffsets - 1),
                   upper = std::max(kernels::upper_offset(word), kTenth) - kTenth;
    return kernels::make_planes(kernels::word_kind(word), word >> 4 & 63, word >> 10 & 63, lower,
                                std::max(upper, lower + 1));
  });
}

/// Sides of which nothing is known are called inside.
inline void pockets_inside(format::PlanesData& data) {
  change_planes(data, [](uint32_t word) {
    kernels::CellKind kind = kernels::kCellKinds[kernels::word_kind(word)];
    for (uint32_t* side : {&kind.above, &kind.below})
      if (*side == 0) *side = kernels::kSeenInside;
    return with_kind(word, kind);
  });
}

}  // namespace nif::test
