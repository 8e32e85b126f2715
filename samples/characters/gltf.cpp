#include "gltf.hpp"

#include <algorithm>
#include <cstring>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <string>

using nlohmann::json;

namespace {

std::vector<uint8_t> read_file(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file || std::filesystem::is_directory(path))
    throw std::runtime_error(path.string() + ": cannot be read");
  return std::vector<uint8_t>(std::istreambuf_iterator<char>(file), {});
}

size_t components_of(const std::string& type) {
  return type == "SCALAR" ? 1 : type == "VEC2" ? 2 : type == "VEC3" ? 3 : type == "VEC4" ? 4 : 16;
}

template <class Integer>
float value_at(const uint8_t* bytes, bool normalized) {
  Integer value;
  std::memcpy(&value, bytes, sizeof(value));
  return normalized ? std::max(-1.0f, float(value) / float(std::numeric_limits<Integer>::max()))
                    : float(value);
}

float value_at(const uint8_t* bytes, int component, bool normalized) {
  switch (component) {
    case 5120:
      return value_at<int8_t>(bytes, normalized);
    case 5121:
      return value_at<uint8_t>(bytes, normalized);
    case 5122:
      return value_at<int16_t>(bytes, normalized);
    case 5123:
      return value_at<uint16_t>(bytes, normalized);
    case 5125:
      return value_at<uint32_t>(bytes, normalized);
    case 5126:
      return value_at<float>(bytes, false);
    default:
      throw std::runtime_error("an accessor has an unknown type of components");
  }
}

}  // namespace

Gltf::Gltf(const std::filesystem::path& path) : folder_(path.parent_path()) {
  const std::vector<uint8_t> bytes = read_file(path);
  std::vector<uint8_t> binary;
  if (bytes.size() > 20 && std::memcmp(bytes.data(), "glTF", 4) == 0) {
    uint32_t length;  // of the JSON, which follows 20 bytes of headers
    std::memcpy(&length, &bytes[12], 4);
    if (length > bytes.size() - 20) throw std::runtime_error(path.string() + ": ends early");
    document_ = json::parse(bytes.begin() + 20, bytes.begin() + 20 + length);
    // Behind it there are 8 more bytes of header, then the first buffer.
    binary.assign(bytes.begin() + std::min<ptrdiff_t>(ptrdiff_t(bytes.size()), 28 + ptrdiff_t(length)),
                  bytes.end());
  } else {
    document_ = json::parse(bytes);
  }
  for (const json& buffer : document_.at("buffers"))
    buffers_.push_back(buffer.contains("uri") ? read_file(folder_ / buffer.at("uri").get<std::string>())
                                              : binary);
}

std::vector<float> Gltf::values(size_t number) const {
  const json& accessor = document_.at("accessors").at(number);
  const json& view = document_.at("bufferViews").at(accessor.at("bufferView").get<size_t>());
  const std::vector<uint8_t>& buffer = buffers_.at(view.at("buffer").get<size_t>());
  const int component = accessor.at("componentType");
  const size_t width = components_of(accessor.at("type")), count = accessor.at("count").get<size_t>();
  const size_t size = component <= 5121 ? 1 : component <= 5123 ? 2 : 4;
  const size_t stride = view.value("byteStride", size * width);
  const size_t begin = view.value("byteOffset", size_t{0}) + accessor.value("byteOffset", size_t{0});
  if (count > buffer.size() || (count != 0 && begin + stride * (count - 1) + size * width > buffer.size()))
    throw std::runtime_error("an accessor is longer than its buffer");
  const bool normalized = accessor.value("normalized", false);
  std::vector<float> values;
  values.reserve(count * width);
  for (size_t i = 0; i < count; ++i)
    for (size_t k = 0; k < width; ++k)
      values.push_back(value_at(&buffer[begin + stride * i + size * k], component, normalized));
  return values;
}

std::vector<uint8_t> Gltf::picture(size_t texture) const {
  const json& of = document_.at("textures").at(texture);
  if (!of.contains("source")) return {};
  const json& image = document_.at("images").at(of.at("source").get<size_t>());
  if (image.contains("uri")) return read_file(folder_ / image.at("uri").get<std::string>());
  const json& view = document_.at("bufferViews").at(image.at("bufferView").get<size_t>());
  const std::vector<uint8_t>& buffer = buffers_.at(view.at("buffer").get<size_t>());
  const size_t begin = view.value("byteOffset", size_t{0}), size = view.at("byteLength").get<size_t>();
  if (begin > buffer.size() || size > buffer.size() - begin)
    throw std::runtime_error("a picture is longer than its buffer");
  return std::vector<uint8_t>(buffer.begin() + ptrdiff_t(begin), buffer.begin() + ptrdiff_t(begin + size));
}
