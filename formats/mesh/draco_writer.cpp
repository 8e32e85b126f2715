// Uses two of Draco's methods. Edgebreaker compresses best and reorders, so it is for rounded positions. The
// sequential method keeps the order, so it is for exact ones. Invalid meshes are refused before Draco sees
// them.
#include "formats/mesh/draco_writer.hpp"

#include <draco/compression/encode.h>
#include <draco/mesh/mesh.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

#include "formats/base/status.hpp"

namespace nif::mesh {
namespace {

std::unique_ptr<draco::Mesh> to_draco(const Mesh& mesh, const std::string& name) {
  auto out = std::make_unique<draco::Mesh>();
  out->set_num_points(uint32_t(mesh.positions.size()));
  out->SetNumFaces(mesh.triangles.size());
  draco::GeometryAttribute description;
  description.Init(draco::GeometryAttribute::POSITION, nullptr, 3, draco::DT_FLOAT32, false, sizeof(Float3),
                   0);
  const int id = out->AddAttribute(description, true, uint32_t(mesh.positions.size()));
  draco::PointAttribute& positions = *out->attribute(id);
  for (uint32_t v = 0; v < mesh.positions.size(); ++v)
    positions.SetAttributeValue(draco::AttributeValueIndex(v), mesh.positions[v].data());
  for (uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    const Triangle& v = mesh.triangles[t];
    out->SetFace(draco::FaceIndex(t),
                 {draco::PointIndex(v[0]), draco::PointIndex(v[1]), draco::PointIndex(v[2])});
  }
  if (!name.empty()) {
    auto metadata = std::make_unique<draco::GeometryMetadata>();
    metadata->AddEntryString("name", name);
    out->AddMetadata(std::move(metadata));
  }
  return out;
}

}  // namespace

void check_writable(const Mesh& mesh) {
  if (mesh.triangles.empty())
    throw Error(Status::no_triangles, fmt::format("mesh '{}' has no triangles", mesh.name));
  for (const Float3& p : mesh.positions)
    if (!std::isfinite(p[0]) || !std::isfinite(p[1]) || !std::isfinite(p[2]))
      throw Error(Status::non_finite_vertex,
                  fmt::format("mesh '{}' has a vertex that is not finite", mesh.name));
  for (const Triangle& t : mesh.triangles)
    if (std::max({t[0], t[1], t[2]}) >= mesh.positions.size())
      throw Error(Status::index_out_of_range,
                  fmt::format("mesh '{}' has a triangle with a vertex that does not exist", mesh.name));
}

DracoMesh encode_draco(const Mesh& mesh, uint32_t bits, const std::string& name) {
  check_writable(mesh);
  constexpr uint64_t kMost = std::numeric_limits<int32_t>::max();
  if (mesh.positions.size() > kMost || mesh.triangles.size() > kMost)
    throw Error(Status::too_large,
                fmt::format("mesh '{}' has {} vertices and {} triangles, more than Draco supports", mesh.name,
                            mesh.positions.size(), mesh.triangles.size()));
  const std::unique_ptr<draco::Mesh> source = to_draco(mesh, name);
  draco::Encoder encoder;
  encoder.SetTrackEncodedProperties(true);
  encoder.SetEncodingMethod(bits == 0 ? draco::MESH_SEQUENTIAL_ENCODING : draco::MESH_EDGEBREAKER_ENCODING);
  if (bits != 0) encoder.SetAttributeQuantization(draco::GeometryAttribute::POSITION, int(bits));
  draco::EncoderBuffer buffer;
  const draco::Status status = encoder.EncodeMeshToBuffer(*source, &buffer);
  if (!status.ok())
    throw Error(Status::all_degenerate, fmt::format("mesh '{}' cannot be compressed (Draco says '{}')",
                                                    mesh.name, status.error_msg_string()));
  const auto* begin = reinterpret_cast<const std::byte*>(buffer.data());
  return {{begin, begin + buffer.size()}, encoder.num_encoded_points(), encoder.num_encoded_faces()};
}

}  // namespace nif::mesh
