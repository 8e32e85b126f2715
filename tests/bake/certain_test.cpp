// No certain answer is ever wrong: random and adversarial segments on generated and on real meshes, against
// Embree.
#include <gtest/gtest.h>
#include <tbb/parallel_for.h>

#include <atomic>
#include <limits>

#include "formats/base/vector.hpp"
#include "formats/mesh/read.hpp"
#include "kernels/reference/segment/walk.hpp"
#include "tests/bake/exact.hpp"
#include "tests/support/occupied_object.hpp"
#include "tests/support/real_meshes.hpp"
#include "tests/support/shapes.hpp"

namespace nif::test {
namespace {

using kernels::Segment;

Double3 random_point(const mesh::Box& box, nif::Random& random, double margin) {
  Double3 point;
  for (int a = 0; a < 3; ++a) {
    const double size = double(box.max[a]) - box.min[a];
    point[a] = random.uniform(box.min[a] - margin * size, box.max[a] + margin * size);
  }
  return point;
}

/// A number between `low` and `high`, of either sign, as often near one power of two as near another.
double random_size(nif::Random& random, double low, double high) {
  const double size = low * std::pow(high / low, random.uniform());
  return random.below(2) ? size : -size;
}

/// Draws segments as hard to answer as we know how to make them.
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
        if (random.below(2)) tmin = 0, tmax = 1;  // it ends there
        break;
      case 2:  // along an axis
        direction = {};
        direction[random.below(3)] = random.below(2) ? 1 : -1;
        break;
      case 3:  // within a plane between voxels
        direction[random.below(3)] = 0;
        break;
      case 4:  // nearly so
        direction[random.below(3)] *= random_size(random, 1e-6, 0.1);
        break;
      default: {  // along a stored plane, nearly
        const Double3 n = normal_of(cells_[random.below(uint32_t(cells_.size()))].word);
        direction = cross(n, direction);
        direction = direction * (1 / length(direction)) + n * (random_size(random, 1e-7, 0.1) / length(n));
        break;
      }
    }
    // Some start as far away as answers may be certain.
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
      add_cells(o_.field.parts[kernels::link_part(word, part)], at, size / 2);
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

  /// How far back a segment may start so that answers can be certain.
  double draw_way_back(const Double3& direction, nif::Random& random) const {
    const double steepest =
        std::max({std::abs(direction[0]), std::abs(direction[1]), std::abs(direction[2])});
    return random.uniform(0.5, 1.0) * kernels::kCertainReach / double(o_.field.cells_per_unit) / steepest;
  }

