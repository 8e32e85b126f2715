// Lists the shapes, and checks requests. A new shape is declared in shapes.hpp and gets a line in the table.
#include "mesh/generate/shape.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <string>

#include "formats/base/status.hpp"
#include "mesh/generate/city.hpp"
#include "mesh/generate/forest.hpp"
#include "mesh/generate/shapes.hpp"

namespace nif::generate {
namespace {

constexpr Shape kShapes[] = {
    {"statue", "a head on a bust with curls, folds and rough stone", kFewestTriangles, make_statue},
    {"tori", "two linked rings", kFewestTriangles, make_tori},
    {"torus", "one ring", kFewestTriangles, make_torus},
    {"tree", "a trunk, limbs and leaves; most triangles are leaves", kFewestTriangles, make_tree},
    {"terrain", "mountains on top of a chunk", kFewestTriangles, make_terrain},
    {"chain-mail", "a waved sheet of rings, each linked with four others", kFewestOfChainMail,
     make_chain_mail}};

const Shape& shape_named(std::string_view name) {
  const auto found = std::find_if(std::begin(kShapes), std::end(kShapes),
                                  [&](const Shape& shape) { return shape.name == name; });
  if (found != std::end(kShapes)) return *found;
  std::string names;
  for (const Shape& shape : kShapes) names += fmt::format("{}, ", shape.name);
  names += fmt::format("{} and {}", kCity, kForest);
  throw Error(Status::usage, fmt::format("unknown shape '{}'; the shapes are {}", name, names));
}

}  // namespace

std::span<const Shape> shapes() { return kShapes; }

std::unique_ptr<mesh::MeshSource> make_shape(std::string_view name, const Request& request) {
  const Shape& shape = shape_named(name);
  if (request.triangles < shape.fewest_triangles || request.triangles > kMostTriangles)
    throw Error(Status::usage, fmt::format("{} triangles: {} can have {} to {}", request.triangles, name,
                                           shape.fewest_triangles, kMostTriangles));
  return shape.make(request);
}

}  // namespace nif::generate
