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

/// A corner, an edge's or a face's point of a random voxel: where the walk has to decide between neighbours.
Double3 point_on_voxel(const bake::Grid& grid, nif::Random& random) {
  const uint32_t snapped = 1 + random.below(7);  // at least one axis lies on a plane between voxels
  Double3 point;
  for (int a = 0; a < 3; ++a) {
    double at = random.uniform() * grid.voxels[a];
    if (snapped >> a & 1) at = std::floor(at);
    point[a] = grid.origin[a] + at / grid.voxels_per_unit;
  }
  return point;
}

Double3 point_on_surface(const mesh::CleanMesh& surface, nif::Random& random) {
  const mesh::Triangle& t = surface.triangles[random.below(uint32_t(surface.triangles.size()))];
  const Double3 p0 = to_double(surface.positions[t[0]]), p1 = to_double(surface.positions[t[1]]),
                p2 = to_double(surface.positions[t[2]]);
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

Segment random_segment(const OccupiedObject& o, nif::Random& random) {
  const mesh::Box& box = o.prepared.box;
  auto point = [&](uint32_t kind) {
    switch (kind) {
      case 0:
        return random_point(box, random, 0.0);  // anywhere, the inside of solids included
      case 1:
        return random_point(box, random, 1.0);
      case 2:
        return random_point(box, random, 20.0);  // far
      case 3:
        return point_on_voxel(o.occupancy.grid, random);
      default:
        return point_on_surface(o.prepared.surface, random);
    }
  };
  const Double3 from = point(random.below(5));
  Double3 direction;
  switch (random.below(4)) {
    case 0:
      direction = random.direction();
      break;
    case 1:
      direction = point(random.below(5)) - from;
      break;  // tmax = 1 ends there
    case 2:   // along an axis
      direction = {};
      direction[random.below(3)] = random.below(2) ? 1 : -1;
      break;
    default:  // within a plane between voxels
      direction = random.direction();
      direction[random.below(3)] = 0;
      break;
  }
  Segment s{{}, {}, 0, kInfinity};
  for (int a = 0; a < 3; ++a) {
    s.origin[a] = float(from[a]);
    s.direction[a] = float(direction[a]);
  }
  switch (random.below(4)) {
    case 0:
      s.tmax = 1;
      break;
    case 1:
      s.tmax = float(random.uniform() * box.diagonal());
      break;
    case 2:
      s.tmin = float(random.uniform() * box.diagonal());
      break;
    default:
      break;
  }
  return s;
}

struct Counts {
  uint64_t certain_visible = 0, certain_occluded = 0, embree_misses = 0, wrong = 0;
  std::vector<Segment> doubtful;  // Embree disagrees
};

Counts count_certain(const OccupiedObject& o, uint64_t segments) {
  constexpr uint64_t kBlock = 10'000;
  std::vector<Counts> parts(segments / kBlock);
  tbb::parallel_for(uint64_t{0}, uint64_t(parts.size()), [&](uint64_t b) {
    nif::Random random(17, 4, b);
    kernels::Walk walk;
    for (uint64_t i = 0; i < kBlock; ++i) {
      const Segment s = random_segment(o, random);
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
    if (exact.occluded(s, 100 * o.prepared.box.diagonal()) != visible) {
      ++all.embree_misses;
      continue;
    }
    ++all.wrong;
    ADD_FAILURE() << "certainly " << (visible ? "visible" : "occluded") << ", says the walk: origin "
                  << s.origin[0] << ' ' << s.origin[1] << ' ' << s.origin[2] << ", direction "
                  << s.direction[0] << ' ' << s.direction[1] << ' ' << s.direction[2] << ", t " << s.tmin
                  << ".." << s.tmax;
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

constexpr uint64_t kSegments = 10'000'000;

class CertainOnShapes : public testing::TestWithParam<int> {};

TEST_P(CertainOnShapes, IsNeverWrong) {
  mesh::Mesh mesh;
  switch (GetParam()) {
    case 0:
      mesh = icosphere(4);
      break;
    case 1:
      mesh = torus(80, 40);
      break;
    case 2:
      mesh = nested_spheres(3);
      break;
    case 3:
      mesh = cube();
      break;
    case 4:
      mesh = open_bowl(20, 40);
      break;
    case 5:  // far from the origin, and of two sizes that float coordinates barely resolve
      append(mesh, icosphere(3), 1, {5000, -7000, 300});
      append(mesh, cube(), 0.01f, {5001, -7001, 301.5f});
      break;
    case 6:
      mesh = broken_mesh();
      break;
  }
  mesh.name = "shape";
  const OccupiedObject o(mesh, 48 + uint32_t(GetParam()) * 7);
  const Counts counts = count_certain(o, kSegments / 5);
  EXPECT_EQ(counts.wrong, 0u);
  EXPECT_GT(counts.certain_visible, kSegments / 50);
  // A bowl has no inside, and of a cube nothing but surface voxels lies between its inside and its box.
  if (GetParam() != 3 && GetParam() != 4) {
    EXPECT_GT(counts.certain_occluded, kSegments / 500);
  }
}

INSTANTIATE_TEST_SUITE_P(Generated, CertainOnShapes, testing::Range(0, 7));

TEST(CertainOnRealMeshes, IsNeverWrongOnTenMillionSegmentsEach) {
  if (!real_mesh_folder()) GTEST_SKIP() << "NIF_TEST_MESHES is not set";
  for (const std::filesystem::path& file : real_meshes()) {
    SCOPED_TRACE(file.filename().string());
    const mesh::Scene scene = mesh::read(file);
    // The largest object of a file stands for the others.
    const auto largest = std::max_element(
        scene.meshes.begin(), scene.meshes.end(),
        [](const auto& a, const auto& b) { return a.triangles.size() < b.triangles.size(); });
    const OccupiedObject o(*largest, 96);
    const Counts counts = count_certain(o, kSegments);
    EXPECT_EQ(counts.wrong, 0u);
    std::printf(
        "%-45s %4.1f %% certainly visible, %4.1f %% certainly occluded, %d wrong; %d missed by Embree\n",
        file.filename().c_str(), 100.0 * double(counts.certain_visible) / double(kSegments),
        100.0 * double(counts.certain_occluded) / double(kSegments), int(counts.wrong),
        int(counts.embree_misses));
    EXPECT_LT(counts.embree_misses, 100u);  // more would mean that the walk is at fault, not Embree
  }
}

TEST(CertainOnTheDragon, AnswersFourFifthsOfOuterLines) {
  const auto folder = real_mesh_folder();
  if (!folder) GTEST_SKIP() << "NIF_TEST_MESHES is not set";
  const mesh::Scene scene = mesh::read(*folder / "stanford_dragon_871k.ply.gz");
  const OccupiedObject o(scene.meshes[0], 96);
  const bake::LabelledRays rays =
      bake::make_ray_set(o.truth->source(), bake::RaySet::outer_lines, kSegments, 5);
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
  EXPECT_EQ(wrong, 0u);
  EXPECT_GE(double(certain), 0.8 * double(kSegments));
}

}  // namespace
}  // namespace nif::test
