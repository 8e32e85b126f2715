// States that this library was built with CGAL.
#include "mesh/cgal/cgal.hpp"

namespace nif::cgal {

bool available() { return true; }
void require(const char*) {}

}  // namespace nif::cgal
