// Finds the bytes of a glTF's pictures, in a buffer, in the URI or in a file beside it, and has them decoded.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "formats/mesh/gltf/accessor.hpp"
#include "formats/mesh/image.hpp"
#include "formats/mesh/mesh_scene.hpp"

namespace nif::mesh::detail {

class GltfPictures {
 public:
  GltfPictures(const Input& input, const GltfLook& look, const GltfData& data, Scene& scene)
      : input_(input), look_(look), data_(data), scene_(scene), bytes_(input.limits.max_decompressed_bytes) {}

  /// As decode_image() or decode_alpha(). All that one GltfPictures reads shares kMostTexels, and
  /// ReadLimits::max_decompressed_bytes.
  template <class Result>
  using Decode = std::optional<Result> (*)(std::string_view bytes, uint64_t& texels, std::string& why);

  /// Decodes an image, each time. Returns nothing if it cannot be read, and sets `why`. Appends the files that it
  /// reads to Scene::files.
  template <class Result>
  std::optional<Result> read(int image, Decode<Result> decode, std::string& why) {
    std::optional<Result> result;
    with_bytes(image, why, [&](std::string_view bytes) { result = decode(bytes, texels_, why); });
    return result;
  }

 private:
  using Use = std::function<void(std::string_view bytes)>;
  void with_bytes(int image, std::string& why, const Use& use);

  const Input& input_;
  const GltfLook& look_;
  const GltfData& data_;
  Scene& scene_;
  uint64_t bytes_, texels_ = kMostTexels;  ///< that may still be read
};

}  // namespace nif::mesh::detail
