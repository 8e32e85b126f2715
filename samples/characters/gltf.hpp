// Reads what the sample needs of a glTF. The file is trusted: it comes with the sample, or from an artist whom you know.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <vector>

class Gltf {
 public:
  /// A .glb or .gltf. Throws std::exception.
  explicit Gltf(const std::filesystem::path& path);

  const nlohmann::json& document() const { return document_; }
  /// The values of an accessor, one after the other. Integers become floats as the glTF says.
  std::vector<float> values(size_t accessor) const;
  /// The encoded picture of a texture; empty if it has none that glTF itself knows.
  std::vector<uint8_t> picture(size_t texture) const;

 private:
  std::filesystem::path folder_;
  nlohmann::json document_;
  std::vector<std::vector<uint8_t>> buffers_;
};
