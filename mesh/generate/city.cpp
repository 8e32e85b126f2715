// Makes each mesh from its own random stream, in parallel; then plans the places and deals the meshes out to
// them like playing cards, so that all are used about equally often. Three cameras look at the middle.
#include "mesh/generate/city.hpp"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>

#include "formats/base/status.hpp"
#include "mesh/generate/axes.hpp"
#include "mesh/generate/city_objects.hpp"
#include "mesh/generate/city_plan.hpp"
#include "mesh/generate/placing.hpp"

namespace nif::generate {
namespace {

constexpr uint64_t kObjectStream = 0x6f626a65;  // "obje"

struct Kind {
  const char* name;
  uint32_t variants;
  AddObject add;
};

/// Indexed by CityKind.
constexpr std::array<Kind, kCityKinds> kKinds{{{"street", 2, add_street},
                                               {"side-street", 2, add_side_street},
                                               {"crossing", 2, add_crossing},
                                               {"lawn", 4, add_lawn},
                                               {"square", 2, add_square},
                                               {"detached-house", 32, add_detached_house},
                                               {"terrace", 28, add_terrace},
                                               {"apartments", 24, add_apartments},
                                               {"tower", 14, add_tower},
                                               {"broadleaf", 30, add_broadleaf},
                                               {"conifer", 10, add_conifer},
                                               {"hedge", 6, add_hedge},
                                               {"lamp", 8, add_lamp},
                                               {"bench", 6, add_bench},
                                               {"bin", 3, add_bin},
                                               {"car", 24, add_car},
                                               {"statue", 3, add_statue}}};

constexpr uint32_t objects_of_all_kinds() {
  uint32_t sum = 0;
  for (const Kind& kind : kKinds) sum += kind.variants;
  return sum;
}
static_assert(objects_of_all_kinds() == kCityObjects);

std::vector<mesh::Mesh> make_objects(uint64_t seed) {
  struct Object {
    size_t kind;
    uint32_t variant;
  };
  std::vector<Object> objects;
  for (size_t kind = 0; kind < kKinds.size(); ++kind)
    for (uint32_t variant = 0; variant < kKinds[kind].variants; ++variant) objects.push_back({kind, variant});
  std::vector<mesh::Mesh> meshes(objects.size());
  tbb::parallel_for(size_t{0}, objects.size(), [&](size_t i) {
    const auto [kind, variant] = objects[i];
    Random random(seed, kObjectStream + kind, variant);
    Assembly assembly;
    kKinds[kind].add(assembly, random, variant);
    meshes[i] = assembly.take(fmt::format("{}-{:02}", kKinds[kind].name, variant + 1));
  });
  return meshes;
}

/// Cameras around the crossing nearest to the middle of the city.
std::vector<mesh::Camera> make_cameras(const std::vector<CityPlace>& places) {
  Double3 middle{1e9, 0, 0};
  for (const CityPlace& place : places)
    if (place.kind == CityKind::crossing && length(place.position) < length(middle)) middle = place.position;
  // The last two are above a street, where no house blocks the view.
  return {
      camera("overview", middle + Double3{-250, 125, 290}, middle + Double3{15, 0, 10}, 38),
      camera("roofs", middle + Double3{-4 * kPitch.x, 38, 2 * kPitch.z}, middle + Double3{-20, 6, -30}, 45),
      camera("street", middle + Double3{-52, 1.8, 1.7}, middle + Double3{60, 7, -3}, 55)};
}

}  // namespace

mesh::Scene make_city(const CityRequest& request) {
  if (request.instances < kCityFewestInstances || request.instances > kCityMostInstances)
    throw Error(Status::usage, fmt::format("{} instances: a city can have {} to {}", request.instances,
                                           kCityFewestInstances, kCityMostInstances));
  mesh::Scene scene;
  scene.meshes = make_objects(request.seed);
  std::vector<uint32_t> variants;
  for (const Kind& kind : kKinds) variants.push_back(kind.variants);
  const std::vector<CityPlace> places = plan_city(request.seed, request.instances);
  place_all(places, variants, request.seed, scene);
  scene.cameras = make_cameras(places);
  return scene;
}

}  // namespace nif::generate
