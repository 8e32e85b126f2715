// The kernels' code for each target, which this library contains as data.
#pragma once

#include <cstddef>
#include <span>
#include <string_view>

namespace nif::gpu {

struct Image {
  std::string_view target;  ///< e.g. "gfx1100", "sm_90"; "compute_80": PTX, for sm_80 and all later GPUs
  const unsigned char* data;
  size_t bytes;
};

std::span<const Image> all_images();

/// The targets for messages, e.g. "gfx1030, sm_80".
std::string_view image_names();

}  // namespace nif::gpu
