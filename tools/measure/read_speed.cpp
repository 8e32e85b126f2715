// A study, not a test: how fast mesh files are read compared with libraries that could read them, and with
// how much memory. docs/results/reading.sh runs it.
//
// read_speed ROUNDS FILE
// read_speed FILE
//
// With ROUNDS, prints the median seconds that formats/mesh takes and that the library takes, and the median
// ratio of the library's time to ours in the same round. Without, prints seconds and bytes for reading the
// file once and for preparing it for a bake.
//
// The libraries are OpenMesh, whose readers fill plain lists here as ours do, and Draco for .drc.
#include <draco/compression/decode.h>
#include <draco/mesh/mesh.h>
#include <fmt/format.h>

#include <OpenMesh/Core/IO/IOManager.hh>
#include <OpenMesh/Core/IO/MeshIO.hh>
#include <OpenMesh/Core/IO/importer/BaseImporter.hh>
#include <algorithm>
#include <chrono>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "bake/ground_truth/prepare.hpp"
#include "formats/base/status.hpp"
#include "formats/mesh/read.hpp"

namespace {

using namespace nif;
namespace om = OpenMesh;

/// Collects positions and triangles from OpenMesh's readers; polygons become fans.
class Lists final : public om::IO::BaseImporter {
 public:
  mesh::Mesh mesh;

  om::VertexHandle add_vertex(const om::Vec3f& p) override {
    mesh.positions.push_back({p[0], p[1], p[2]});
    return om::VertexHandle(int(mesh.positions.size() - 1));
  }
  om::VertexHandle add_vertex() override { return add_vertex(om::Vec3f(0, 0, 0)); }
  void set_point(om::VertexHandle v, const om::Vec3f& p) override {
    mesh.positions[size_t(v.idx())] = {p[0], p[1], p[2]};
  }
  om::FaceHandle add_face(const VHandles& v) override {
    for (size_t i = 2; i < v.size(); ++i)
      mesh.triangles.push_back({uint32_t(v[0].idx()), uint32_t(v[i - 1].idx()), uint32_t(v[i].idx())});
    return om::FaceHandle(int(mesh.triangles.size() - 1));
  }
  void reserve(unsigned vertices, unsigned, unsigned faces) override {
    mesh.positions.reserve(vertices);
    mesh.triangles.reserve(faces);
  }
  size_t n_vertices() const override { return mesh.positions.size(); }
  size_t n_faces() const override { return mesh.triangles.size(); }
  size_t n_edges() const override { return 0; }

