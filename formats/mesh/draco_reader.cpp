// Reads Draco: whole .drc files, and the compressed primitives of glTF.
#include <draco/compression/config/compression_shared.h>
#include <draco/compression/decode.h>
#include <draco/compression/point_cloud/point_cloud_decoder.h>
#include <draco/core/varint_decoding.h>
#include <draco/mesh/mesh.h>
#include <draco/metadata/metadata_decoder.h>
#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <limits>
#include <optional>
#include <type_traits>

#include "formats/base/memory.hpp"
#include "formats/mesh/chooser.hpp"
#include "formats/mesh/far_from_origin.hpp"
#include "formats/mesh/readers.hpp"

namespace nif::mesh::detail {
namespace {

/// The name in the file's metadata, as Draco's own encoder writes it, or "".
std::string name_in(const draco::Mesh& decoded) {
  std::string name;
  if (const draco::GeometryMetadata* metadata = decoded.GetMetadata())
    metadata->GetEntryString("name", &name);
  return name;
}

/// The counts in the header. Draco allocates memory for them before it reads any data, so a hundred bytes can
/// make it request tens of gigabytes.
struct Counts {
  uint32_t faces = 0, points = 0;
};

/// Returns nothing if the header is truncated or of an unknown kind; then Draco itself reports what is wrong.
std::optional<Counts> stated_counts(std::string_view bytes) {
  draco::DecoderBuffer buffer;
  buffer.Init(bytes.data(), bytes.size());
  draco::DracoHeader header{};
  if (!draco::PointCloudDecoder::DecodeHeader(&buffer, &header).ok()) return std::nullopt;
  const auto version = uint16_t(DRACO_BITSTREAM_VERSION(header.version_major, header.version_minor));
  buffer.set_bitstream_version(version);
  draco::GeometryMetadata ignored;
  if (version >= DRACO_BITSTREAM_VERSION(1, 3) && (header.flags & METADATA_FLAG_MASK) != 0 &&
      !draco::MetadataDecoder().DecodeGeometryMetadata(&buffer, &ignored))
    return std::nullopt;
  bool good = true;
  const auto number = [&](bool fixed) {
    uint32_t value = 0;
    good = good && (fixed ? buffer.Decode(&value) : draco::DecodeVarint(&value, &buffer));
    return value;
  };
  Counts counts;
  if (header.encoder_method == draco::MESH_SEQUENTIAL_ENCODING) {
    const bool fixed = version < DRACO_BITSTREAM_VERSION(2, 2);
    counts.faces = number(fixed);
    counts.points = number(fixed);
  } else {
    const bool fixed = version < DRACO_BITSTREAM_VERSION(2, 0);
    uint8_t traversal = 0;
    good = buffer.Decode(&traversal);
    if (version < DRACO_BITSTREAM_VERSION(2, 2)) number(fixed);  // vertices that came from splits
    counts.points = number(fixed);
    counts.faces = number(fixed);
  }
  return good ? std::optional(counts) : std::nullopt;
}

/// Called before anything is decoded. `so_far`: number of triangles already read.
void check_counts(const Input& input, const DracoData& data, uint64_t so_far) {
  const std::optional<Counts> counts = stated_counts(data.bytes);
  if (!counts) return;
  check_triangle_limit(input, so_far + counts->faces);
  // For a flat grid of squares, about the easiest mesh that there is, our own writer needs a byte for four of
  // these; other settings may need less. Draco stores about 150 bytes for each.
  constexpr uint64_t kMostPerByte = 512, kBytesEach = 200;
  const uint64_t both = uint64_t{counts->faces} + counts->points;
  if (both > kMostPerByte * data.bytes.size() || both > available_memory() / kBytesEach)
    input.fail(Status::too_large, fmt::format("{} claims {} triangles and {} vertices in {} bytes",
                                              data.where, counts->faces, counts->points, data.bytes.size()));
}

/// Reads positions of sensible types. Draco's own conversion also reads them as bools if a damaged file says
/// so, and loading a byte that is not a bool is undefined.
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

  bool read(draco::PointIndex point, Double3& out) const {
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
  bool convert(const uint8_t* at, Double3& out) const {
    for (double& x : out) {
      T value;
      std::memcpy(&value, at, sizeof value);
      at += sizeof value;
      x = static_cast<double>(value);
      if (std::is_integral_v<T> && normalized_) {
        x = std::max(static_cast<float>(value) / static_cast<float>(std::numeric_limits<T>::max()), -1.0f);
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
  check_counts(input, data, mesh.triangles.size());
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
    Double3 exact;
    if (!positions.read(p, exact)) {
      input.fail(Status::malformed_mesh, fmt::format("{} has no position for vertex {}", where, p.value()));
    }
    mesh.positions.push_back(to_float(exact));
    if (input.exact) mesh.exact.push_back(exact);
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
  refuse_choice(input);
  return read_exactly(input, [](const Input& given) {
    Mesh mesh;
    append_draco(given, {.bytes = given.bytes, .where = "the Draco data"}, mesh);
    if (mesh.name.empty()) mesh.name = given.stem;
    std::vector<Mesh> meshes;
    meshes.push_back(std::move(mesh));
    return scene_of(std::move(meshes));
  });
}

}  // namespace nif::mesh::detail
