// The generated city: its objects are closed and in their range, and its places use all of them.
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <set>

#include "formats/base/status.hpp"
#include "formats/mesh/box.hpp"
#include "formats/mesh/clean.hpp"
#include "formats/mesh/gltf/gltf_writer.hpp"
#include "formats/mesh/read.hpp"
#include "formats/mesh/transform.hpp"
#include "mesh/generate/city.hpp"
#include "tests/support/surfaces.hpp"
#include "tests/support/temp_dir.hpp"
#include "tests/support/test_shapes.hpp"

namespace nif::generate {
namespace {

TEST(City, HasClosedObjectsThatFaceOutwards) {
  const mesh::Scene city = make_city({kCityFewestInstances, 3});
  ASSERT_EQ(city.meshes.size(), kCityObjects);
  std::set<std::string> names;
  for (const mesh::Mesh& mesh : city.meshes) {
    SCOPED_TRACE(mesh.name);
    EXPECT_TRUE(names.insert(mesh.name).second);
    EXPECT_GE(mesh.triangles.size(), kCityFewestTriangles);
    EXPECT_LE(mesh.triangles.size(), kCityMostTriangles);
    test::expect_closed(mesh);
    size_t inside_out = 0;
    for (const mesh::Mesh& surface : test::surfaces(mesh)) inside_out += test::signed_volume(surface) <= 0;
    EXPECT_EQ(inside_out, 0u);
    const mesh::CleanReport report = mesh::clean(mesh).report;
    EXPECT_EQ(report.degenerate, 0u);
    EXPECT_EQ(report.duplicate, 0u);
    EXPECT_EQ(report.welded_positions, 0u);
  }
}

TEST(City, HasAsManyInstancesAsItIsAskedFor) {
  for (const uint32_t instances : {kCityFewestInstances, kCityFewestInstances + 1, 5'432u, 10'000u, 30'000u})
    for (const uint64_t seed : {1, 2, 3}) {
      SCOPED_TRACE(testing::Message() << instances << " instances, seed " << seed);
      const mesh::Scene city = make_city({instances, seed});
      ASSERT_EQ(city.instances.size(), instances);
      std::set<uint32_t> used;
      std::set<std::string> names;
      for (const mesh::Instance& instance : city.instances) {
        used.insert(instance.mesh);
        names.insert(instance.name);
        EXPECT_GT(mesh::determinant(instance.transform), 0.1) << instance.name;
      }
      EXPECT_EQ(used.size(), kCityObjects);
      EXPECT_EQ(names.size(), instances);
    }
}

TEST(City, StandsOnItsGround) {
  const mesh::Scene city = make_city({});
  const mesh::Box box = mesh::bounds(city);
  EXPECT_NEAR(box.min[1], -0.6f, 1e-3f);
  EXPECT_GT(box.max[1], 40);
  EXPECT_LT(box.max[1], 150);
  for (const size_t axis : {0, 2}) EXPECT_NEAR(box.min[axis], -box.max[axis], 20) << "axis " << axis;
  EXPECT_EQ(city.cameras.size(), 3u);
}

std::vector<std::byte> bytes_of(const CityRequest& request, size_t threads) {
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
  return mesh::encode_glb(make_city(request));
}

TEST(City, DependsOnTheRequestAlone) {
  const std::vector<std::byte> once = bytes_of({kCityFewestInstances, 1}, 1);
  EXPECT_TRUE(once == bytes_of({kCityFewestInstances, 1}, 4));
  EXPECT_FALSE(once == bytes_of({kCityFewestInstances, 2}, 4));
  EXPECT_FALSE(once == bytes_of({kCityFewestInstances, uint64_t{1} << 40}, 4));
}

TEST(City, IsReadAsItWasMade) {
  const test::TempDir folder;
  const mesh::Scene city = make_city({kCityFewestInstances, 1});
  const std::vector<std::byte> bytes = mesh::encode_glb(city);
  const mesh::Scene read = mesh::read(
      folder.write("city.glb", std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size())));
  EXPECT_TRUE(read.notes.empty());
  ASSERT_EQ(read.meshes.size(), city.meshes.size());
  ASSERT_EQ(read.instances.size(), city.instances.size());
  for (size_t m = 0; m < city.meshes.size(); ++m) {
    EXPECT_EQ(read.meshes[m].name, city.meshes[m].name);
    EXPECT_TRUE(read.meshes[m].positions == city.meshes[m].positions);
    EXPECT_TRUE(read.meshes[m].triangles == city.meshes[m].triangles);
  }
  for (size_t i = 0; i < city.instances.size(); ++i) {
    EXPECT_EQ(read.instances[i].name, city.instances[i].name);
    EXPECT_EQ(read.instances[i].mesh, city.instances[i].mesh);
    EXPECT_EQ(read.instances[i].transform, city.instances[i].transform);
  }
  EXPECT_EQ(read.cameras.size(), city.cameras.size());
}

TEST(City, RefusesInstancesOutOfRange) {
  for (const uint32_t instances : {0u, kCityFewestInstances - 1, kCityMostInstances + 1}) {
    try {
      make_city({instances, 1});
      ADD_FAILURE() << instances;
    } catch (const Error& error) {
      EXPECT_EQ(error.status(), Status::usage);
      EXPECT_NE(std::string(error.what()).find(std::to_string(kCityFewestInstances)), std::string::npos);
    }
  }
}

}  // namespace
}  // namespace nif::generate
