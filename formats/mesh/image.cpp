#include "formats/mesh/image.hpp"

#include <fmt/format.h>

#include <limits>
#include <memory>

// A copy of its own, with no more than is needed: less to attack, and no name that another copy has.
#define STB_IMAGE_IMPLEMENTATION
#define STB_IMAGE_STATIC
#define STBI_ONLY_PNG
#define STBI_ONLY_JPEG
#define STBI_NO_STDIO
#define STBI_MAX_DIMENSIONS 65536
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wall"
#pragma GCC diagnostic ignored "-Wextra"
#pragma GCC diagnostic ignored "-Wpedantic"
#include <stb/stb_image.h>
#pragma GCC diagnostic pop

namespace nif::mesh::detail {

std::optional<Texture> decode_image(std::string_view bytes, uint64_t& texels, std::string& why) {
  const auto* data = reinterpret_cast<const stbi_uc*>(bytes.data());
  int width = 0, height = 0, channels = 0;
  if (bytes.size() > size_t{std::numeric_limits<int>::max()} ||
      !stbi_info_from_memory(data, int(bytes.size()), &width, &height, &channels) || width <= 0 ||
      height <= 0) {
    why = "is no PNG or JPEG";
    return std::nullopt;
  }
  const uint64_t wanted = uint64_t(width) * uint64_t(height);
  if (wanted > texels) {
    why = fmt::format("has {} x {} pixels, more than are read ({} of a file)", width, height, kMostTexels);
    return std::nullopt;
  }
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
