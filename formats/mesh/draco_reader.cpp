// Draco: whole .drc files, and the compressed primitives of glTF.
#include <draco/compression/decode.h>
#include <draco/mesh/mesh.h>
#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <limits>
#include <type_traits>

#include "formats/mesh/readers.hpp"

namespace nif::mesh::detail {
namespace {

/// A name in the file's metadata, as Draco's own encoder writes it; else empty.
std::string name_in(const draco::Mesh& decoded) {
  std::string name;
  if (const draco::GeometryMetadata* metadata = decoded.GetMetadata())
    metadata->GetEntryString("name", &name);
  return name;
}

/// Reads positions of the types that make sense. Draco's own conversion also reads them as bools where a
/// damaged file says so, and loading a byte that is no bool is undefined.
class Positions {
 public:
  Positions(const draco::PointAttribute& source, bool normalized)
      : source_(source), normalized_(normalized) {}

  bool valid() const {
    const int64_t size = int64_t{3} * draco::DataTypeLength(source_.data_type());
    return source_.num_components() == 3 && size > 0 && source_.byte_stride() >= size &&
           source_.byte_offset() >= 0 && source_.buffer() != nullptr &&
           static_cast<uint64_t>(source_.byte_offset()) + uint64_t{source_.size()} * source_.byte_stride() <=
               source_.buffer()->data_size();
  }

  bool read(draco::PointIndex point, Float3& out) const {
    const draco::AttributeValueIndex value = source_.mapped_index(point);
    if (value.value() >= source_.size()) return false;
    const uint8_t* at = source_.buffer()->data() + source_.GetBytePos(value);
    switch (source_.data_type()) {
      case draco::DT_INT8:
        return convert<int8_t>(at, out);
      case draco::DT_UINT8:
        return convert<uint8_t>(at, out);
      case draco::DT_INT16:
        return convert<int16_t>(at, out);
      case draco::DT_UINT16:
        return convert<uint16_t>(at, out);
      case draco::DT_INT32:
        return convert<int32_t>(at, out);
      case draco::DT_UINT32:
        return convert<uint32_t>(at, out);
      case draco::DT_FLOAT32:
        return convert<float>(at, out);
      case draco::DT_FLOAT64:
        return convert<double>(at, out);
      default:
        return false;
    }
  }

 private:
  template <class T>
  bool convert(const uint8_t* at, Float3& out) const {
    for (float& x : out) {
      T value;
      std::memcpy(&value, at, sizeof value);
      at += sizeof value;
      x = static_cast<float>(value);
      if (std::is_integral_v<T> && normalized_) {
        x = std::max(x / static_cast<float>(std::numeric_limits<T>::max()), -1.0f);
      }
    }
    return true;
  }

  const draco::PointAttribute& source_;
  bool normalized_;
};

}  // namespace

void append_draco(const Input& input, const DracoData& data, Mesh& mesh) {
  const std::string& where = data.where;
  draco::DecoderBuffer buffer;
  buffer.Init(data.bytes.data(), data.bytes.size());
  const auto type = draco::Decoder::GetEncodedGeometryType(&buffer);
  if (!type.ok()) {
    input.fail(Status::malformed_mesh, fmt::format("{} has no valid Draco header", where));
  }
  if (type.value() != draco::TRIANGULAR_MESH) {
    input.fail(Status::no_triangles, fmt::format("{} is a point cloud", where));
  }
  auto decoded = draco::Decoder().DecodeMeshFromBuffer(&buffer);
  if (!decoded.ok()) {
    input.fail(Status::malformed_mesh, fmt::format("{} is cut off or damaged (Draco says '{}')", where,
                                                   decoded.status().error_msg_string()));
  }
  const draco::Mesh& source = *decoded.value();
  const draco::PointAttribute* attribute =
      data.position_id < 0 ? source.GetNamedAttribute(draco::GeometryAttribute::POSITION)
                           : source.GetAttributeByUniqueId(static_cast<uint32_t>(data.position_id));
  if (attribute == nullptr || !Positions(*attribute, data.normalized).valid()) {
    input.fail(Status::malformed_mesh, fmt::format("{} has no positions of three components", where));
  }
  check_triangle_limit(input, mesh.triangles.size() + source.num_faces());
  const uint64_t base = mesh.positions.size();
  if (base + source.num_points() > std::numeric_limits<uint32_t>::max()) {
    input.fail(Status::too_large, fmt::format("{} has more vertices than 32-bit indices can address", where));
  }
  if (mesh.name.empty()) mesh.name = name_in(source);

  const Positions positions(*attribute, data.normalized);
  mesh.positions.reserve(base + source.num_points());
  for (draco::PointIndex p(0); p < source.num_points(); ++p) {
    Float3 position;
    if (!positions.read(p, position)) {
      input.fail(Status::malformed_mesh, fmt::format("{} has no position for vertex {}", where, p.value()));
    }
    mesh.positions.push_back(position);
  }
  mesh.triangles.reserve(mesh.triangles.size() + source.num_faces());
  for (draco::FaceIndex f(0); f < source.num_faces(); ++f) {
    Triangle triangle;
    for (size_t i = 0; i < 3; ++i) {
      const uint32_t v = source.face(f)[i].value();
      if (v >= source.num_points()) {
        input.fail(Status::index_out_of_range,
                   fmt::format("triangle {} of {} uses vertex {}, but there are only {}", f.value(), where, v,
                               source.num_points()));
      }
      triangle[i] = static_cast<uint32_t>(base + v);
    }
    mesh.triangles.push_back(triangle);
  }
}

Scene read_draco(const Input& input) {
  Mesh mesh;
  append_draco(input, {.bytes = input.bytes, .where = "the Draco data"}, mesh);
  if (mesh.name.empty()) mesh.name = input.stem;
  std::vector<Mesh> meshes;
  meshes.push_back(std::move(mesh));
  return scene_of(std::move(meshes));
}

}  // namespace nif::mesh::detail
