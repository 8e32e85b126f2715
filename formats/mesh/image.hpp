// Decodes textures: PNG with libpng and JPEG with libjpeg-turbo.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "formats/mesh/appearance.hpp"

namespace nif::mesh::detail {

/// Limit for all pictures of a file together: 2^28 texels take 768 MB.
inline constexpr uint64_t kMostTexels = uint64_t{1} << 28;

/// Decodes a picture. Before that, its size is subtracted from `texels`, the rest of kMostTexels. Returns
/// nothing if that is not enough, or if it is not a valid PNG or JPEG; then `why` states the reason: "cannot
/// be decoded (...)". 16 bits become 8, and inks become RGB; alpha, gamma and profiles are ignored. Throws
/// std::bad_alloc.
std::optional<Texture> decode_image(std::string_view bytes, uint64_t& texels, std::string& why);

}  // namespace nif::mesh::detail
