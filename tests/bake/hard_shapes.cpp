// One function per difficulty: cracks, doubled sheets, faces close to cell planes, pockets, slivers, soup.
// Random numbers come from fixed seeds, so a failure can be reproduced.
#include "tests/bake/hard_shapes.hpp"

#include "bake/planes/voxelize.hpp"
#include "formats/base/vector.hpp"
#include "tests/support/test_shapes.hpp"

namespace nif::test {
namespace {

/// Typical defects: a ball with holes, one with a fin on an edge, one with randomly oriented triangles, two
/// that intersect, a doubled one, and a sheet that cuts through all of them.
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

/// Balls whose triangles are disconnected, nearly connected, or have vertices on edges of their neighbours.
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
      // Cut in two through the middle of one side, but the neighbour is not.
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

/// Coincident surfaces: open sheets that face both ways, connected or not, a two-layer ball, and one with a
/// two-layer fin.
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

/// Sheets just above, below or on planes between cells, with ends as close to other planes.
mesh::Mesh sheets_near_faces(uint32_t resolution, uint32_t levels) {
  mesh::Mesh mesh;
  // The box, and thus the grid, is known before the sheets.
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

/// Balls of a few voxels, each with a hole, so that only about one inner voxel is empty.
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

/// A ball and a cube with some edges closed by triangles of zero or almost zero area.
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

}  // namespace

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

}  // namespace nif::test
