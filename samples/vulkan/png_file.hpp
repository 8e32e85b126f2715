#pragma once

#include <cstdint>
#include <span>
#include <string>

/// Writes a PNG, whole or not at all. `rgb`: three bytes a pixel, row by row from the top. Throws std::runtime_error with the
/// file's name.
void write_png(const std::string& path, uint32_t width, uint32_t height, std::span<const uint8_t> rgb);
