// Reads the parts of a glTF that decide what rays meet. The file is trusted: it comes from `nif mesh generate` or from an
// artist whom you know. nlohmann's at() throws where something is missing.
#include "trees.hpp"

#include <png.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <nlohmann/json.hpp>
#include <stdexcept>

namespace {

using nlohmann::json;
using Bytes = std::vector<uint8_t>;

Bytes read_file(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) throw std::runtime_error(path.string() + ": cannot be read");
  return Bytes(std::istreambuf_iterator<char>(file), {});
}

class Gltf {
 public:
  explicit Gltf(const std::filesystem::path& path) : folder_(path.parent_path()) {
    Bytes bytes = read_file(path);
    if (bytes.size() > 20 && std::memcmp(bytes.data(), "glTF", 4) == 0) {
      uint32_t length;  // of the JSON, which follows 20 bytes of headers
      std::memcpy(&length, &bytes[12], 4);
      if (length > bytes.size() - 20) throw std::runtime_error(path.string() + ": ends early");
      json_ = json::parse(bytes.begin() + 20, bytes.begin() + 20 + length);
      // Behind it there are 8 more bytes of header, then the first buffer.
      binary_.assign(bytes.begin() + std::min<ptrdiff_t>(ptrdiff_t(bytes.size()), 28 + length), bytes.end());
    } else {
      json_ = json::parse(bytes);
    }
    for (const json& buffer : json_.at("buffers"))
      buffers_.push_back(buffer.contains("uri") ? read_file(folder_ / buffer.at("uri").get<std::string>())
                                                : binary_);
  }

  const json& document() const { return json_; }

  Bytes view(size_t index) const {
    const json& view = json_.at("bufferViews").at(index);
    const Bytes& buffer = buffers_.at(view.at("buffer").get<size_t>());
    const size_t begin = view.value("byteOffset", size_t{0}), size = view.at("byteLength").get<size_t>();
    if (begin > buffer.size() || size > buffer.size() - begin)
      throw std::runtime_error("a buffer view is too long");
    return Bytes(buffer.begin() + ptrdiff_t(begin), buffer.begin() + ptrdiff_t(begin + size));
  }

  /// Elements of an accessor, as arrays of floats or integers.
  template <class Element>
  std::vector<Element> elements(size_t index) const {
    const json& accessor = json_.at("accessors").at(index);
    const json& of_view = json_.at("bufferViews").at(accessor.at("bufferView").get<size_t>());
    const Bytes bytes = view(accessor.at("bufferView").get<size_t>());
    const size_t offset = accessor.value("byteOffset", size_t{0}),
                 stride = of_view.value("byteStride", sizeof(Element));
    std::vector<Element> elements(accessor.at("count").get<size_t>());
    if (!elements.empty() && offset + stride * (elements.size() - 1) + sizeof(Element) > bytes.size())
      throw std::runtime_error("an accessor is too long");
    for (size_t i = 0; i < elements.size(); ++i)
      std::memcpy(&elements[i], &bytes[offset + stride * i], sizeof(Element));
    return elements;
  }

  std::vector<uint32_t> indices(size_t index) const {
    if (json_.at("accessors").at(index).at("componentType") == 5125) return elements<uint32_t>(index);
    const auto narrow = elements<uint16_t>(index);
    return std::vector<uint32_t>(narrow.begin(), narrow.end());
  }

  Bytes picture(size_t texture) const {
    const json& image = json_.at("images").at(json_.at("textures").at(texture).at("source").get<size_t>());
    return image.contains("uri") ? read_file(folder_ / image.at("uri").get<std::string>())
                                 : view(image.at("bufferView").get<size_t>());
  }

 private:
  std::filesystem::path folder_;
  json json_;
  Bytes binary_;
  std::vector<Bytes> buffers_;
};

Mask read_mask(const Bytes& png, double cutoff) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  if (!png_image_begin_read_from_memory(&image, png.data(), png.size()))
    throw std::runtime_error(image.message);
  image.format = PNG_FORMAT_RGBA;
  Bytes texels(PNG_IMAGE_SIZE(image));
  if (!png_image_finish_read(&image, nullptr, texels.data(), 0, nullptr))
    throw std::runtime_error(image.message);
  Mask mask{image.width, image.height, Bytes((size_t{image.width} * image.height + 7) / 8)};
  for (size_t i = 0; i < texels.size() / 4; ++i)
    if (texels[4 * i + 3] / 255.0f >= float(cutoff)) mask.bits[i / 8] |= uint8_t(1 << i % 8);
  return mask;
}

