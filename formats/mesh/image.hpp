// Decodes textures: PNG with libpng, JPEG with libjpeg-turbo and WebP with libwebp.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "formats/mesh/appearance.hpp"

namespace nif::mesh::detail {

/// Limit for all pictures of a file together, and again for those that are read for their alpha: 2^28 texels take
/// 768 MB, and their alpha 512 MB.
inline constexpr uint64_t kMostTexels = uint64_t{1} << 28;

/// Decodes a picture. Before that, its size is subtracted from `texels`, the rest of kMostTexels. Returns
/// nothing if that is not enough, or if it is not a valid PNG, JPEG or WebP; then `why` states the reason:
/// "cannot be decoded (...)". 16 bits become 8, and inks become RGB; alpha, gamma and profiles are ignored.
/// Throws std::bad_alloc.
std::optional<Texture> decode_image(std::string_view bytes, uint64_t& texels, std::string& why);

/// The alpha of a picture, rows from the top.
struct AlphaTexels {
  uint32_t width = 0, height = 0;  ///< at least 1
  std::vector<uint16_t> alpha;     ///< [height][width], 65535: opaque. Empty: it is opaque everywhere
};

/// The same for alpha: of a channel, or of a colour that a PNG calls transparent.
std::optional<AlphaTexels> decode_alpha(std::string_view bytes, uint64_t& texels, std::string& why);

/// The same for a picture that is a mask: without alpha, its brightness counts, the mean of red, green and blue.
std::optional<AlphaTexels> decode_mask(std::string_view bytes, uint64_t& texels, std::string& why);

}  // namespace nif::mesh::detail
