// Writers that share no code with the readers under test.
#include "tests/mesh/encode.hpp"

#include <draco/compression/encode.h>
#include <draco/mesh/triangle_soup_mesh_builder.h>
#include <draco/point_cloud/point_cloud_builder.h>
#include <gtest/gtest.h>
#include <zlib.h>
#include <zstd.h>

#include <algorithm>
#include <cstring>
#include <limits>
#include <sstream>

namespace nif::test {
namespace {

std::ostringstream text_stream() {
  std::ostringstream out;
  out.imbue(std::locale::classic());
  out.precision(std::numeric_limits<float>::max_digits10);
  return out;
}

template <class T>
void put(std::string& out, T value, bool big_endian = false) {
  char bytes[sizeof value];
  std::memcpy(bytes, &value, sizeof value);
  if (big_endian) std::reverse(bytes, bytes + sizeof value);
  out.append(bytes, sizeof value);
}

std::string ply_header(const mesh::Mesh& mesh, const char* format) {
  std::ostringstream out;
  out << "ply\nformat " << format << " 1.0\nelement vertex " << mesh.positions.size()
      << "\nproperty float x\nproperty float y\nproperty float z\nelement face " << mesh.triangles.size()
      << "\nproperty list uchar int vertex_indices\ncomment the last line\nend_header\n";
  return out.str();
}

}  // namespace

std::string ply_text(const mesh::Mesh& mesh) {
  auto out = text_stream();
  out << ply_header(mesh, "ascii");
  for (const auto& p : mesh.positions) out << p[0] << ' ' << p[1] << ' ' << p[2] << '\n';
  for (const auto& t : mesh.triangles) out << "3 " << t[0] << ' ' << t[1] << ' ' << t[2] << '\n';
  return out.str();
}

std::string ply_binary(const mesh::Mesh& mesh, bool big_endian) {
  std::string out = ply_header(mesh, big_endian ? "binary_big_endian" : "binary_little_endian");
  for (const auto& p : mesh.positions) {
    for (const float x : p) put(out, x, big_endian);
  }
  for (const auto& t : mesh.triangles) {
    out.push_back(3);
    for (const uint32_t v : t) put(out, v, big_endian);
  }
  return out;
}

std::string stl_text(const mesh::Mesh& mesh) {
  auto out = text_stream();
  out << "solid " << mesh.name << '\n';
  for (const auto& t : mesh.triangles) {
    out << "facet normal 0 0 0\n outer loop\n";
    for (const uint32_t v : t) {
      const auto& p = mesh.positions[v];
      out << "  vertex " << p[0] << ' ' << p[1] << ' ' << p[2] << '\n';
    }
    out << " endloop\nendfacet\n";
  }
  out << "endsolid " << mesh.name << '\n';
  return out.str();
}

std::string stl_binary(const mesh::Mesh& mesh) {
  std::string out(80, ' ');
  put(out, static_cast<uint32_t>(mesh.triangles.size()));
  for (const auto& t : mesh.triangles) {
    out.append(12, '\0');
    for (const uint32_t v : t) {
      for (const float x : mesh.positions[v]) put(out, x);
    }
    out.append(2, '\0');
  }
  return out;
}

std::string obj_text(const mesh::Mesh& mesh) {
  auto out = text_stream();
  out << "o " << mesh.name << '\n';
  for (const auto& p : mesh.positions) out << "v " << p[0] << ' ' << p[1] << ' ' << p[2] << '\n';
  for (const auto& t : mesh.triangles) out << "f " << t[0] + 1 << ' ' << t[1] + 1 << ' ' << t[2] + 1 << '\n';
  return out.str();
}

std::string off_text(const mesh::Mesh& mesh) {
  auto out = text_stream();
  out << "OFF\n# a comment\n" << mesh.positions.size() << ' ' << mesh.triangles.size() << " 0\n";
  for (const auto& p : mesh.positions) out << p[0] << ' ' << p[1] << ' ' << p[2] << '\n';
  for (const auto& t : mesh.triangles) out << "3 " << t[0] << ' ' << t[1] << ' ' << t[2] << " 255 0 0\n";
  return out.str();
}

std::string draco(const mesh::Mesh& mesh) {
  draco::TriangleSoupMeshBuilder builder;
  builder.Start(static_cast<int>(mesh.triangles.size()));
  const int attribute = builder.AddAttribute(draco::GeometryAttribute::POSITION, 3, draco::DT_FLOAT32);
  for (size_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto& [a, b, c] = mesh.triangles[t];
    builder.SetAttributeValuesForFace(attribute, draco::FaceIndex(static_cast<uint32_t>(t)),
                                      mesh.positions[a].data(), mesh.positions[b].data(),
                                      mesh.positions[c].data());
  }
  const auto built = builder.Finalize();
  draco::Encoder encoder;  // without quantisation
  draco::EncoderBuffer buffer;
  EXPECT_TRUE(encoder.EncodeMeshToBuffer(*built, &buffer).ok());
  return {buffer.data(), buffer.size()};
}

std::string draco_points(const mesh::Mesh& mesh) {
  draco::PointCloudBuilder builder;
  builder.Start(static_cast<uint32_t>(mesh.positions.size()));
  const int attribute = builder.AddAttribute(draco::GeometryAttribute::POSITION, 3, draco::DT_FLOAT32);
  for (uint32_t i = 0; i < mesh.positions.size(); ++i) {
    builder.SetAttributeValueForPoint(attribute, draco::PointIndex(i), mesh.positions[i].data());
  }
  const auto built = builder.Finalize(false);
  draco::Encoder encoder;
  draco::EncoderBuffer buffer;
  EXPECT_TRUE(encoder.EncodePointCloudToBuffer(*built, &buffer).ok());
  return {buffer.data(), buffer.size()};
}

std::string gzip(std::string_view bytes) {
  z_stream stream{};
  EXPECT_EQ(deflateInit2(&stream, 6, Z_DEFLATED, 15 + 16, 8, Z_DEFAULT_STRATEGY), Z_OK);
  std::string out(deflateBound(&stream, bytes.size()) + 64, '\0');
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
  stream.avail_in = static_cast<uInt>(bytes.size());
  stream.next_out = reinterpret_cast<Bytef*>(out.data());
  stream.avail_out = static_cast<uInt>(out.size());
  EXPECT_EQ(deflate(&stream, Z_FINISH), Z_STREAM_END);
  out.resize(stream.total_out);
  deflateEnd(&stream);
  return out;
}

std::string zstd(std::string_view bytes) {
  std::string out(ZSTD_compressBound(bytes.size()), '\0');
  const size_t size = ZSTD_compress(out.data(), out.size(), bytes.data(), bytes.size(), 3);
  EXPECT_FALSE(ZSTD_isError(size));
  out.resize(size);
  return out;
}

}  // namespace nif::test
