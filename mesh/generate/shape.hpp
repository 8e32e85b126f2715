// Generates test meshes from formulas and random numbers, so that everyone has them without a download.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string_view>

#include "formats/mesh/mesh_source.hpp"

namespace nif::generate {

inline constexpr uint64_t kFewestTriangles = 100, kMostTriangles = 50'000'000;

/// Parameters of a shape.
struct Request {
  uint64_t triangles = 100'000;  ///< an upper limit, kFewestTriangles to kMostTriangles
  uint64_t seed = 1;             ///< of everything random about it
};

/// A kind of mesh. All are closed (every edge has two triangles, which traverse it in opposite directions),
/// face outwards, have y up, and consist of one or more such surfaces, which may overlap.
struct Shape {
  std::string_view name;         ///< as on the command line
  std::string_view description;  ///< half a sentence
  uint64_t fewest_triangles;     ///< the minimum to make it; at least kFewestTriangles
  /// The source may hold only data that does not grow with the requested triangles, a few megabytes at most.
  std::unique_ptr<mesh::MeshSource> (*make)(const Request&);
};

/// All shapes; they live as long as the program.
std::span<const Shape> shapes();

/// A shape's mesh, with as many triangles as its tessellation allows within the request. The same request
/// gives the same mesh, bit by bit. Throws nif::Error(usage) if no shape has the name or the number of
/// triangles is out of the shape's range.
std::unique_ptr<mesh::MeshSource> make_shape(std::string_view name, const Request& request);

}  // namespace nif::generate
