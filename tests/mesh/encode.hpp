// Meshes as files: one small writer for each format.
#pragma once

#include <string>
#include <string_view>

#include "formats/mesh/mesh_scene.hpp"
#include "tests/support/gltf.hpp"

namespace nif::test {

std::string ply_text(const mesh::Mesh& mesh);
std::string ply_binary(const mesh::Mesh& mesh, bool big_endian = false);
std::string stl_text(const mesh::Mesh& mesh);
std::string stl_binary(const mesh::Mesh& mesh);
std::string obj_text(const mesh::Mesh& mesh);
std::string off_text(const mesh::Mesh& mesh);
std::string draco(const mesh::Mesh& mesh);  ///< lossless; Draco reorders the triangles
std::string draco_points(const mesh::Mesh& mesh);

std::string gzip(std::string_view bytes);
std::string zstd(std::string_view bytes);

}  // namespace nif::test
