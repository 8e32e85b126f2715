// With source triangles, first hits name the triangles of the mesh as it was read, whatever a bake drops,
// turns or reorders: compared with a loop over that mesh.
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <map>
#include <set>

#include "bake/ground_truth/prepare.hpp"
#include "formats/base/collinear.hpp"
#include "formats/mesh/read.hpp"
#include "formats/nif/writer.hpp"
#include "kernels/reference/instance.hpp"
#include "mesh/merge/merge.hpp"
#include "nif/nif.hpp"
#include "tests/bake/quiet_bake.hpp"
#include "tests/support/gltf.hpp"
#include "tests/support/test_random.hpp"
#include "tests/support/test_shapes.hpp"

namespace nif::test {
namespace {

using kernels::Segment;

bake::BakeOptions with_sources(const char* encoding) {
  bake::BakeOptions options;
  options.encoding = encoding;
  options.evaluation_rays = 0;
  options.source_triangles = true;
  return options;
}

/// The same surface mixed with triangles that a bake drops, and with some triangles reversed.
mesh::Mesh messy(const mesh::Mesh& mesh, uint64_t seed) {
  Random random(seed);
  mesh::Mesh out{mesh.name, mesh.positions, {}};
  for (mesh::Triangle t : mesh.triangles) {
    if (random.below(6) == 0) std::swap(t[1], t[2]);
    out.triangles.push_back(t);
    const mesh::Triangle& other = out.triangles[random.below(uint32_t(out.triangles.size()))];
    switch (random.below(8)) {
      case 0:
        out.triangles.push_back({t[0], t[1], t[0]});
        break;
      case 1: {  // a sliver
        const auto [p, q] = std::pair(out.positions[t[0]], out.positions[t[1]]);
        const mesh::Float3 beyond{q[0] + (q[0] - p[0]), q[1] + (q[1] - p[1]), q[2] + (q[2] - p[2])};
        if (!collinear(p, q, beyond)) break;
        out.triangles.push_back({t[0], t[1], uint32_t(out.positions.size())});
        out.positions.push_back(beyond);
        break;
      }
      case 2:  // a duplicate of any triangle
        out.triangles.push_back({other[1], other[2], other[0]});
        break;
      case 3:  // a duplicate with separate vertices
        for (const uint32_t v : t) out.positions.push_back(mesh.positions[v]);
        out.triangles.push_back({uint32_t(out.positions.size() - 3), uint32_t(out.positions.size() - 2),
                                 uint32_t(out.positions.size() - 1)});
        break;
      case 4:  // the reversed triangle
        out.triangles.push_back({t[0], t[2], t[1]});
        break;
      default:
        break;
    }
  }
  return out;
}

/// The triangles that a bake keeps, computed independently: those with an area; of duplicates with the same
/// orientation, the first.
std::vector<uint32_t> kept_of(const mesh::Mesh& mesh) {
  using Corners = std::array<mesh::Float3, 3>;
  std::set<Corners> seen;
  std::vector<uint32_t> kept;
  for (uint32_t i = 0; i < mesh.triangles.size(); ++i) {
    const mesh::Triangle& t = mesh.triangles[i];
    Corners corners{mesh.positions[t[0]], mesh.positions[t[1]], mesh.positions[t[2]]};
    if (collinear(corners[0], corners[1], corners[2])) continue;
    std::ranges::rotate(corners, std::ranges::min_element(corners));
    if (seen.insert(corners).second) kept.push_back(i);
  }
  return kept;
}

/// Result of the loop.
struct Nearest {
  double t = std::numeric_limits<double>::infinity();
  std::vector<uint32_t> triangles;  ///< all at this t
  std::vector<kernels::TriangleCrossing<double>> crossings;
};
Nearest nearest_of(const mesh::Mesh& mesh, const std::vector<uint32_t>& kept,
                   const kernels::TrianglesField& field, const Segment& segment) {
  Nearest nearest;
  kernels::BvhRay ray;
  if (!kernels::prepare_ray(field, segment, ray)) return nearest;
  for (const uint32_t i : kept) {
    const float* vertices[3];
    for (size_t k = 0; k < 3; ++k) vertices[k] = mesh.positions[mesh.triangles[i][k]].data();
    kernels::TriangleCrossing<double> crossing;
    if (!kernels::meets_triangle(ray, vertices, crossing) || crossing.t > nearest.t) continue;
    if (crossing.t < nearest.t) nearest = {crossing.t, {}, {}};
    nearest.triangles.push_back(i);
    nearest.crossings.push_back(crossing);
  }
  return nearest;
}

/// Rays in the space of the mesh: at random through the surface, and exactly at corners and edges.
Segment aimed_at(const mesh::Mesh& mesh, Random& random) {
  const mesh::Triangle& t = mesh.triangles[random.below(uint32_t(mesh.triangles.size()))];
  const auto& [a, b, c] = std::tuple(mesh.positions[t[0]], mesh.positions[t[1]], mesh.positions[t[2]]);
  const uint32_t kind = random.below(4);
  const float u = kind == 0 ? 0 : random.unit(), v = kind <= 1 ? 0 : random.unit() * (1 - u);
  Segment segment{{}, {}, 0, std::numeric_limits<float>::infinity()};
  for (size_t k = 0; k < 3; ++k) {
    segment.origin[k] = random.between(-3.0f, 3.0f);
    segment.direction[k] = a[k] + u * (b[k] - a[k]) + v * (c[k] - a[k]) - segment.origin[k];
  }
  return segment;
}

const kernels::TrianglesField& tree_of(const format::ObjectView& object) { return object.triangles->field; }

struct Counts {
  uint64_t hits = 0, ties = 0, uncommon = 0;  ///< of these, hits whose number in the object differs
};

/// Each first hit of the whole asset must be what a loop finds in the source mesh of its object.
void compare(const mesh::Scene& scene, const bake::BakeResult& result, uint32_t rays, Counts& counts) {
  const std::vector<std::byte> file = format::encode(result.asset);
  const format::AssetView view = format::read_asset(file, "file");
  const nifkit::Device device("threads=1");
  const nifkit::Asset asset = nifkit::Asset::load(device, file);
  nifkit::Scene placed(device);
  placed.add_asset(asset);
  placed.commit();
  const bake::PreparedScene prepared = bake::prepare(scene);
  std::vector<std::map<uint32_t, uint32_t>> places;  // [object]: from source number to number in the object
  std::vector<std::vector<uint32_t>> kept;
  for (uint32_t o = 0; o < view.objects.size(); ++o) {
    const format::NumbersView* source = view.numbers_of(o, format::kSourceTriangles);
    ASSERT_NE(source, nullptr);
    const mesh::Mesh& mesh = *prepared.objects[o].source;
    EXPECT_EQ(source->below, mesh.triangles.size());
    EXPECT_EQ(asset.object(o).source_triangles, mesh.triangles.size());
    std::map<uint32_t, uint32_t>& place = places.emplace_back();
    for (uint32_t i = 0; i < source->field.count; ++i)
      EXPECT_TRUE(place.emplace(kernels::source_triangle(source->field, i), i).second) << "named twice";
    kept.push_back(kept_of(mesh));
    ASSERT_EQ(kept.back().size(), place.size());
    for (const uint32_t number : kept.back()) ASSERT_TRUE(place.contains(number)) << number;
  }

  Random random(rays);
  for (uint32_t i = 0; i < rays; ++i) {
    const format::Instance& target =
        result.asset.instances[random.below(uint32_t(result.asset.instances.size()))];
    Segment segment = aimed_at(*prepared.objects[target.object].source, random);
    const Segment local = segment;
    for (size_t row = 0; row < 3; ++row) {
      segment.origin[row] = target.transform[4 * row + 3];
      segment.direction[row] = 0;
      for (size_t k = 0; k < 3; ++k) {
        segment.origin[row] += target.transform[4 * row + k] * local.origin[k];
        segment.direction[row] += target.transform[4 * row + k] * local.direction[k];
      }
    }
    const NifRay ray{{segment.origin[0], segment.origin[1], segment.origin[2]},
                     segment.tmin,
                     {segment.direction[0], segment.direction[1], segment.direction[2]},
                     segment.tmax};
    uint8_t hit;
    uint32_t instance, triangle;
    float u, v;
    NifHits hits{};
    hits.struct_size = sizeof(hits);
    hits.hit = &hit, hits.instance = &instance, hits.triangle = &triangle, hits.u = &u, hits.v = &v;
    const NifRays query = nifMakeRays(&ray, 1);
    nifkit::check(nifIntersect(placed.get(), &query, &hits));
    if (!hit) {
      ASSERT_EQ(triangle, NIF_NONE);
      continue;
    }
    const format::Instance& met = result.asset.instances[instance];
    kernels::WorldToObject to_object;
    bool good;
    ASSERT_TRUE(kernels::invert(met.transform.data(), to_object, good));
    const bool identity = met.transform == format::Instance().transform;
    const Segment there = identity ? segment : kernels::to_object(to_object, segment);
    const Nearest nearest = nearest_of(*prepared.objects[met.object].source, kept[met.object],
                                       tree_of(view.objects[met.object]), there);
    // Among ties, the triangle that comes first in the object.
    ASSERT_FALSE(nearest.triangles.empty());
    const std::map<uint32_t, uint32_t>& place = places[met.object];
    size_t first = 0;
    for (size_t k = 1; k < nearest.triangles.size(); ++k)
      if (place.at(nearest.triangles[k]) < place.at(nearest.triangles[first])) first = k;
    ASSERT_EQ(triangle, nearest.triangles[first]);
    const auto& [t, weight, sum] = nearest.crossings[first];
    ASSERT_EQ(u, static_cast<float>(weight[1] / sum)) << "in the mesh's order of corners";
    ASSERT_EQ(v, static_cast<float>(weight[2] / sum));
    ++counts.hits;
    counts.ties += nearest.triangles.size() > 1;
    counts.uncommon += place.at(triangle) != triangle;
  }
}

TEST(SourceTriangles, AreThoseOfMessyMeshesInInstances) {
  mesh::Scene scene;
  scene.meshes = {messy(icosphere(3), 1), messy(torus(24, 10), 2), messy(open_bowl(8, 12), 3)};
  scene.meshes.push_back(scene.meshes[0]);  // baked once
  Random random(4);
  for (uint32_t i = 0; i < 12; ++i) {
    mesh::Instance& instance = scene.instances.emplace_back();
    instance.mesh = i % 4;
    if (i < 4) continue;  // unchanged
    for (float& x : instance.transform) x = random.between(-0.4f, 0.4f);
    for (const size_t a : {size_t{0}, size_t{5}, size_t{10}}) instance.transform[a] += i % 3 ? 1.f : -1.f;
    for (const size_t a : {size_t{3}, size_t{7}, size_t{11}}) instance.transform[a] *= 12;
  }
  for (const char* encoding : {"bvh", "exact", "auto"}) {
    SCOPED_TRACE(encoding);
    const bake::BakeResult result = bake_quietly(scene, with_sources(encoding));
    ASSERT_EQ(result.asset.objects.size(), 3u);
    uint64_t dropped = 0, turned = 0;
    for (const bake::ObjectReport& object : result.objects) {
      EXPECT_GT(object.cleaned.degenerate, 0u);
      EXPECT_GT(object.cleaned.duplicate, 0u);
      dropped += object.cleaned.degenerate + object.cleaned.duplicate;
      turned += object.turned;
    }
    EXPECT_GT(dropped, 100u);
    Counts counts;
    compare(scene, result, 8'000, counts);
    EXPECT_GT(counts.hits, 4'000u);
    EXPECT_GT(counts.ties, 400u);
    EXPECT_GT(counts.uncommon, counts.hits / 2);
  }
}

/// A closed surface with reversed triangles, which the baker turns: that changes neither numbers nor the
/// corners that u and v refer to.
TEST(SourceTriangles, AreThoseOfTurnedTriangles) {
  mesh::Mesh ball = icosphere(3);
  for (size_t t = 0; t < ball.triangles.size(); t += 7) std::swap(ball.triangles[t][1], ball.triangles[t][2]);
  const mesh::Scene scene = scene_of({ball});
  for (const char* encoding : {"bvh", "exact"}) {
    const bake::BakeResult result = bake_quietly(scene, with_sources(encoding));
    EXPECT_GT(result.objects[0].turned, 100u);
    Counts counts;
    compare(scene, result, 5'000, counts);
    EXPECT_GT(counts.hits, 4'000u);
  }
}

TEST(SourceTriangles, OfAMergedMeshAreThoseOfItsPartsInTheirOrder) {
  mesh::Scene scene = scene_of({messy(icosphere(1), 5), messy(torus(9, 6), 6)});
  scene.instances[0].transform = {-1, 0, 0, 0.5f, 0, 1, 0, 0.25f, 0, 0, 1, -0.5f};  // mirrored
  scene.instances.push_back(scene.instances[0]);
  scene.instances.back().transform[3] = 2;
  const std::vector<uint64_t> parts{scene.meshes[0].triangles.size(), scene.meshes[1].triangles.size(),
                                    scene.meshes[0].triangles.size()};
  mesh::MergeOptions options;
  options.added_triangles = 100'000;
  options.part_triangles = 1'000;
  options.object_triangles = 2'000;
  const mesh::Scene merged = mesh::merge(scene, options);
  ASSERT_EQ(merged.meshes.size(), 1u);
  const bake::BakeResult result = bake_quietly(merged, with_sources("bvh"));
  Counts counts;
  compare(merged, result, 5'000, counts);
  EXPECT_GT(counts.hits, 2'000u);
  ASSERT_EQ(merged.merging->merged[0].parts.size(), parts.size());
  for (size_t i = 0; i < parts.size(); ++i) EXPECT_EQ(merged.merging->merged[0].parts[i].triangles, parts[i]);
  EXPECT_NE(result.asset.metadata.find(R"("triangles":[)" + std::to_string(parts[0]) + "," +
                                       std::to_string(parts[1]) + "," + std::to_string(parts[2]) + "]"),
            std::string::npos)
      << result.asset.metadata;
}

/// Primitives of a mesh are numbered one after the other; degenerate triangles of a strip do not count.
TEST(SourceTriangles, OfGltfRunOverThePrimitivesOfAMesh) {
  Gltf gltf;
  const int square = gltf.positions({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}),
            strip = gltf.positions({{2, 0, 0}, {3, 0, 0}, {2, 1, 0}, {3, 1, 0}, {2, 2, 0}, {3, 2, 0}});
  const int mesh = gltf.mesh(square, gltf.indices({0, 1, 2, 0, 2, 3}), "two");
  gltf.json["meshes"][size_t(mesh)]["primitives"].push_back(
      {{"attributes", {{"POSITION", strip}}},
       {"indices", gltf.indices({0, 1, 2, 3, 3, 2, 2, 3, 4, 5})},
       {"mode", 5}});
  gltf.scene({gltf.node({{"mesh", mesh}, {"translation", {10, 0, 0}}})});
  const mesh::Scene scene = mesh::read("two.glb", gltf.glb());
  ASSERT_EQ(scene.meshes.size(), 1u);
  ASSERT_EQ(scene.meshes[0].triangles.size(), 6u);
  const bake::BakeResult result = bake_quietly(scene, with_sources("bvh"));
  const nifkit::Device device("threads=1");
  nifkit::Scene placed(device);
  placed.add_asset(nifkit::Asset::load(device, format::encode(result.asset)));
  placed.commit();
  const auto triangle_at = [&](float x, float y) {
    const NifRay ray{{x, y, 5}, 0, {0, 0, -1}, 10};
    uint32_t triangle;
    NifHits hits{};
    hits.struct_size = sizeof(hits);
    hits.triangle = &triangle;
    const NifRays query = nifMakeRays(&ray, 1);
    nifkit::check(nifIntersect(placed.get(), &query, &hits));
    return triangle;
  };
  EXPECT_EQ(triangle_at(10.75f, 0.25f), 0u);
  EXPECT_EQ(triangle_at(10.25f, 0.75f), 1u);
  EXPECT_EQ(triangle_at(12.25f, 0.25f), 2u);
  EXPECT_EQ(triangle_at(12.75f, 0.75f), 3u);
  EXPECT_EQ(triangle_at(12.25f, 1.25f), 4u);
  EXPECT_EQ(triangle_at(12.75f, 1.75f), 5u);
  EXPECT_EQ(triangle_at(11.5f, 0.5f), NIF_NONE);
}

TEST(SourceTriangles, AreLeftOutUnlessAskedFor) {
  const mesh::Scene scene = scene_of({messy(icosphere(2), 7)});
  bake::BakeOptions options = with_sources("exact");
  const bake::BakeResult with = bake_quietly(scene, options);
  options.source_triangles = false;
  const bake::BakeResult without = bake_quietly(scene, options);
  EXPECT_FALSE(without.asset.objects[0].numbers.contains(format::kSourceTriangles));
  EXPECT_EQ(without.asset.metadata.find("source_triangles"), std::string::npos);
  EXPECT_NE(with.asset.metadata.find("source_triangles"), std::string::npos);
  // Everything else stays the same.
  const format::Object &one = with.asset.objects[0], &other = without.asset.objects[0];
  EXPECT_EQ(one.triangles->triangles, other.triangles->triangles);
  EXPECT_EQ(one.triangles->vertices, other.triangles->vertices);
  EXPECT_EQ(one.planes->children, other.planes->children);
  const nifkit::Device device("threads=1");
  const nifkit::Asset asset = nifkit::Asset::load(device, format::encode(without.asset));
  EXPECT_EQ(asset.object(0).source_triangles, 0u);
  // The planned size equals the file's size.
  EXPECT_EQ(format::encode(with.asset).size(), format::encoded_bytes(with.asset));
}

/// A size limit that the object meets only without source numbers.
TEST(SourceTriangles, CountForTheSizeLimit) {
  const mesh::Scene scene = scene_of({icosphere(4)});
  bake::BakeOptions options = with_sources("bvh");
  options.source_triangles = false;
  options.max_bytes = format::encode(bake_quietly(scene, options).asset).size() + 4000;
  EXPECT_EQ(status_of(scene, options), Status::ok);
  options.source_triangles = true;
  EXPECT_EQ(status_of(scene, options), Status::target_not_met);
  options.encoding = "auto";
  options.effort = 0.01;
  EXPECT_FALSE(bake_quietly(scene, options).asset.objects[0].numbers.contains(format::kSourceTriangles));
}

}  // namespace
}  // namespace nif::test