Transform matrix_of(const json& node) {
  if (!node.contains("matrix")) return {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
  Transform t;
  for (size_t row = 0; row < 3; ++row)
    for (size_t column = 0; column < 4; ++column) t[4 * row + column] = node["matrix"].at(4 * column + row);
  return t;
}

void place(const json& nodes, size_t number, const Transform& parent, Trees& trees) {
  const json& node = nodes.at(number);
  const Transform here = multiply(parent, matrix_of(node));
  if (node.contains("mesh")) trees.placed.push_back({node["mesh"].get<uint32_t>(), here});
  for (const json& child : node.value("children", json::array())) place(nodes, child, here, trees);
}

void measure(Trees& trees) {
  trees.low.fill(std::numeric_limits<float>::max());
  trees.high.fill(std::numeric_limits<float>::lowest());
  for (const Placed& placed : trees.placed)
    for (const Part& part : trees.models[placed.model].parts)
      for (const Float3& position : part.positions) {
        const Float3 p = transformed(placed.transform, position);
        for (size_t a = 0; a < 3; ++a) {
          trees.low[a] = std::min(trees.low[a], p[a]);
          trees.high[a] = std::max(trees.high[a], p[a]);
        }
      }
}

/// A number in 0 .. 1 that depends only on the argument.
float random_of(uint32_t number) {
  number = (number ^ number >> 16) * 0x7feb352du;
  number = (number ^ number >> 15) * 0x846ca68bu;
  return float((number ^ number >> 16) >> 8) / (1 << 24);
}

}  // namespace

bool Mask::blocks(float u, float v) const {
  u -= std::floor(u), v -= std::floor(v);
  const uint32_t x = std::min(uint32_t(u * float(width)), width - 1),
                 y = std::min(uint32_t(v * float(height)), height - 1);
  const size_t texel = size_t{y} * width + x;
  return bits[texel / 8] >> texel % 8 & 1;
}

Transform multiply(const Transform& a, const Transform& b) {
  Transform c;
  for (size_t row = 0; row < 3; ++row)
    for (size_t column = 0; column < 4; ++column) {
      double sum = column == 3 ? a[4 * row + 3] : 0;
      for (size_t k = 0; k < 3; ++k) sum += double(a[4 * row + k]) * b[4 * k + column];
      c[4 * row + column] = float(sum);
    }
  return c;
}

Float3 transformed(const Transform& t, const Float3& p) {
  Float3 moved;
  for (size_t row = 0; row < 3; ++row)
    moved[row] = t[4 * row] * p[0] + t[4 * row + 1] * p[1] + t[4 * row + 2] * p[2] + t[4 * row + 3];
  return moved;
}

Trees read_trees(const std::string& path) {
  const Gltf file(path);
  const json& document = file.document();
  Trees trees;
  std::vector<int> masks;  // [materials]
  for (const json& material : document.value("materials", json::array())) {
    const std::string mode = material.value("alphaMode", "OPAQUE");
    const json surface = material.value("pbrMetallicRoughness", json::object());
    masks.push_back(-1);
    if (mode == "OPAQUE" || !surface.contains("baseColorTexture")) continue;
    masks.back() = int(trees.masks.size());
    trees.masks.push_back(read_mask(file.picture(surface["baseColorTexture"].at("index")),
                                    mode == "MASK" ? material.value("alphaCutoff", 0.5) : 0.5));
  }
  for (const json& mesh : document.at("meshes")) {
    Model& model = trees.models.emplace_back();
    model.name = mesh.value("name", "");
    for (const json& primitive : mesh.at("primitives")) {
      const json& attributes = primitive.at("attributes");
      Part& part = model.parts.emplace_back();
      part.positions = file.elements<Float3>(attributes.at("POSITION"));
      const std::vector<uint32_t> indices = file.indices(primitive.at("indices"));
      for (size_t i = 0; i + 2 < indices.size(); i += 3)
        part.triangles.push_back({indices[i], indices[i + 1], indices[i + 2]});
      if (primitive.contains("material")) part.mask = masks.at(primitive["material"].get<size_t>());
      if (part.mask >= 0) part.places = file.elements<std::array<float, 2>>(attributes.at("TEXCOORD_0"));
    }
  }
  for (const json& root : document.at("scenes").at(document.value("scene", size_t{0})).at("nodes"))
    place(document.at("nodes"), root, {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}, trees);
  measure(trees);
  return trees;
}

void plant(Trees& trees, uint32_t copies) {
  Model whole{"whole", {}};
  for (const Placed& placed : trees.placed)
    for (Part part : trees.models[placed.model].parts) {
      for (Float3& position : part.positions) position = transformed(placed.transform, position);
      whole.parts.push_back(std::move(part));
    }
  const Float3 low = trees.low, high = trees.high;
  const float step = 0.8f * std::max(high[0] - low[0], high[2] - low[2]);
  const auto row = uint32_t(std::ceil(std::sqrt(double(copies))));
  trees.models = {std::move(whole)};
  trees.planted = true;
  trees.placed.clear();
  for (uint32_t i = 0; i < copies; ++i) {
    const float turn = 6.2831853f * random_of(4 * i), scale = 0.7f + 0.5f * random_of(4 * i + 1),
                c = scale * std::cos(turn), s = scale * std::sin(turn);
    // The foot, in the middle of the file's box, goes to its place.
    const Float3 foot{(low[0] + high[0]) / 2, low[1], (low[2] + high[2]) / 2};
    const float x = step * (float(i % row) + 0.8f * random_of(4 * i + 2)),
                z = step * (float(i / row) + 0.8f * random_of(4 * i + 3));
    trees.placed.push_back({0,
                            {c, 0, s, x - c * foot[0] - s * foot[2], 0, scale, 0, -scale * foot[1], -s, 0, c,
                             z + s * foot[0] - c * foot[2]}});
  }
  measure(trees);
}
