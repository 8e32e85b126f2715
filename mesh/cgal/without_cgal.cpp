// The library without CGAL (NIF_WITH_CGAL=OFF): every function throws the same message.
#include <string>

#include "mesh/cgal/cgal.hpp"

namespace nif::cgal {

bool available() { return false; }

void require(const char* what) {
  throw Error(Status::usage, std::string("this build of nif lacks CGAL, which ") + what +
                                 " needs; build it with NIF_WITH_CGAL=ON");
}

std::optional<SelfIntersections> find_self_intersections(const mesh::CleanMesh&, const std::atomic<bool>&,
                                                         uint64_t) {
  require("the search for self-intersections");
  return {};
}

Holes fill_holes(mesh::Mesh&, uint64_t, const IsRim&, const std::atomic<bool>&) {
  require("hole filling");
  return {};
}

mesh::Mesh remesh_isotropic(const mesh::Mesh&, double, uint32_t, double) {
  require("isotropic remeshing");
  return {};
}

}  // namespace nif::cgal
