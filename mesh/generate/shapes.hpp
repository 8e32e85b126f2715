// Declares the shapes, each in the file of its name; shape.cpp lists them.
#pragma once

#include <memory>

#include "formats/mesh/mesh_source.hpp"
#include "mesh/generate/shape.hpp"

namespace nif::generate {

std::unique_ptr<mesh::MeshSource> make_chain_mail(const Request& request);
std::unique_ptr<mesh::MeshSource> make_statue(const Request& request);
std::unique_ptr<mesh::MeshSource> make_terrain(const Request& request);
std::unique_ptr<mesh::MeshSource> make_tori(const Request& request);
std::unique_ptr<mesh::MeshSource> make_torus(const Request& request);
std::unique_ptr<mesh::MeshSource> make_tree(const Request& request);

/// Minimum number of triangles for shapes that need more than kFewestTriangles.
inline constexpr uint64_t kFewestOfChainMail = 144;

}  // namespace nif::generate
