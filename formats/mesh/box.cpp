#include "formats/mesh/box.hpp"

#include <algorithm>
#include <limits>

#include "formats/base/vector.hpp"

namespace nif::mesh {

void Box::add(std::span<const Float3> positions, const Triangle& triangle) {
  for (uint32_t i : triangle) {
    for (int a = 0; a < 3; ++a) {
      min[a] = std::min(min[a], positions[i][a]);
      max[a] = std::max(max[a], positions[i][a]);
    }
  }
}

float Box::longest_side() const { return std::max({max[0] - min[0], max[1] - min[1], max[2] - min[2]}); }
double Box::diagonal() const { return length(to_double(max) - to_double(min)); }

Box bounds(std::span<const Float3> positions, std::span<const Triangle> triangles) {
  constexpr float kFar = std::numeric_limits<float>::max();
  Box box{{kFar, kFar, kFar}, {-kFar, -kFar, -kFar}};
  for (const Triangle& triangle : triangles) box.add(positions, triangle);
  return box;
}

}  // namespace nif::mesh