  // Everything else is dropped.
  om::HalfedgeHandle add_edge(om::VertexHandle, om::VertexHandle) override { return om::HalfedgeHandle(); }
  om::FaceHandle add_face(om::HalfedgeHandle) override { return om::FaceHandle(); }
  void add_face_texcoords(om::FaceHandle, om::VertexHandle, const std::vector<om::Vec2f>&) override {}
  void add_face_texcoords(om::FaceHandle, om::VertexHandle, const std::vector<om::Vec3f>&) override {}
  void set_face_texindex(om::FaceHandle, int) override {}
  void set_halfedge(om::VertexHandle, om::HalfedgeHandle) override {}
  void set_normal(om::VertexHandle, const om::Vec3f&) override {}
  void set_normal(om::VertexHandle, const om::Vec3d&) override {}
  void set_normal(om::FaceHandle, const om::Vec3f&) override {}
  void set_normal(om::FaceHandle, const om::Vec3d&) override {}
  void set_color(om::VertexHandle, const om::Vec3uc&) override {}
  void set_color(om::VertexHandle, const om::Vec4uc&) override {}
  void set_color(om::VertexHandle, const om::Vec3f&) override {}
  void set_color(om::VertexHandle, const om::Vec4f&) override {}
  void set_color(om::EdgeHandle, const om::Vec3uc&) override {}
  void set_color(om::EdgeHandle, const om::Vec4uc&) override {}
  void set_color(om::EdgeHandle, const om::Vec3f&) override {}
  void set_color(om::EdgeHandle, const om::Vec4f&) override {}
  void set_color(om::FaceHandle, const om::Vec3uc&) override {}
  void set_color(om::FaceHandle, const om::Vec4uc&) override {}
  void set_color(om::FaceHandle, const om::Vec3f&) override {}
  void set_color(om::FaceHandle, const om::Vec4f&) override {}
  void set_texcoord(om::VertexHandle, const om::Vec2f&) override {}
  void set_texcoord(om::VertexHandle, const om::Vec3f&) override {}
  void set_texcoord(om::HalfedgeHandle, const om::Vec2f&) override {}
  void set_texcoord(om::HalfedgeHandle, const om::Vec3f&) override {}
  void set_status(om::VertexHandle, const om::Attributes::StatusInfo&) override {}
  void set_status(om::HalfedgeHandle, const om::Attributes::StatusInfo&) override {}
  void set_status(om::EdgeHandle, const om::Attributes::StatusInfo&) override {}
  void set_status(om::FaceHandle, const om::Attributes::StatusInfo&) override {}
  void set_next(om::HalfedgeHandle, om::HalfedgeHandle) override {}
  void set_face(om::HalfedgeHandle, om::FaceHandle) override {}
  void request_face_texcoords2D() override {}
  void add_texture_information(int, std::string) override {}
};

mesh::Mesh by_draco(const std::string& file) {
  std::string bytes(std::filesystem::file_size(file), 0);
  std::ifstream(file, std::ios::binary).read(bytes.data(), std::streamsize(bytes.size()));
  draco::DecoderBuffer buffer;
  buffer.Init(bytes.data(), bytes.size());
  draco::Decoder decoder;
  auto decoded = decoder.DecodeMeshFromBuffer(&buffer);
  if (!decoded.ok()) throw Error(Status::malformed_mesh, file + ": Draco cannot read it");
  const draco::Mesh& source = *decoded.value();
  const draco::PointAttribute& positions = *source.GetNamedAttribute(draco::GeometryAttribute::POSITION);
  mesh::Mesh mesh;
  mesh.positions.resize(source.num_points());
  for (uint32_t i = 0; i < source.num_points(); ++i)
    positions.GetMappedValue(draco::PointIndex(i), mesh.positions[i].data());
  mesh.triangles.resize(source.num_faces());
  for (uint32_t i = 0; i < source.num_faces(); ++i) {
    const draco::Mesh::Face& face = source.face(draco::FaceIndex(i));
    mesh.triangles[i] = {face[0].value(), face[1].value(), face[2].value()};
  }
  return mesh;
}

mesh::Mesh by_openmesh(const std::string& file) {
  Lists lists;
  om::IO::Options options;
  if (!om::IO::IOManager().read(file, lists, options))
    throw Error(Status::malformed_mesh, file + ": OpenMesh cannot read it");
  return std::move(lists.mesh);
}

/// Seconds that `read` takes; `triangles` receives its result.
template <class Read>
double time(size_t& triangles, Read read) {
  const auto start = std::chrono::steady_clock::now();
  triangles = read();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

/// A value of /proc/self/status, in bytes.
uint64_t status_bytes(const char* key) {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);)
    if (line.starts_with(key)) return std::strtoull(line.c_str() + std::strlen(key), nullptr, 10) * 1024;
  return 0;
}

void compare(int rounds, const std::string& file) {
  const bool drc = file.ends_with(".drc");
  std::vector<double> ours, theirs, ratios;
  for (int round = 0; round < rounds; ++round) {
    size_t own_triangles = 0, their_triangles = 0;
    const auto read_ours = [&] {
      ours.push_back(time(own_triangles, [&] { return mesh::read(file).meshes.at(0).triangles.size(); }));
    };
    const auto read_theirs = [&] {
      theirs.push_back(
          time(their_triangles, [&] { return (drc ? by_draco(file) : by_openmesh(file)).triangles.size(); }));
    };
    if (round % 2)
      read_theirs(), read_ours();
    else
      read_ours(), read_theirs();
    ratios.push_back(theirs.back() / ours.back());
    if (own_triangles != their_triangles && round == 0)
      fmt::print(stderr, "read_speed: {}: {} triangles, and {} by the library\n", file, own_triangles,
                 their_triangles);
  }
  fmt::print("{:.3f} {:.3f} {:.2f}\n", median(ours), median(theirs), median(ratios));
}

void measure(const std::string& file) {
  const uint64_t before = status_bytes("VmRSS:");
  size_t triangles = 0, kept = 0;
  mesh::Scene scene;
  const double reading = time(triangles, [&] {
    scene = mesh::read(file);
    return scene.meshes.at(0).triangles.size();
  });
  const uint64_t after_reading = status_bytes("VmHWM:") - before;
  uint64_t arrays = 0;
  for (const mesh::Mesh& mesh : scene.meshes)
    arrays += mesh.positions.size() * sizeof(mesh::Float3) + mesh.triangles.size() * sizeof(mesh::Triangle);
  const double preparing =
      time(kept, [&] { return bake::prepare(scene).objects.at(0).surface.triangles.size(); });
  fmt::print("{} {} {:.2f} {} {:.2f} {}\n", triangles, arrays, reading, after_reading, preparing,
             status_bytes("VmHWM:") - before);
}

}  // namespace

int main(int argc, char** argv) {
  try {
    if (argc == 3 && std::atoi(argv[1]) > 0) {
      compare(std::atoi(argv[1]), argv[2]);
    } else if (argc == 2) {
      measure(argv[1]);
    } else {
      fmt::print(stderr, "usage: read_speed [ROUNDS] FILE\n");
      return 2;
    }
  } catch (const std::exception& error) {
    fmt::print(stderr, "read_speed: {}\n", error.what());
    return 1;
  }
}
