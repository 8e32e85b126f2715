// A picture that cannot be read never fails the mesh: the reason is returned.
#include "formats/mesh/gltf/pictures.hpp"

#include <fmt/format.h>

#include "formats/mesh/file_bytes.hpp"
#include "formats/mesh/gltf/uri.hpp"

namespace nif::mesh::detail {

void GltfPictures::with_bytes(int image, std::string& why, const Use& use) {
  if (image == kInExtension) {
    why = "is in a format that only an extension names";
    return;
  }
  if (image < 0 || size_t(image) >= look_.images.size()) {
    why = "does not exist";
    return;
  }
  const GltfImage& source = look_.images[size_t(image)];
  try {
    const auto use_within_limit = [&](std::string_view bytes) {
      if (bytes.size() > bytes_) {
        why = "is more than all pictures of a file may have";
        return;
      }
      bytes_ -= bytes.size();
      use(bytes);
    };
    if (source.view >= 0) return use_within_limit(data_.view(source.view));
    if (source.uri.starts_with("data:")) {
      if (const std::optional<std::string> bytes = decode_data_uri(source.uri))
        return use_within_limit(*bytes);
      why = "has a data URI that is not base64";
      return;
    }
    const std::optional<std::filesystem::path> path = local_file(input_, source.uri);
    if (!path) {
      why = "is not a local file";
      return;
    }
    const ByteBuffer bytes = load_named_file(*path, bytes_);
    scene_.files.push_back(path->string());
    use_within_limit(bytes.view());
  } catch (const Error& error) {
    why = error.status() == Status::file_not_found ? fmt::format("is at '{}', which is missing", source.uri)
                                                   : "cannot be read";
  }
}

}  // namespace nif::mesh::detail
