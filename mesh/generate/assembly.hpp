// Assembles an object from closed surfaces that face outwards and may overlap.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "formats/base/vector.hpp"
#include "formats/mesh/mesh_scene.hpp"
#include "formats/mesh/mesh_source.hpp"
#include "mesh/generate/ring.hpp"

namespace nif::generate {

/// A corner of a footprint, seen from above with x to the right and z towards the viewer.
struct Ground {
  double x, z;
};

/// A wall around a footprint, as a grid of cells. Each cell may be recessed, as windows and doors are.
struct Wall {
  std::vector<Ground> corners;             ///< counter-clockwise; all are visible from their mean
  std::vector<std::vector<double>> lines;  ///< [side] vertical grid lines, between 0 and the side's length
  std::vector<double> heights;             ///< of horizontal grid lines, from bottom to top
  /// How far the cell between lines `column` and `column + 1` of a side and heights `row` and `row + 1` is
  /// recessed behind the wall.
  std::function<double(size_t side, size_t column, size_t row)> depth;

  double length_of(size_t side) const;
  /// A point on a side, `along` from its first corner and `out` in front of the wall.
  Double3 at(size_t side, double along, double height, double out = 0) const;
  Double3 along(size_t side) const;     ///< unit vector
  Double3 outwards(size_t side) const;  ///< unit vector
};

class Assembly {
 public:
  /// An upright box between two corners.
  void block(const Double3& low, const Double3& high);
  /// A box given by its centre and its half sides, which are perpendicular and right-handed.
  void box(const Double3& centre, const Double3& x, const Double3& y, const Double3& z);
  /// A beam between two points, `width` wide across `up` and `height` high along it.
  void beam(const Double3& from, const Double3& to, const Double3& up, double width, double height);
  /// Rings of `sides` vertices around a path; `vertex(ring, turns)`.
  void tube(uint64_t sides, uint64_t rings, const Double3& first, const Double3& last,
            const std::function<Double3(uint64_t ring, double turns)>& vertex);
  /// A round bar around a curve, with constant radius.
  void rod(const std::function<Double3(double t)>& curve, double radius, uint64_t sides, uint64_t rings);
  struct Turned {
    double radius, height;
  };
  /// A lathed surface: rings about the vertical axis through `foot`.
  void lathe(const Double3& foot, const std::vector<Turned>& profile, uint64_t sides);
  void ring(const Ring& ring, const RingGrid& grid);
  /// A wall with a floor and a ceiling, whose middle is raised by `peak`.
  void wall(const Wall& wall, double peak = 0);
  /// A slab from `low` to `high`, with a bottom at the height `bottom` and a top given by `height`.
  void slab(const Ground& low, const Ground& high, uint64_t nx, uint64_t nz, double bottom,
            const std::function<double(double x, double z)>& height);
  /// A whole mesh, scaled and then moved.
  void add(const mesh::MeshSource& source, double scale, const Double3& move);

  /// Moves everything so far, by a map that neither mirrors nor tears.
  void change(const std::function<Double3(const Double3&)>& moved);

  mesh::Mesh take(std::string name);

 private:
  uint32_t vertex(const Double3& p);
  void quad(uint32_t a, uint32_t b, uint32_t c, uint32_t d);

  mesh::Mesh mesh_;
};

}  // namespace nif::generate
