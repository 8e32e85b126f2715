// Writes an asset as the bytes of a .nif file.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "formats/nif/asset.hpp"
#include "formats/nif/reader.hpp"

namespace nif::format {

/// The bytes of the file. The same asset always gives the same bytes. They are read back before they are
/// returned: an asset that the reader would refuse throws nif::Error (Status::internal) with the reader's
/// sentence, and no such file comes to be.
std::vector<std::byte> encode(const Asset& asset);

/// How many bytes encode() would make, without making them.
uint64_t encoded_bytes(const Asset& asset);

/// A copy that owns its memory, from which encode() makes the same bytes again (unknown sections excepted).
Asset to_asset(const AssetView& view);

/// The text with everything that a name in an asset may not hold (bytes that are not UTF-8, zeros) replaced
/// by U+FFFD.
std::string clean_name(std::string_view text);

}  // namespace nif::format
