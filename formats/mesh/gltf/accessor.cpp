// Reads accessors: typed, strided and possibly sparse views of buffers.
#include "formats/mesh/gltf/accessor.hpp"

#include <fmt/format.h>
#include <tiny_gltf.h>

#include <algorithm>
#include <cstring>
#include <limits>

#include "formats/mesh/gltf/meshopt.hpp"

namespace nif::mesh::detail {
namespace {

uint64_t component_size(int type) {
  switch (type) {
    case TINYGLTF_COMPONENT_TYPE_BYTE:
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
      return 1;
    case TINYGLTF_COMPONENT_TYPE_SHORT:
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
      return 2;
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
    case TINYGLTF_COMPONENT_TYPE_FLOAT:
      return 4;
    default:
      return 0;
  }
}

template <class T>
T load(const char* at) {
  T value;
  std::memcpy(&value, at, sizeof value);
  return value;
}

/// Decodes a component as glTF's section on accessors and KHR_mesh_quantization define it.
float decode(const char* at, int type, bool normalized) {
  const auto scaled = [&](float value, float largest) {
    return normalized ? std::max(value / largest, -1.0f) : value;
  };
  switch (type) {
    case TINYGLTF_COMPONENT_TYPE_BYTE:
      return scaled(load<int8_t>(at), 127);
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
      return scaled(load<uint8_t>(at), 255);
    case TINYGLTF_COMPONENT_TYPE_SHORT:
      return scaled(load<int16_t>(at), 32767);
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
      return scaled(load<uint16_t>(at), 65535);
    default:
      return load<float>(at);
  }
}

uint32_t decode_index(const char* at, int type) {
  switch (type) {
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
      return load<uint8_t>(at);
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
      return load<uint16_t>(at);
    default:
      return load<uint32_t>(at);
  }
}

bool is_index_type(int type) {
  return type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE || type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT ||
         type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT;
}

const tinygltf::Accessor& find(const Input& input, const tinygltf::Model& model, int index) {
  if (index < 0 || static_cast<size_t>(index) >= model.accessors.size()) {
    input.fail(Status::malformed_mesh,
               fmt::format("uses accessor {}, but there are only {}", index, model.accessors.size()));
  }
  return model.accessors[static_cast<size_t>(index)];
}

}  // namespace

const tinygltf::Value& member_of(const tinygltf::Value& value, const char* name) {
  static const tinygltf::Value kNull;
  return value.IsObject() ? value.Get(name) : kNull;
}

struct GltfData::Elements {
  const char* first = nullptr;
  uint64_t stride = 0;
  const char* at(uint64_t i) const { return first + i * stride; }
};

std::string_view GltfData::view(int index) const {
  if (index < 0 || static_cast<size_t>(index) >= model_.bufferViews.size()) {
    input_.fail(Status::malformed_mesh,
                fmt::format("uses buffer view {}, but there are only {}", index, model_.bufferViews.size()));
  }
  const tinygltf::BufferView& view = model_.bufferViews[static_cast<size_t>(index)];
  if (view.buffer < 0 || static_cast<size_t>(view.buffer) >= source_.buffers.size()) {
    input_.fail(Status::malformed_mesh, fmt::format("buffer view {} uses buffer {}, but there are only {}",
                                                    index, view.buffer, source_.buffers.size()));
  }
  if (!source_.buffers[static_cast<size_t>(view.buffer)]) {
    if (const auto meshopt = view.extensions.find("EXT_meshopt_compression");
        meshopt != view.extensions.end())
      return decoded(index, meshopt->second);
    if (view.extensions.contains("KHR_meshopt_compression")) {
      input_.fail(Status::unsupported_extension,
                  fmt::format("buffer view {} is compressed by the glTF extension KHR_meshopt_compression, "
                              "which is not supported",
                              index));
    }
    input_.fail(Status::missing_buffer,
                fmt::format("buffer {} has neither a uri nor binary data", view.buffer));
  }
  return span(fmt::format("buffer view {}", index), view.buffer, view.byteOffset, view.byteLength);
}

std::string_view GltfData::span(const std::string& what, int buffer, uint64_t offset, uint64_t length) const {
  const std::string_view bytes = *source_.buffers[static_cast<size_t>(buffer)];
  if (offset > bytes.size() || length > bytes.size() - offset) {
    input_.fail(Status::malformed_mesh, fmt::format("{} spans {} bytes from byte {}, but buffer {} has {}",
                                                    what, length, offset, buffer, bytes.size()));
  }
  return bytes.substr(offset, length);
}

std::string_view GltfData::decoded(int index, const tinygltf::Value& extension) const {
  if (const auto known = decoded_.find(index); known != decoded_.end()) return known->second;
  const auto number = [&](const char* name, int otherwise) {
    const tinygltf::Value& value = member_of(extension, name);
    const int out = value.IsInt() ? value.Get<int>() : otherwise;
    if (out < 0) {
      input_.fail(Status::malformed_mesh,
                  fmt::format("the compression of buffer view {} lacks {}", index, name));
    }
    return out;
  };
  const auto word = [&](const char* name) {
    const tinygltf::Value& value = member_of(extension, name);
    return value.IsString() ? value.Get<std::string>() : std::string();
  };
  MeshoptData data;
  data.where = fmt::format("the compressed buffer view {}", index);
  const int buffer = number("buffer", -1);
  if (static_cast<size_t>(buffer) >= source_.buffers.size() || !source_.buffers[static_cast<size_t>(buffer)])
    input_.fail(Status::missing_buffer,
                fmt::format("{} uses buffer {}, which has no data", data.where, buffer));
  data.bytes = span(data.where, buffer, static_cast<uint64_t>(number("byteOffset", 0)),
                    static_cast<uint64_t>(number("byteLength", -1)));
  data.count = static_cast<uint64_t>(number("count", -1));
  data.stride = static_cast<uint64_t>(number("byteStride", -1));
  data.mode = word("mode");
  if (extension.Has("filter")) data.filter = word("filter");
  decoded_bytes_ += data.count * data.stride;
  if (decoded_bytes_ > input_.limits.max_decompressed_bytes)
    input_.fail(Status::too_large,
                fmt::format("has more than the limit of {} bytes in compressed buffer views",
                            input_.limits.max_decompressed_bytes));
  return decoded_.emplace(index, decode_meshopt(input_, data)).first->second;
}

GltfData::Elements GltfData::elements(int accessor, int buffer_view, uint64_t offset, uint64_t stride,
                                      const Layout& layout) const {
  const std::string_view bytes = view(buffer_view);
  const uint64_t size = component_size(layout.component_type) * static_cast<uint64_t>(layout.components);
  if (stride == 0) stride = size;
  if (stride < size) {
    input_.fail(Status::malformed_mesh,
                fmt::format("accessor {} has elements of {} bytes in strides of {}", accessor, size, stride));
  }
  // In this order, nothing can overflow.
  const bool fits = layout.count == 0 || (offset <= bytes.size() && size <= bytes.size() - offset &&
                                          layout.count - 1 <= (bytes.size() - offset - size) / stride);
  if (!fits) {
    input_.fail(
        Status::malformed_mesh,
        fmt::format(
            "accessor {} reaches beyond buffer view {}: {} elements in strides of {} from byte {} of {}",
            accessor, buffer_view, layout.count, stride, offset, bytes.size()));
  }
  return {bytes.data() + (layout.count == 0 ? 0 : offset), stride};
}

uint64_t GltfData::stride_of(int view) const {
  const size_t index = static_cast<size_t>(view);
  return index < model_.bufferViews.size() ? model_.bufferViews[index].byteStride : 0;
}

bool GltfData::normalized(int index) const { return find(input_, model_, index).normalized; }

uint64_t GltfData::count(int index) const { return find(input_, model_, index).count; }

bool GltfData::has_alpha(int index) const { return find(input_, model_, index).type == TINYGLTF_TYPE_VEC4; }

void GltfData::fail_type(int index, const char* what) const {
  input_.fail(Status::malformed_mesh, fmt::format("accessor {} has a type that {} cannot have", index, what));
}

template <class T, class Load>
std::vector<T> GltfData::load_all(int index, int components, const char* what, uint64_t most,
                                  Load&& load) const {
  const tinygltf::Accessor& accessor = find(input_, model_, index);
  // Without a buffer view all elements are zero and take no space in the file, so their number needs a bound,
  // over all accessors that are read.
  constexpr uint64_t kMostZeros = uint64_t{1} << 25;
  const uint64_t count = std::min<uint64_t>(accessor.count, most);
  if (accessor.bufferView < 0)
    zeros_ += std::min<uint64_t>(count, kMostZeros + 1) * std::max<uint64_t>(1, sizeof(T) / sizeof(Float3));
  if (count > std::numeric_limits<uint32_t>::max() || zeros_ > kMostZeros)
    input_.fail(Status::too_large, fmt::format("accessor {} has {} {}", index, accessor.count, what));
  std::vector<T> out;
  if (accessor.bufferView >= 0) {
    const Elements source =
        elements(index, accessor.bufferView, accessor.byteOffset, stride_of(accessor.bufferView),
                 {accessor.componentType, components, accessor.count});
    out.resize(count);
    for (uint64_t i = 0; i < count; ++i) load(source.at(i), out[i]);
  } else {
    out.resize(count);
  }
  if (accessor.sparse.isSparse) apply_sparse(index, components, out, load);
  return out;
}

template <class T, class Load>
void GltfData::apply_sparse(int index, int components, std::vector<T>& out, Load&& load) const {
  const tinygltf::Accessor& accessor = model_.accessors[static_cast<size_t>(index)];
  const auto& sparse = accessor.sparse;
  if (sparse.count < 0 || static_cast<uint64_t>(sparse.count) > accessor.count ||
      sparse.indices.byteOffset < 0 || sparse.values.byteOffset < 0 ||
      !is_index_type(sparse.indices.componentType)) {
    input_.fail(Status::malformed_mesh, fmt::format("the sparse part of accessor {} is invalid", index));
  }
  const uint64_t count = static_cast<uint64_t>(sparse.count);
  const Elements indices =
      elements(index, sparse.indices.bufferView, static_cast<uint64_t>(sparse.indices.byteOffset), 0,
               {sparse.indices.componentType, 1, count});
  const Elements values =
      elements(index, sparse.values.bufferView, static_cast<uint64_t>(sparse.values.byteOffset), 0,
               {accessor.componentType, components, count});
  for (uint64_t i = 0; i < count; ++i) {
    const uint32_t target = decode_index(indices.at(i), sparse.indices.componentType);
    if (target >= accessor.count) {
      input_.fail(Status::index_out_of_range,
                  fmt::format("the sparse part of accessor {} uses element {}, but there are only {}", index,
                              target, accessor.count));
    }
    if (target < out.size()) load(values.at(i), out[target]);
  }
}

template <size_t kCount>
std::vector<std::array<float, kCount>> GltfData::numbers(int index, int components, const char* what,
                                                         uint64_t most) const {
  const tinygltf::Accessor& accessor = find(input_, model_, index);
  const int type = accessor.componentType;
  if (component_size(type) == 0 || type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT) fail_type(index, what);
  const uint64_t size = component_size(type);
  return load_all<std::array<float, kCount>>(
      index, components, what, most, [&](const char* at, std::array<float, kCount>& element) {
        for (size_t k = 0; k < kCount; ++k) element[k] = decode(at + k * size, type, accessor.normalized);
      });
}

std::vector<Float3> GltfData::positions(int index) const {
  if (find(input_, model_, index).type != TINYGLTF_TYPE_VEC3) fail_type(index, "positions");
  return numbers<3>(index, 3, "positions", UINT64_MAX);
}

std::vector<Float3> GltfData::colors(int index, uint64_t most) const {
  const int type = find(input_, model_, index).type;
  if (type != TINYGLTF_TYPE_VEC3 && type != TINYGLTF_TYPE_VEC4) fail_type(index, "colours");
  return numbers<3>(index, type == TINYGLTF_TYPE_VEC4 ? 4 : 3, "colours", most);
}

std::vector<float> GltfData::alphas(int index, uint64_t most) const {
  if (!has_alpha(index)) fail_type(index, "colours");
  std::vector<float> alphas;
  for (const std::array<float, 4>& color : numbers<4>(index, 4, "colours", most))
    alphas.push_back(color[3] >= 0 ? std::min(color[3], 1.0f) : 0);  // also for NaN
  return alphas;
}

std::vector<std::array<float, 2>> GltfData::coordinates(int index, uint64_t most) const {
  if (find(input_, model_, index).type != TINYGLTF_TYPE_VEC2) fail_type(index, "texture coordinates");
  return numbers<2>(index, 2, "texture coordinates", most);
}

std::vector<std::array<float, 4>> GltfData::rotations(int index) const {
  const tinygltf::Accessor& accessor = find(input_, model_, index);
  const bool fractions = accessor.normalized && (accessor.componentType == TINYGLTF_COMPONENT_TYPE_BYTE ||
                                                 accessor.componentType == TINYGLTF_COMPONENT_TYPE_SHORT);
  if (accessor.type != TINYGLTF_TYPE_VEC4 ||
      (accessor.componentType != TINYGLTF_COMPONENT_TYPE_FLOAT && !fractions))
    fail_type(index, "rotations");
  return numbers<4>(index, 4, "rotations", UINT64_MAX);
}

std::vector<std::array<uint16_t, 4>> GltfData::joints(int index) const {
  const tinygltf::Accessor& accessor = find(input_, model_, index);
  const int type = accessor.componentType;
  if (accessor.type != TINYGLTF_TYPE_VEC4 ||
      (type != TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE && type != TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT))
    fail_type(index, "joints");
  const uint64_t size = component_size(type);
  return load_all<std::array<uint16_t, 4>>(index, 4, "joints", UINT64_MAX,
                                           [&](const char* at, std::array<uint16_t, 4>& element) {
                                             for (size_t k = 0; k < 4; ++k)
                                               element[k] = uint16_t(decode_index(at + k * size, type));
                                           });
}

std::vector<std::array<float, 4>> GltfData::weights(int index) const {
  if (find(input_, model_, index).type != TINYGLTF_TYPE_VEC4) fail_type(index, "weights");
  return numbers<4>(index, 4, "weights", UINT64_MAX);
}

std::vector<Affine> GltfData::matrices(int index, uint64_t most) const {
  const tinygltf::Accessor& accessor = find(input_, model_, index);
  if (accessor.type != TINYGLTF_TYPE_MAT4 || accessor.componentType != TINYGLTF_COMPONENT_TYPE_FLOAT)
    fail_type(index, "matrices");
  return load_all<Affine>(index, 16, "matrices", most, [](const char* at, Affine& element) {
    for (size_t row = 0; row < 3; ++row)
      for (size_t column = 0; column < 4; ++column)
        element[row * 4 + column] = double{load<float>(at + (column * 4 + row) * sizeof(float))};
  });
}

std::vector<uint32_t> GltfData::indices(int index) const {
  const tinygltf::Accessor& accessor = find(input_, model_, index);
  const int type = accessor.componentType;
  if (accessor.type != TINYGLTF_TYPE_SCALAR || !is_index_type(type)) fail_type(index, "indices");
  return load_all<uint32_t>(index, 1, "indices", UINT64_MAX,
                            [type](const char* at, uint32_t& element) { element = decode_index(at, type); });
}

std::vector<float> GltfData::keys(int index, int components) const {
  constexpr const char* kWhat = "keys of animations";
  const int type = components == 1   ? TINYGLTF_TYPE_SCALAR
                   : components == 3 ? TINYGLTF_TYPE_VEC3
                                     : TINYGLTF_TYPE_VEC4;
  if (find(input_, model_, index).type != type) fail_type(index, kWhat);
  std::vector<float> all;
  const auto add = [&](const auto& elements) {
    for (const auto& element : elements) all.insert(all.end(), element.begin(), element.end());
  };
  if (components == 1) add(numbers<1>(index, 1, kWhat, UINT64_MAX));
  if (components == 3) add(numbers<3>(index, 3, kWhat, UINT64_MAX));
  if (components == 4) add(numbers<4>(index, 4, kWhat, UINT64_MAX));
  return all;
}

}  // namespace nif::mesh::detail
