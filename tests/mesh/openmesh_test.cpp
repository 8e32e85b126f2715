// OpenMesh as a second opinion: what its writers write, our readers read back as the same triangles.
#include <gtest/gtest.h>

#include <OpenMesh/Core/IO/MeshIO.hh>
#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>

#include "formats/mesh/clean.hpp"
#include "formats/mesh/read.hpp"
#include "tests/support/temp_dir.hpp"
#include "tests/support/test_shapes.hpp"

namespace nif::test {
namespace {

TEST(OpenMesh, FilesItWritesAreRead) {
  const mesh::Mesh shape = torus(24, 16);
  OpenMesh::TriMesh_ArrayKernelT<> half_edges;
  std::vector<OpenMesh::VertexHandle> handles;
  for (const auto& p : shape.positions) handles.push_back(half_edges.add_vertex({p[0], p[1], p[2]}));
  for (const auto& [a, b, c] : shape.triangles) half_edges.add_face(handles[a], handles[b], handles[c]);
  half_edges.request_vertex_normals();
  half_edges.request_vertex_colors();
  half_edges.request_face_normals();
  half_edges.update_normals();
  for (const auto v : half_edges.vertices()) half_edges.set_color(v, {10, 20, 30});

  omlog().disable();
  const TempDir folder;
  using OpenMesh::IO::Options;
  struct Case {
    const char* name;
    int options;
  };
  for (const auto& [name, options] :
       {Case{"a.ply", Options::VertexNormal}, Case{"b.ply", Options::Binary | Options::VertexColor},
        Case{"c.ply", Options::Binary | Options::MSB}, Case{"a.obj", Options::VertexNormal}, Case{"a.off", 0},
        Case{"b.off", Options::VertexNormal | Options::VertexColor}, Case{"a.stl", 0},
        Case{"b.stl", Options::Binary}}) {
    const auto file = folder.path() / name;
    ASSERT_TRUE(OpenMesh::IO::write_mesh(half_edges, file.string(), static_cast<Options::Flag>(options), 9))
        << name;
    const mesh::Scene scene = mesh::read(file);
    ASSERT_EQ(scene.meshes.size(), 1u) << name;
    // STL repeats positions, in the order of the triangles; cleaning makes all formats comparable.
    const mesh::CleanMesh got = mesh::clean(scene.meshes[0]);
    ASSERT_EQ(got.triangles.size(), shape.triangles.size()) << name;
    EXPECT_EQ(got.positions.size(), shape.positions.size()) << name;
    for (size_t t = 0; t < shape.triangles.size(); ++t) {
      for (size_t k = 0; k < 3; ++k) {
        // Some of OpenMesh's text writers round to a fixed number of digits.
        const auto &p = got.positions[got.triangles[t][k]], &q = shape.positions[shape.triangles[t][k]];
        for (size_t axis = 0; axis < 3; ++axis) EXPECT_NEAR(p[axis], q[axis], 2e-6) << name << ' ' << t;
      }
    }
  }
}

}  // namespace
}  // namespace nif::test
