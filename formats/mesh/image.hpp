// Pictures as textures use them: PNG by libpng and JPEG by libjpeg-turbo.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "formats/mesh/appearance.hpp"

namespace nif::mesh::detail {

/// Of all pictures of a file together: 2^28 texels take 768 MB.
inline constexpr uint64_t kMostTexels = uint64_t{1} << 28;

/// Decodes a picture. Its size is asked before anything is decoded, and taken off `texels`, what is left of
/// kMostTexels. None where that is not enough, or where it is no PNG or JPEG, or a damaged one; then `why`
/// says so: "cannot be decoded (...)". 16 bits become 8, inks become light; alpha, gamma and profiles are
/// left out. Throws std::bad_alloc.
std::optional<Texture> decode_image(std::string_view bytes, uint64_t& texels, std::string& why);

}  // namespace nif::mesh::detail
