// The kernels' code for each target, as this library carries it.
#pragma once

#include <cstddef>
#include <span>
#include <string_view>

namespace nif::gpu {

struct Image {
  std::string_view target;  ///< e.g. "gfx1100", "sm_90"; "compute_80": PTX, for sm_80 and all later cards
  const unsigned char* data;
  size_t bytes;
};

std::span<const Image> all_images();

/// "gfx1030, sm_80": for messages.
std::string_view image_names();

}  // namespace nif::gpu
