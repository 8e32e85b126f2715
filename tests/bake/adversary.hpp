// Makes segments that are as hard to answer with certainty as we can find.
#pragma once

#include <limits>

#include "formats/base/vector.hpp"
#include "kernels/reference/planes/grid_traversal.hpp"
#include "tests/bake/hard_shapes.hpp"
#include "tests/support/occupied_object.hpp"

namespace nif::test {

using kernels::Segment;

inline Double3 random_point(const mesh::Box& box, nif::Random& random, double margin) {
  Double3 point;
  for (int a = 0; a < 3; ++a) {
    const double size = double(box.max[a]) - box.min[a];
    point[a] = random.uniform(box.min[a] - margin * size, box.max[a] + margin * size);
  }
  return point;
}

/// Draws the hardest segments that we know how to make.
class Adversary {
 public:
  explicit Adversary(const OccupiedObject& o) : o_(o) {
    const kernels::SegmentField& field = o.field;
    for (int32_t z = 0; z < int32_t(field.voxels[2]); ++z)
      for (int32_t y = 0; y < int32_t(field.voxels[1]); ++y)
        for (int32_t x = 0; x < int32_t(field.voxels[0]); ++x) {
          const int32_t voxel[3] = {x, y, z};
          add_cells(kernels::voxel_word(field, voxel),
                    {x << field.levels, y << field.levels, z << field.levels}, 1 << field.levels);
        }
  }

  Segment draw(nif::Random& random) const {
    if (random.below(8) == 0) return draw_past_edge(random);
    const double diagonal = o_.prepared.box.diagonal();
    Double3 from = point(random), direction = random.direction();
    double tmin = 0, tmax = double(kInfinity);
    switch (random.below(4)) {
      case 0:
        tmax = random.uniform() * diagonal;
        break;
      case 1:
        tmin = random.uniform() * diagonal;
        break;
      default:
        break;
    }
    switch (random.below(6)) {
      case 0:
        break;
      case 1:
        direction = point(random) - from;
        if (random.below(2)) tmin = 0, tmax = 1;  // ends there
        break;
      case 2:  // along an axis
        direction = {};
        direction[random.below(3)] = random.below(2) ? 1 : -1;
        break;
      case 3:  // within a plane between voxels
        direction[random.below(3)] = 0;
        break;
      case 4:  // nearly within it
        direction[random.below(3)] *= random_size(random, 1e-6, 0.1);
        break;
      default: {  // nearly along a stored plane
        const Double3 n = normal_of(cells_[random.below(uint32_t(cells_.size()))].word);
        direction = cross(n, direction);
        direction = direction * (1 / length(direction)) + n * (random_size(random, 1e-7, 0.1) / length(n));
        break;
      }
    }
    // Some start as far away as certain answers allow.
    if (random.below(6) == 0) {
      const double back = draw_way_back(direction, random);
      from = from - direction * back;
      tmin = 0;
      tmax = random.below(2) ? back : double(kInfinity);
    }
    return segment(from, direction, tmin, tmax);
  }

 private:
  struct Cell {
    uint32_t word;
    std::array<int32_t, 3> low;
    int32_t size;
  };

  void add_cells(uint32_t word, const std::array<int32_t, 3>& low, int32_t size) {
    if (kernels::word_kind(word) == kernels::kEmptyVoxel) return;
    if (kernels::word_kind(word) != kernels::kLink) {
      cells_.push_back({word, low, size});
      return;
    }
    for (uint32_t part = 0; part < 8; ++part) {
      if (!(kernels::link_mask(word) >> part & 1)) continue;
      std::array<int32_t, 3> at = low;
      for (size_t a = 0; a < 3; ++a)
        if (part >> a & 1) at[a] += size / 2;
      add_cells(o_.field.children[kernels::link_child(word, part)], at, size / 2);
    }
  }

  static Double3 normal_of(uint32_t word) {
    const kernels::CellNormal n = kernels::cell_normal(word);
    return {double(n.x), double(n.y), double(n.z)};
  }

  static Segment segment(const Double3& from, const Double3& direction, double tmin, double tmax) {
    Segment s{{}, {}, float(tmin), float(tmax)};
    for (size_t a = 0; a < 3; ++a) {
      s.origin[a] = float(from[a]);
      s.direction[a] = float(direction[a]);
    }
    return s;
  }

  /// The farthest start of a segment whose answer can be certain.
  double draw_way_back(const Double3& direction, nif::Random& random) const {
    const double steepest =
        std::max({std::abs(direction[0]), std::abs(direction[1]), std::abs(direction[2])});
    return random.uniform(0.5, 1.0) * kernels::kCertainReach / double(o_.field.cells_per_unit) / steepest;
  }

