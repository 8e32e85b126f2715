// Draco: whole .drc files, and the compressed primitives of glTF.
#include <draco/compression/decode.h>
#include <draco/mesh/mesh.h>
#include <fmt/format.h>

#include <limits>

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

}  // namespace

void append_draco(const Input& input, std::string_view bytes, int position_id, const std::string& where,
                  Mesh& mesh) {
  draco::DecoderBuffer buffer;
  buffer.Init(bytes.data(), bytes.size());
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
  const draco::PointAttribute* positions =
      position_id < 0 ? source.GetNamedAttribute(draco::GeometryAttribute::POSITION)
                      : source.GetAttributeByUniqueId(static_cast<uint32_t>(position_id));
  if (positions == nullptr || positions->num_components() != 3) {
    input.fail(Status::malformed_mesh, fmt::format("{} has no positions of three components", where));
  }
  check_triangle_limit(input, mesh.triangles.size() + source.num_faces());
  const uint64_t base = mesh.positions.size();
  if (base + source.num_points() > std::numeric_limits<uint32_t>::max()) {
    input.fail(Status::too_large, fmt::format("{} brings more vertices than 32-bit indices reach", where));
  }
  if (mesh.name.empty()) mesh.name = name_in(source);

  mesh.positions.reserve(base + source.num_points());
  for (draco::PointIndex p(0); p < source.num_points(); ++p) {
    Float3 position{};
    const draco::AttributeValueIndex value = positions->mapped_index(p);
    if (value.value() >= positions->size() || !positions->ConvertValue<float, 3>(value, position.data())) {
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
                   fmt::format("triangle {} of {} names vertex {}, but there are {}", f.value(), where, v,
                               source.num_points()));
      }
      triangle[i] = static_cast<uint32_t>(base + v);
    }
    mesh.triangles.push_back(triangle);
  }
}

Scene read_draco(const Input& input) {
  Mesh mesh;
  append_draco(input, input.bytes, -1, "the Draco data", mesh);
  if (mesh.name.empty()) mesh.name = input.stem;
  std::vector<Mesh> meshes;
  meshes.push_back(std::move(mesh));
  return scene_of(std::move(meshes));
}

}  // namespace nif::mesh::detail