  /// Of all triangles that are missed or met, those at whose edge rounding decides which cells are visited:
  /// past an edge or a vertex, from where rounding is worst.
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
        return random_point(box, random, 0.0);  // anywhere, the inside of solids included
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
      case 7: {  // the bias or so away from a triangle, where renderers start rays
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

  /// A corner, an edge's or a face's point of a random voxel: where the walk has to decide between
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

  /// The same of a cell that has planes.
  Double3 point_on_cell(nif::Random& random) const {
    const Cell& cell = cells_[random.below(uint32_t(cells_.size()))];
    const uint32_t snapped = 1 + random.below(7);
    Double3 at;
    for (size_t a = 0; a < 3; ++a)
      at[a] = cell.low[a] + cell.size * (snapped >> a & 1 ? double(random.below(2)) : random.uniform());
    return from_grid(at);
  }

  /// So many finest cells beyond one of a cell's planes.
  Double3 point_at_plane(nif::Random& random, double beyond) const {
    const Cell& cell = cells_[random.below(uint32_t(cells_.size()))];
    const Double3 n = normal_of(cell.word);
    Double3 at;
    for (double& x : at) x = random.uniform(-0.5, 0.5) * cell.size;
    const bool up = random.below(2) != 0;
    const uint32_t place = up ? kernels::upper_place(cell.word) : kernels::lower_place(cell.word);
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

struct Counts {
  uint64_t certain_visible = 0, certain_occluded = 0, embree_misses = 0;
  std::vector<Segment> doubtful;  // Embree disagrees
  std::vector<Segment> wrongly;   // and so do exact predicates

  void expect_none_wrong() const {
    for (const Segment& s : wrongly)
      ADD_FAILURE() << "a certain answer is wrong: origin " << s.origin[0] << ' ' << s.origin[1] << ' '
                    << s.origin[2] << ", direction " << s.direction[0] << ' ' << s.direction[1] << ' '
                    << s.direction[2] << ", t " << s.tmin << ".." << s.tmax;
  }
};

Counts count_certain(const OccupiedObject& o, uint64_t segments) {
  constexpr uint64_t kBlock = 10'000;
  const Adversary adversary(o);
  std::vector<Counts> parts(segments / kBlock);
  tbb::parallel_for(uint64_t{0}, uint64_t(parts.size()), [&](uint64_t b) {
    nif::Random random(17, 4, b);
    kernels::Walk walk;
    for (uint64_t i = 0; i < kBlock; ++i) {
      const Segment s = adversary.draw(random);
      kernels::walk_segment(o.field, s, walk);
      if (!walk.certain) continue;
      const bool visible = walk.verdict == kernels::Verdict::visible;
      (visible ? parts[b].certain_visible : parts[b].certain_occluded) += 1;
      if (o.truth->source().oracle.occluded(s) == visible) parts[b].doubtful.push_back(s);
    }
  });
  Counts all;
  for (Counts& part : parts) {
    all.certain_visible += part.certain_visible;
    all.certain_occluded += part.certain_occluded;
    all.doubtful.insert(all.doubtful.end(), part.doubtful.begin(), part.doubtful.end());
  }
  if (all.doubtful.empty()) return all;
  const ExactOracle exact(o.prepared.surface.positions, o.prepared.surface.triangles);
  for (const Segment& s : all.doubtful) {
    kernels::Walk walk;
    kernels::walk_segment(o.field, s, walk);
    const bool visible = walk.verdict == kernels::Verdict::visible;
    const double reach = length(to_double(std::to_array(s.origin)) - to_double(o.prepared.box.min)) +
                         2 * o.prepared.box.diagonal();
    if (exact.occluded(s, reach) != visible)
      ++all.embree_misses;
    else
      all.wrongly.push_back(s);
  }
  return all;
}

/// What scanners and artists leave: a ball with holes, one with a fin on an edge, one whose triangles face as
/// they like, one that another passes through, doubled, and a sheet that cuts through all of them.
mesh::Mesh broken_mesh() {
  mesh::Mesh mesh;
  mesh::Mesh holes = icosphere(3);
  nif::Random random(5, 6, 7);
  std::erase_if(holes.triangles, [&](const mesh::Triangle&) { return random.below(40) == 0; });
  append(mesh, holes);
  mesh::Mesh fin = icosphere(3);
  fin.positions.push_back({0, 0, 1.5f});
  fin.triangles.push_back({fin.triangles[0][0], fin.triangles[0][1], uint32_t(fin.positions.size() - 1)});
  append(mesh, fin, 1, {2.5f, 0, 0});
  mesh::Mesh turned = icosphere(3);
  for (mesh::Triangle& t : turned.triangles)
    if (random.below(2)) std::swap(t[0], t[1]);
  append(mesh, turned, 1, {5, 0, 0});
  append(mesh, torus(40, 20), 1, {5.5f, 0, 0.3f});
  append(mesh, torus(40, 20), 1, {5.5f, 0, 0.3f}, true);
  append(mesh, icosphere(2), 0.5f, {5.2f, 0, 0});
  const auto base = uint32_t(mesh.positions.size());
  mesh.positions.insert(mesh.positions.end(), {{-2, -0.3f, 0.1f}, {8, -0.3f, 0.1f}, {3, 4, 0.4f}});
  mesh.triangles.push_back({base, base + 1, base + 2});
  return mesh;
}

/// Balls whose triangles are not joined, or nearly so, or that have vertices on edges of their neighbours.
mesh::Mesh cracked_mesh() {
  mesh::Mesh mesh;
  nif::Random random(5, 6, 8);
  for (int ball = 0; ball < 4; ++ball) {
    const double most = ball == 0 ? 1e-7 : ball == 1 ? 1e-4 : 1e-2;
    mesh::Mesh cracked;
    const mesh::Mesh whole = icosphere(3);
    for (const mesh::Triangle& t : whole.triangles) {
      const auto base = uint32_t(cracked.positions.size());
      cracked.triangles.push_back({base, base + 1, base + 2});
      for (const uint32_t v : t) {
        mesh::Float3& p = cracked.positions.emplace_back(whole.positions[v]);
        // Most stay where they are, so that they are welded.
        if (ball < 3 && random.below(3) == 0) p[random.below(3)] += float(random.uniform(-most, most));
      }
      if (ball < 3) continue;
      // Cut in two through the middle of one side, of which the neighbour does not know.
      mesh::Float3 middle;
      for (size_t a = 0; a < 3; ++a)
        middle[a] = (cracked.positions[base][a] + cracked.positions[base + 1][a]) / 2;
      cracked.positions.push_back(middle);
      cracked.triangles.back() = {base, base + 3, base + 2};
      cracked.triangles.push_back({base + 3, base + 1, base + 2});
    }
    append(mesh, cracked, 1, {2.2f * float(ball), 0, 0});
  }
  return mesh;
}

/// A sheet of size x size squares, bent a little, over the square from 0 to 1.
mesh::Mesh bent_sheet(uint32_t size) {
  mesh::Mesh sheet;
  for (uint32_t y = 0; y <= size; ++y)
    for (uint32_t x = 0; x <= size; ++x) {
      const float u = float(x) / float(size), v = float(y) / float(size);
      sheet.positions.push_back({u, v, 0.1f * u * u + 0.07f * v});
    }
  const auto at = [&](uint32_t x, uint32_t y) { return x + (size + 1) * y; };
  for (uint32_t y = 0; y < size; ++y)
    for (uint32_t x = 0; x < size; ++x) {
      sheet.triangles.push_back({at(x, y), at(x + 1, y), at(x + 1, y + 1)});
      sheet.triangles.push_back({at(x, y), at(x + 1, y + 1), at(x, y + 1)});
    }
  return sheet;
}

/// What lies on itself: open sheets that face both ways, joined and not, a ball of two layers, and one with a
/// fin of two.
mesh::Mesh doubled_mesh() {
  mesh::Mesh mesh = bent_sheet(9);
  const auto double_all = [](mesh::Mesh& one) {
    const auto once = one.triangles;
    for (const mesh::Triangle& t : once) one.triangles.push_back({t[0], t[2], t[1]});
  };
  double_all(mesh);
  append(mesh, bent_sheet(5), 0.83f, {1.3f, 0.02f, 0});
  append(mesh, bent_sheet(5), 0.83f, {1.3f, 0.02f, 0.0005f}, true);
  mesh::Mesh ball = icosphere(2);
  double_all(ball);
  append(mesh, ball, 0.4f, {0.5f, 0.5f, 0.7f});
  mesh::Mesh finned = icosphere(2);
  const auto tip = uint32_t(finned.positions.size());
  finned.positions.push_back({0, 0, 1.7f});
  for (int i = 0; i < 3; ++i) {
    const mesh::Triangle t = finned.triangles[size_t(i) * 7];
    finned.triangles.push_back({t[0], t[1], tip});
    finned.triangles.push_back({t[1], t[0], tip});
  }
  append(mesh, finned, 0.4f, {1.6f, 0.5f, 0.7f});
  return mesh;
}

/// Sheets close to the planes between cells, above, below and on them, that end as close to others.
mesh::Mesh sheets_near_faces(uint32_t resolution, uint32_t levels) {
  mesh::Mesh mesh;
  // The box, and so the grid, is known before the sheets are.
  mesh.positions = {{0, 0, 0}, {0.01f, 0, 0}, {0, 0.01f, 0}, {1, 1, 1}, {0.99f, 1, 1}, {1, 0.99f, 1}};
  mesh.triangles = {{0, 1, 2}, {3, 4, 5}};
  const bake::Grid grid = bake::make_grid(mesh::bounds(mesh.positions, mesh.triangles), resolution, levels);
  nif::Random random(5, 6, 9);
  const double cells = double(resolution << levels);
  const auto place = [&](double cell, size_t axis) {
    const double at = cell + (random.below(4) ? random_size(random, 1e-4, 1e-2) : 0);
    return float(grid.origin[axis] + at / grid.voxels_per_unit / grid.cells());
  };
  for (int i = 0; i < 150; ++i) {
    const size_t axis = random.below(3), b = (axis + 1) % 3, c = (axis + 2) % 3;
    double low[3], high[3];
    for (size_t a = 0; a < 3; ++a) {
      low[a] = 2 + random.below(uint32_t(cells) - 12);
      const uint32_t most = i % 4 == 0 ? uint32_t(cells) / 2 : i % 4 == 1 ? 8 : 2;
      high[a] = std::min(low[a] + 1 + random.below(most), cells - 2);  // within the box
    }
    const auto base = uint32_t(mesh.positions.size());
    const float level = place(low[axis], axis), b0 = place(low[b], b), b1 = place(high[b], b),
                c0 = place(low[c], c), c1 = place(high[c], c);
    for (uint32_t corner = 0; corner < 4; ++corner) {
      mesh::Float3& p = mesh.positions.emplace_back();
      p[axis] = level;
      p[b] = corner & 1 ? b1 : b0;
      p[c] = corner & 2 ? c1 : c0;
    }
    mesh.triangles.push_back({base, base + 1, base + 3});
    mesh.triangles.push_back({base, base + 3, base + 2});
  }
  return mesh;
}

/// Balls of a few voxels with a hole each, so that hardly more than one voxel within is empty.
mesh::Mesh pockets() {
  mesh::Mesh mesh;
  nif::Random random(5, 6, 10);
  for (int i = 0; i < 60; ++i) {
    mesh::Mesh pocket = random.below(2) ? icosphere(1) : cube();
    if (i % 8 != 0) pocket.triangles.erase(pocket.triangles.begin() + random.below(12));
    mesh::Float3 at;
    for (float& x : at) x = float(random.uniform(0, 10));
    append(mesh, pocket, float(random.uniform(0.25, 0.6)), at, random.below(2) != 0);
  }
  return mesh;
}

/// A ball and a cube some of whose edges are closed by triangles without area, or nearly without.
mesh::Mesh slivers() {
  mesh::Mesh mesh;
  nif::Random random(5, 6, 11);
  for (mesh::Mesh one : {cube(), icosphere(2)}) {
    const size_t whole = one.triangles.size();
    for (size_t i = 0; i < whole; i += 1 + random.below(3)) {
      const mesh::Triangle t = one.triangles[i];
      const auto middle = uint32_t(one.positions.size());
      mesh::Float3& p = one.positions.emplace_back();
      const float share = float(1 + random.below(7)) / 8;
      for (size_t a = 0; a < 3; ++a)
        p[a] = one.positions[t[0]][a] + (one.positions[t[1]][a] - one.positions[t[0]][a]) * share;
      one.triangles[i] = {t[0], middle, t[2]};
      one.triangles.push_back({middle, t[1], t[2]});
      if (random.below(8)) one.triangles.push_back({t[0], t[1], middle});
    }
    append(mesh, one, 1, {2.5f * float(mesh.positions.size() != 0), 0, 0});
  }
  return mesh;
}

mesh::Mesh soup() {
  mesh::Mesh mesh;
  nif::Random random(5, 6, 12);
  for (uint32_t i = 0; i < 300; ++i) {
    const Double3 at{random.uniform(), random.uniform(), random.uniform()};
    const double size = std::abs(random_size(random, 0.003, 0.6));
    for (int corner = 0; corner < 3; ++corner) {
      const Double3 p = at + random.direction() * size;
      mesh.positions.push_back({float(p[0]), float(p[1]), float(p[2])});
    }
    mesh.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
  }
  return mesh;
}

enum Shape {
  kSphere,
  kTorus,
  kNested,
  kCube,
  kBowl,
  kFar,
  kBroken,
  kCracked,
  kDoubled,
  kNearFaces,
  kPockets,
  kSlivers,
  kSoup,
  kShapes
};

uint32_t resolution_of(Shape shape, uint32_t levels) {
  const auto number = uint32_t(shape);
  return levels == 0 ? 48 + number * 4 : levels == 2 ? 24 + 2 * number : 9 + number;
}

mesh::Mesh make_shape(Shape shape, uint32_t levels) {
  mesh::Mesh mesh;
  switch (shape) {
    case kSphere:
      mesh = icosphere(4);
      break;
    case kTorus:
      mesh = torus(80, 40);
      break;
    case kNested:
      mesh = nested_spheres(3);
      break;
    case kCube:
      mesh = cube();
      break;
    case kBowl:
      mesh = open_bowl(20, 40);
      break;
    case kFar:  // far from the origin, and of two sizes that float coordinates barely resolve
      append(mesh, icosphere(3), 1, {5000, -7000, 300});
      append(mesh, cube(), 0.01f, {5001, -7001, 301.5f});
      break;
    case kBroken:
      mesh = broken_mesh();
      break;
    case kCracked:
      mesh = cracked_mesh();
      break;
    case kDoubled:
      mesh = doubled_mesh();
      break;
    case kNearFaces:
      mesh = sheets_near_faces(resolution_of(shape, levels), levels);
      break;
    case kPockets:
      mesh = pockets();
      break;
    case kSlivers:
      mesh = slivers();
      break;
    default:
      mesh = soup();
      break;
  }
  mesh.name = "shape";
  return mesh;
}

constexpr uint64_t kSegments = 10'000'000;

/// Of each generated mesh and number of cuts so many segments, and so many of those that take long.
constexpr uint64_t kFewSegments = 200'000, kManySegments = 5'000'000;

class CertainOnShapes : public testing::TestWithParam<std::tuple<int, uint32_t>> {
 protected:
  static void expect_none_wrong(uint64_t segments) {
    const auto [number, levels] = GetParam();
    const auto shape = Shape(number);
    const OccupiedObject o(make_shape(shape, levels), resolution_of(shape, levels), {.levels = levels});
    const Counts counts = count_certain(o, segments);
    counts.expect_none_wrong();
    EXPECT_GT(counts.certain_visible, segments / 20);
    EXPECT_GT(counts.certain_occluded, segments / (shape == kNearFaces ? 2000 : 200));
    EXPECT_LT(counts.embree_misses,
              segments / 1000);  // more would mean that the walk is at fault, not Embree
  }
};

TEST_P(CertainOnShapes, IsNeverWrong) { expect_none_wrong(kFewSegments); }
TEST_P(CertainOnShapes, IsNeverWrongOnMillions) { expect_none_wrong(kManySegments); }

INSTANTIATE_TEST_SUITE_P(Generated, CertainOnShapes,
                         testing::Combine(testing::Range(0, int(kShapes)), testing::Values(0u, 2u, 4u)));

struct Mutation {
  const char* name;
  bool bake::CellFlaws::*flaw;
  Shape shape;
  uint32_t levels;
};

class CertainOnFlaws : public testing::TestWithParam<Mutation> {};

/// Segments are hard enough for these tests to see what they are for.
TEST_P(CertainOnFlaws, AreNoticed) {
  const Mutation& mutation = GetParam();
  CellOptions options{.levels = mutation.levels};
  options.flaws.*mutation.flaw = true;
  const OccupiedObject o(make_shape(mutation.shape, mutation.levels),
                         resolution_of(mutation.shape, mutation.levels), options);
  EXPECT_GT(count_certain(o, kFewSegments).wrongly.size(), 0u);
}

INSTANTIATE_TEST_SUITE_P(
    Cells, CertainOnFlaws,
    testing::Values(Mutation{"no_padding", &bake::CellFlaws::no_padding, kNearFaces, 2},
                    Mutation{"walls_everywhere", &bake::CellFlaws::walls_everywhere, kSoup, 2},
                    Mutation{"narrow_planes", &bake::CellFlaws::narrow_planes, kBowl, 2},
                    Mutation{"pockets_inside", &bake::CellFlaws::pockets_inside, kNearFaces, 0},
                    Mutation{"doubles_counted", &bake::CellFlaws::doubles_counted, kDoubled, 2}),
    [](const auto& mutation) { return std::string(mutation.param.name); });

TEST(CertainOnRealMeshes, IsNeverWrongOnTenMillionSegmentsEach) {
  if (!real_mesh_folder()) GTEST_SKIP() << "NIF_TEST_MESHES is not set";
  for (const std::filesystem::path& file : real_meshes()) {
    SCOPED_TRACE(file.filename().string());
    const mesh::Scene scene = mesh::read(file);
    // The largest object of a file stands for the others.
    const auto largest = std::max_element(
        scene.meshes.begin(), scene.meshes.end(),
        [](const auto& a, const auto& b) { return a.triangles.size() < b.triangles.size(); });
    const OccupiedObject o(*largest, 64, {.levels = 2});
    const Counts counts = count_certain(o, kSegments);
    counts.expect_none_wrong();
    std::printf(
        "%-45s %4.1f %% certainly visible, %4.1f %% certainly occluded, %d wrong; %d missed by Embree\n",
        file.filename().c_str(), 100.0 * double(counts.certain_visible) / double(kSegments),
        100.0 * double(counts.certain_occluded) / double(kSegments), int(counts.wrongly.size()),
        int(counts.embree_misses));
    EXPECT_LT(counts.embree_misses, kSegments / 10'000);  // more would mean that the walk is at fault
  }
}

/// Shares of docs/results/planes.md, roughly.
TEST(CertainOnTheDragon, AnswersNearlyAllOfTheNamedSets) {
  const auto folder = real_mesh_folder();
  if (!folder) GTEST_SKIP() << "NIF_TEST_MESHES is not set";
  const mesh::Scene scene = mesh::read(*folder / "stanford_dragon_871k.ply.gz");
  const OccupiedObject o(scene.meshes[0], 64, {.levels = 2});
  EXPECT_GT(double(o.cells.walls), 0.95 * double(o.cells.planes));
  EXPECT_LT(o.data.voxel_records.size() + o.data.parts.size(), 65'000u);
  for (const auto& [set, least] :
       {std::pair(bake::RaySet::outer_lines, 0.99), std::pair(bake::RaySet::inner_surface, 0.95),
        std::pair(bake::RaySet::segments, 0.97)}) {
    const bake::LabelledRays rays = bake::make_ray_set(o.truth->source(), set, kSegments / 5, 5);
    std::atomic<uint64_t> certain{0}, wrong{0};
    tbb::parallel_for(tbb::blocked_range<size_t>(0, rays.segments.size(), 10'000), [&](const auto& range) {
      kernels::Walk walk;
      for (size_t i = range.begin(); i < range.end(); ++i) {
        kernels::walk_segment(o.field, rays.segments[i], walk);
        if (!walk.certain) continue;
        ++certain;
        wrong += (walk.verdict == kernels::Verdict::visible) != (rays.visible[i] != 0);
      }
    });
    EXPECT_EQ(wrong, 0u) << bake::name_of(set);
    EXPECT_GE(double(certain), least * double(rays.segments.size())) << bake::name_of(set);
  }
}

}  // namespace
}  // namespace nif::test
