// Draws twigs with leaves by formula, as the picture that cards of a cut-out tree show.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace nif::generate {

/// The leaves of a kind of tree, on a twig of length 1.
struct Foliage {
  double length, width;                ///< of a leaf; its width is a part of its length
  double angle;                        ///< from the twig, in turns
  uint32_t pairs;                      ///< of leaves along the twig
  uint32_t twigs;                      ///< side twigs
  double twig;                         ///< length of the lowest side twig
  double lobes;                        ///< depth of lobes at the leaf's border, 0: it is smooth
  std::array<uint8_t, 3> dark, light;  ///< sRGB, between which leaves are coloured
};

/// The picture has kTwigs x kTwigs different twigs, each in a square of its own, whose stem begins in the middle of the
/// lower side and goes up.
inline constexpr uint32_t kTwigs = 2, kPictureSide = 512;

/// A PNG of kPictureSide x kPictureSide texels with alpha. Texels around the leaves have their mean colour.
std::vector<std::byte> draw_twigs(const Foliage& foliage, uint64_t seed);

}  // namespace nif::generate