  /// Aims just past an edge or a vertex, from where rounding is worst: rounding then decides which cells are
  /// visited.
  Segment draw_past_edge(nif::Random& random) const {
    const mesh::CleanMesh& surface = o_.prepared.surface;
    const mesh::Triangle& t = surface.triangles[random.below(uint32_t(surface.triangles.size()))];
    const uint32_t corner = random.below(3);
    const Double3 from = to_double(surface.positions[t[corner]]),
                  to = to_double(surface.positions[t[(corner + 1) % 3]]);
    const Double3 at = from + (to - from) * (random.below(2) ? random.uniform() : 0),
                  direction = random.direction(),
                  beside = random.direction() *
                           (random_size(random, 1e-5, 1e-2) / double(o_.field.cells_per_unit));
    return segment(at + beside - direction * draw_way_back(direction, random), direction, 0,
                   double(kInfinity));
  }

  /// From finest cells to object space.
  Double3 from_grid(const Double3& p) const {
    return to_double(o_.occupancy.grid.origin) + p * (1 / double(o_.field.cells_per_unit));
  }

  Double3 point(nif::Random& random) const {
    const mesh::Box& box = o_.prepared.box;
    switch (random.below(10)) {
      case 0:
        return random_point(box, random, 0.0);  // anywhere, also inside solids
      case 1:
        return random_point(box, random, 1.0);
      case 2:
        return random_point(box, random, 20.0);  // far
      case 3:
        return point_on_voxel(random);
      case 4:
        return point_on_cell(random);
      case 5:
        return point_at_plane(random, 0);
      case 6:
        return point_at_plane(random, random_size(random, 1e-6, 0.1));
      case 7: {  // about the bias away from a triangle, where renderers start rays
        Double3 normal;
        const Double3 p = point_on_surface(random, normal);
        return p + normal * (o_.prepared.bias * (random.below(2) ? 1 : random_size(random, 1e-3, 10.0)));
      }
      default: {
        Double3 normal;
        return point_on_surface(random, normal);
      }
    }
  }

  /// A corner of a random voxel, or a point on its edge or face: there the traversal must choose between
  /// neighbours.
  Double3 point_on_voxel(nif::Random& random) const {
    const bake::Grid& grid = o_.occupancy.grid;
    const uint32_t snapped = 1 + random.below(7);  // at least one axis lies on a plane between voxels
    Double3 at;
    for (size_t a = 0; a < 3; ++a) {
      at[a] = random.uniform() * grid.voxels[a];
      if (snapped >> a & 1) at[a] = std::floor(at[a]);
    }
    return from_grid(at * double(grid.cells()));
  }

  /// The same for a cell with planes.
  Double3 point_on_cell(nif::Random& random) const {
    const Cell& cell = cells_[random.below(uint32_t(cells_.size()))];
    const uint32_t snapped = 1 + random.below(7);
    Double3 at;
    for (size_t a = 0; a < 3; ++a)
      at[a] = cell.low[a] + cell.size * (snapped >> a & 1 ? double(random.below(2)) : random.uniform());
    return from_grid(at);
  }

  /// This many finest cells beyond one of a cell's planes.
  Double3 point_at_plane(nif::Random& random, double beyond) const {
    const Cell& cell = cells_[random.below(uint32_t(cells_.size()))];
    const Double3 n = normal_of(cell.word);
    Double3 at;
    for (double& x : at) x = random.uniform(-0.5, 0.5) * cell.size;
    const bool up = random.below(2) != 0;
    const uint32_t place = up ? kernels::upper_offset(cell.word) : kernels::lower_offset(cell.word);
    const double height = kernels::plane_height(place, float(cell.size));
    at = at + n * ((height - dot(n, at)) / dot(n, n) + (up ? beyond : -beyond) / length(n));
    for (size_t a = 0; a < 3; ++a) at[a] += cell.low[a] + 0.5 * cell.size;
    return from_grid(at);
  }

  Double3 point_on_surface(nif::Random& random, Double3& normal) const {
    const mesh::CleanMesh& surface = o_.prepared.surface;
    const mesh::Triangle& t = surface.triangles[random.below(uint32_t(surface.triangles.size()))];
    const Double3 p0 = to_double(surface.positions[t[0]]), p1 = to_double(surface.positions[t[1]]),
                  p2 = to_double(surface.positions[t[2]]);
    normal = cross(p1 - p0, p2 - p0);
    const double area = length(normal);
    normal = area > 0 ? normal * (1 / area) : normal;
    switch (random.below(4)) {
      case 0:
        return p0;  // a vertex
      case 1:
        return p0 + (p1 - p0) * random.uniform();  // an edge
      default: {
        const double u = random.uniform(), v = random.uniform() * (1 - u);
        return p0 + (p1 - p0) * u + (p2 - p0) * v;
      }
    }
  }

  const OccupiedObject& o_;
  std::vector<Cell> cells_;  // with planes
};

}  // namespace nif::test
