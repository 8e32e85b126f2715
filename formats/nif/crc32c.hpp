// CRC-32C (Castagnoli), the checksum of every part of a .nif file. It is implemented here, in little code, so
// that the reader needs no library.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace nif::format {

/// Checksum of the bytes; `previous` continues one that was computed over the bytes before them.
uint32_t crc32c(std::span<const std::byte> bytes, uint32_t previous = 0);

}  // namespace nif::format
