#include "formats/mesh/image.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <limits>
#include <memory>

namespace {

/// Bytes that stb may ask for at once: a few kilobytes of PNG may unpack to gigabytes.
thread_local uint64_t most_at_once = 0;

/// Zeros: a JPEG may lack tables that its data needs, and what is missing must not depend on the heap.
void* allocate(size_t bytes) { return bytes <= most_at_once ? std::calloc(1, bytes) : nullptr; }
void* reallocate(void* memory, size_t bytes) {
  return bytes <= most_at_once ? std::realloc(memory, bytes) : nullptr;
}

}  // namespace

// A copy of its own, with no more than is needed: less to attack, and no name that another copy has.
#define STB_IMAGE_IMPLEMENTATION
#define STB_IMAGE_STATIC
#define STBI_ONLY_PNG
#define STBI_ONLY_JPEG
#define STBI_NO_STDIO
#define STBI_MAX_DIMENSIONS 65536
#define STBI_MALLOC allocate
#define STBI_REALLOC reallocate
#define STBI_FREE std::free
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wall"
#pragma GCC diagnostic ignored "-Wextra"
#pragma GCC diagnostic ignored "-Wpedantic"
#include <stb/stb_image.h>
#pragma GCC diagnostic pop

namespace nif::mesh::detail {
namespace {

/// Whether each Huffman table of a JPEG has at most as many codes as there are bytes, as it must: stb does
/// not look, and writes beyond its own tables. Segments are gone through as stb does it.
bool huffman_tables_fit(std::string_view bytes) {
  const auto byte = [&](size_t at) { return at < bytes.size() ? uint8_t(bytes[at]) : uint8_t{0}; };
  size_t at = std::min(bytes.find_first_not_of('\xFF'), bytes.size());
  if (at == 0 || byte(at) != 0xD8) return true;  // no JPEG
  for (++at; at < bytes.size();) {
    const uint8_t marker = byte(at + 1);
    const bool alone = marker == 0 || marker == 1 || (marker >= 0xD0 && marker <= 0xD9);
    if (byte(at) != 0xFF || marker == 0xFF || alone) {
      at += byte(at) == 0xFF && alone ? 2 : 1;
      continue;
    }
    const size_t end = at + 2 + std::max<size_t>(2, size_t{byte(at + 2)} << 8 | byte(at + 3));
    if (marker == 0xC4) {
      for (size_t table = at + 4; table < end;) {
        uint32_t codes = 0;
        for (size_t length = 1; length <= 16; ++length) codes += byte(table + length);
        if (codes > 256) return false;
        table += 17 + codes;
      }
    }
    at = end;
  }
  return true;
}

}  // namespace

std::optional<Texture> decode_image(std::string_view bytes, uint64_t& texels, std::string& why) {
  const auto* data = reinterpret_cast<const stbi_uc*>(bytes.data());
  int width = 0, height = 0, channels = 0;
  if (!huffman_tables_fit(bytes)) {
    why = "cannot be decoded (it has a Huffman table that is too long)";
    return std::nullopt;
  }
  constexpr uint64_t kEnoughToLook = 1 << 20;
  most_at_once = kEnoughToLook;
  if (bytes.size() > size_t{std::numeric_limits<int>::max()} ||
      !stbi_info_from_memory(data, int(bytes.size()), &width, &height, &channels) || width <= 0 ||
      height <= 0) {
    why = "is no PNG or JPEG that can be read";
    return std::nullopt;
  }
  const uint64_t wanted = uint64_t(width) * uint64_t(height);
  if (wanted > texels) {
    why = fmt::format("has {} x {} pixels, more than are read ({} of a file)", width, height, kMostTexels);
    return std::nullopt;
  }
  // Of four channels of 16 bits, with room for a buffer that grows by doubling; and the file's own data.
  most_at_once = std::max<uint64_t>({kEnoughToLook, 16 * wanted + 2 * uint64_t(height), 2 * bytes.size()});
  const std::unique_ptr<stbi_uc, void (*)(void*)> pixels(
      stbi_load_from_memory(data, int(bytes.size()), &width, &height, &channels, 3), stbi_image_free);
  if (!pixels || uint64_t(width) * uint64_t(height) != wanted) {
    why = fmt::format("cannot be decoded ({})", pixels ? "its size changes" : stbi_failure_reason());
    return std::nullopt;
  }
  texels -= wanted;
  Texture texture{uint32_t(width), uint32_t(height), {}};
  texture.texels.assign(pixels.get(), pixels.get() + 3 * wanted);
  return texture;
}

}  // namespace nif::mesh::detail
