// `torus`: one ring, turned by the seed. `tori`: two rings of different sizes, linked as in a chain; the seed
// places and tilts the small one, and turns both.
#include <vector>

#include "formats/base/random.hpp"
#include "mesh/generate/axes.hpp"
#include "mesh/generate/computed.hpp"
#include "mesh/generate/ring.hpp"
#include "mesh/generate/shapes.hpp"

namespace nif::generate {
namespace {

constexpr uint64_t kToriStream = 0x746f7269;  // "tori"

/// Several rings, numbered one after the other.
class Rings {
 public:
  /// Distributes the triangles by area, so that they have the same size on all rings.
  Rings(std::vector<Ring> rings, uint64_t triangles) {
    double area = 0;
    for (const Ring& ring : rings) area += ring.radius * ring.wire;
    for (const Ring& ring : rings) {
      const RingGrid grid =
          RingGrid::of(uint64_t(double(triangles) * ring.radius * ring.wire / area), ring.radius / ring.wire);
      parts_.push_back({ring, grid, vertices_, triangles_});
      vertices_ += grid.vertex_count();
      triangles_ += grid.triangle_count();
    }
  }

  uint64_t vertex_count() const { return vertices_; }
  uint64_t triangle_count() const { return triangles_; }
  Double3 vertex(uint64_t index) const {
    size_t i = parts_.size() - 1;
    while (parts_[i].first_vertex > index) --i;
    return parts_[i].ring.vertex(parts_[i].grid, index - parts_[i].first_vertex);
  }
  mesh::Triangle triangle(uint64_t index) const {
    size_t i = parts_.size() - 1;
    while (parts_[i].first_triangle > index) --i;
    mesh::Triangle triangle = parts_[i].grid.triangle(index - parts_[i].first_triangle);
    for (uint32_t& vertex : triangle) vertex += uint32_t(parts_[i].first_vertex);
    return triangle;
  }

 private:
  struct Part {
    Ring ring;
    RingGrid grid;
    uint64_t first_vertex, first_triangle;
  };
  std::vector<Part> parts_;
  uint64_t vertices_ = 0, triangles_ = 0;
};

}  // namespace

std::unique_ptr<mesh::MeshSource> make_torus(const Request& request) {
  Random random(request.seed, kToriStream, 0);
  const Double3 z = random.direction(), x = perpendicular(z), y = cross(z, x);
  return computed(Rings({Ring{{0, 0, 0}, x, y, 1, 0.35}}, request.triangles));
}

std::unique_ptr<mesh::MeshSource> make_tori(const Request& request) {
  Random random(request.seed, kToriStream, 1);
  const Double3 z = random.direction(), x = perpendicular(z), y = cross(z, x);
  // The small ring goes around the wire of the large one and lies across it, tilted by up to 15 degrees
  // either way. Inside it, 0.6 - 0.16 is free, and the wire takes 0.32 / cos 15 degrees of that.
  const Turn at = turn(random.uniform()), tilt = turn(random.uniform(-15, 15) / 360);
  const Double3 outwards = x * at.cos + y * at.sin, along = y * at.cos - x * at.sin;
  const Ring large{{0, 0, 0}, x, y, 1, 0.32},
      small{outwards, outwards * tilt.cos + along * tilt.sin, z, 0.6, 0.16};
  return computed(Rings({large, small}, request.triangles));
}

}  // namespace nif::generate
