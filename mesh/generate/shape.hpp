// Test meshes that anyone can generate without a download, from formulas and random numbers.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string_view>

#include "formats/mesh/mesh_source.hpp"

namespace nif::generate {

inline constexpr uint64_t kFewestTriangles = 100, kMostTriangles = 50'000'000;

/// What is asked of a shape.
struct Request {
  uint64_t triangles = 100'000;  ///< at most so many, kFewestTriangles to kMostTriangles
  uint64_t seed = 1;             ///< of all that is random about it
};

/// A kind of mesh. All are closed (every edge has two triangles, which run along it in opposite directions),
/// face outwards, have y upwards, and consist of one or more such surfaces, which may reach into each other.
struct Shape {
  std::string_view name;         ///< as on a command line
  std::string_view description;  ///< half a sentence
  uint64_t fewest_triangles;     ///< below these it cannot be made; kFewestTriangles or more
  /// Holds what does not grow with the request's triangles, a few megabytes at most.
  std::unique_ptr<mesh::MeshSource> (*make)(const Request&);
};

/// All there are; they live as long as the program.
std::span<const Shape> shapes();

/// A shape's mesh, with as many triangles as its tessellation allows below the request's. The same request
/// gives the same mesh, bit by bit. Throws nif::Error(usage) for a name that no shape has and for triangles
/// out of the shape's range.
std::unique_ptr<mesh::MeshSource> make_shape(std::string_view name, const Request& request);

}  // namespace nif::generate
