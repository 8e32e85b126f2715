// Tessellates boxes, tubes, walls and slabs. Each part is closed and shares no vertex with another, so parts
// may simply overlap.
#include "mesh/generate/assembly.hpp"

#include "mesh/generate/axes.hpp"
#include "mesh/generate/computed.hpp"
#include "mesh/generate/slab.hpp"
#include "mesh/generate/tube.hpp"
#include "mesh/generate/turn.hpp"

namespace nif::generate {

double Wall::length_of(size_t side) const {
  const Ground &a = corners[side], &b = corners[(side + 1) % corners.size()];
  return length(Double3{b.x - a.x, 0, b.z - a.z});
}

Double3 Wall::along(size_t side) const {
  const Ground &a = corners[side], &b = corners[(side + 1) % corners.size()];
  return unit(Double3{b.x - a.x, 0, b.z - a.z});
}

Double3 Wall::outwards(size_t side) const { return cross(along(side), Double3{0, 1, 0}); }

Double3 Wall::at(size_t side, double way, double height, double out) const {
  return Double3{corners[side].x, height, corners[side].z} + along(side) * way + outwards(side) * out;
}

uint32_t Assembly::vertex(const Double3& p) {
  mesh_.positions.push_back(to_float(p));
  return uint32_t(mesh_.positions.size() - 1);
}

void Assembly::quad(uint32_t a, uint32_t b, uint32_t c, uint32_t d) {
  mesh_.triangles.push_back({a, b, c});
  mesh_.triangles.push_back({a, c, d});
}

void Assembly::block(const Double3& low, const Double3& high) {
  const Double3 half = (high - low) * 0.5;
  box((low + high) * 0.5, {half[0], 0, 0}, {0, half[1], 0}, {0, 0, half[2]});
}

void Assembly::box(const Double3& centre, const Double3& x, const Double3& y, const Double3& z) {
  uint32_t corner[8];
  for (uint32_t c = 0; c < 8; ++c)
    corner[c] = vertex(centre + x * (c & 1 ? 1 : -1) + y * (c & 2 ? 1 : -1) + z * (c & 4 ? 1 : -1));
  quad(corner[0], corner[4], corner[6], corner[2]);
  quad(corner[1], corner[3], corner[7], corner[5]);
  quad(corner[0], corner[1], corner[5], corner[4]);
  quad(corner[2], corner[6], corner[7], corner[3]);
  quad(corner[0], corner[2], corner[3], corner[1]);
  quad(corner[4], corner[5], corner[7], corner[6]);
}

void Assembly::beam(const Double3& from, const Double3& to, const Double3& up, double width, double height) {
  const Double3 along = unit(to - from), aside = unit(cross(up, along)), above = cross(along, aside);
  box((from + to) * 0.5, aside * (width / 2), above * (height / 2), (to - from) * 0.5);
}

void Assembly::tube(uint64_t sides, uint64_t rings, const Double3& first, const Double3& last,
                    const std::function<Double3(uint64_t, double)>& at) {
  const Tube tube{sides, rings};
  const uint64_t base = mesh_.positions.size();
  vertex(first);
  for (uint64_t i = 0; i < rings; ++i)
    for (uint64_t j = 0; j < sides; ++j) vertex(at(i, double(j) / double(sides)));
  vertex(last);
  for (uint64_t t = 0; t < tube.triangle_count(); ++t) mesh_.triangles.push_back(tube.triangle(t, base));
}

void Assembly::rod(const std::function<Double3(double)>& curve, double radius, uint64_t sides,
                   uint64_t rings) {
  const auto way = [&](double t) {
    constexpr double kStep = 1e-3;
    return unit(curve(t + kStep) - curve(t - kStep));
  };
  // Carried from ring to ring, so that the bar is not twisted.
  Double3 aside = perpendicular(way(0));
  std::vector<Double3> x;
  for (uint64_t i = 0; i < rings; ++i) {
    const Double3 along = way(double(i) / double(rings - 1));
    x.push_back(aside = unit(aside - along * dot(aside, along)));
  }
  tube(sides, rings, curve(0) - way(0) * (0.3 * radius), curve(1) + way(1) * (0.3 * radius),
       [&](uint64_t i, double turns) {
         const double t = double(i) / double(rings - 1);
         const Turn about = turn(turns);
         return curve(t) + (x[i] * about.cos + cross(way(t), x[i]) * about.sin) * radius;
       });
}

void Assembly::lathe(const Double3& foot, const std::vector<Turned>& profile, uint64_t sides) {
  const auto on_axis = [&](const Turned& end) { return foot + Double3{0, end.height, 0}; };
  tube(sides, profile.size(), on_axis(profile.front()), on_axis(profile.back()),
       [&](uint64_t ring, double turns) {
         const Turn about = turn(turns);
         const auto& [radius, height] = profile[ring];
         return foot + Double3{radius * about.cos, height, -radius * about.sin};
       });
}

void Assembly::ring(const Ring& ring, const RingGrid& grid) {
  const auto base = uint32_t(mesh_.positions.size());
  for (uint64_t i = 0; i < grid.vertex_count(); ++i) vertex(ring.vertex(grid, i));
  for (uint64_t i = 0; i < grid.triangle_count(); ++i) {
    const auto [a, b, c] = grid.triangle(i);
    mesh_.triangles.push_back({base + a, base + b, base + c});
  }
}

void Assembly::wall(const Wall& wall, double peak) {
  struct Column {
    size_t side, number;
  };
  std::vector<Column> columns;
  const auto base = uint32_t(mesh_.positions.size());
  Double3 mean{};
  for (const double height : wall.heights)
    for (size_t side = 0; side < wall.corners.size(); ++side) {
      vertex(wall.at(side, 0, height));
      for (const double line : wall.lines[side]) vertex(wall.at(side, line, height));
    }
  for (size_t side = 0; side < wall.corners.size(); ++side) {
    mean = mean + Double3{wall.corners[side].x, 0, wall.corners[side].z} * (1 / double(wall.corners.size()));
    for (size_t c = 0; c <= wall.lines[side].size(); ++c) columns.push_back({side, c});
  }

  const auto around = uint32_t(columns.size());
  const auto at = [&](size_t row, size_t k) { return uint32_t(base + row * around + k % around); };
  for (size_t row = 0; row + 1 < wall.heights.size(); ++row)
    for (size_t k = 0; k < around; ++k) {
      const uint32_t outer[4] = {at(row, k), at(row, k + 1), at(row + 1, k + 1), at(row + 1, k)};
      const double depth = wall.depth ? wall.depth(columns[k].side, columns[k].number, row) : 0;
      if (depth == 0) {
        quad(outer[0], outer[1], outer[2], outer[3]);
        continue;
      }
      const mesh::Float3 inwards = to_float(wall.outwards(columns[k].side) * -depth);
      uint32_t inner[4];
      for (size_t c = 0; c < 4; ++c) {
        mesh::Float3 p = mesh_.positions[outer[c]];
        for (size_t a = 0; a < 3; ++a) p[a] += inwards[a];
        mesh_.positions.push_back(p);
        inner[c] = uint32_t(mesh_.positions.size() - 1);
      }
      quad(inner[0], inner[1], inner[2], inner[3]);
      for (size_t c = 0; c < 4; ++c) quad(outer[c], outer[(c + 1) % 4], inner[(c + 1) % 4], inner[c]);
    }

  const size_t top = wall.heights.size() - 1;
  const uint32_t floor = vertex({mean[0], wall.heights.front(), mean[2]}),
                 ceiling = vertex({mean[0], wall.heights.back() + peak, mean[2]});
  for (size_t k = 0; k < around; ++k) {
    mesh_.triangles.push_back({floor, at(0, k + 1), at(0, k)});
    mesh_.triangles.push_back({ceiling, at(top, k), at(top, k + 1)});
  }
}

void Assembly::slab(const Ground& low, const Ground& high, uint64_t nx, uint64_t nz, double bottom,
                    const std::function<double(double, double)>& height) {
  const Slab slab{nx, nz};
  const auto base = uint32_t(mesh_.positions.size());
  const auto flat = [&](const Slab::Point& p) {
    return Ground{low.x + (high.x - low.x) * double(p.i) / double(nx),
                  low.z + (high.z - low.z) * double(p.k) / double(nz)};
  };
  for (uint64_t v = 0; v < slab.top_vertices(); ++v) {
    const Ground p = flat(slab.top_point(v));
    vertex({p.x, height(p.x, p.z), p.z});
  }
  for (uint64_t v = 0; v < slab.border(); ++v) {
    const Ground p = flat(slab.border_point(v));
    vertex({p.x, bottom, p.z});
  }
  vertex({(low.x + high.x) / 2, bottom, (low.z + high.z) / 2});
  for (uint64_t t = 0; t < slab.triangle_count(); ++t) {
    const auto [a, b, c] = slab.triangle(t);
    mesh_.triangles.push_back({base + a, base + b, base + c});
  }
}

void Assembly::add(const mesh::MeshSource& source, double scale, const Double3& move) {
  const auto base = uint32_t(mesh_.positions.size());
  std::vector<mesh::Float3> positions(source.vertex_count());
  std::vector<mesh::Triangle> triangles(source.triangle_count());
  source.vertices(0, positions);
  source.triangles(0, triangles);
  for (const mesh::Float3& p : positions) vertex(to_double(p) * scale + move);
  for (const auto& [a, b, c] : triangles) mesh_.triangles.push_back({base + a, base + b, base + c});
}

void Assembly::change(const std::function<Double3(const Double3&)>& moved) {
  for (mesh::Float3& p : mesh_.positions) p = to_float(moved(to_double(p)));
}

mesh::Mesh Assembly::take(std::string name) {
  mesh_.name = std::move(name);
  return std::move(mesh_);
}

}  // namespace nif::generate
