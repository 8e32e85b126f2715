// Makes each mesh from its own random stream, in parallel; then plans the places and deals the meshes out to
// them like playing cards, so that all are used about equally often. Three cameras look at the middle.
#include "mesh/generate/city.hpp"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <numeric>

#include "formats/base/status.hpp"
#include "mesh/generate/axes.hpp"
#include "mesh/generate/city_objects.hpp"
#include "mesh/generate/city_plan.hpp"
#include "mesh/generate/turn.hpp"

namespace nif::generate {
namespace {

constexpr uint64_t kObjectStream = 0x6f626a65, kVariantStream = 0x76617269;  // "obje", "vari"

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

/// Deals the variants of a kind like playing cards: all of them once in random order, then all again in
/// another order.
class Deck {
 public:
  Deck(uint64_t seed, size_t kind) : random_(seed, kVariantStream, kind), cards_(kKinds[kind].variants) {
    std::iota(cards_.begin(), cards_.end(), 0u);
  }
  uint32_t next() {
    const size_t at = dealt_++ % cards_.size();
    std::swap(cards_[at], cards_[at + random_.below(uint32_t(cards_.size() - at))]);
    return cards_[at];
  }

 private:
  Random random_;
  std::vector<uint32_t> cards_;
  size_t dealt_ = 0;
};

mesh::Transform transform_of(const CityPlace& place) {
  const Turn t = turn(place.turns);
  const double c = t.cos * place.scale, s = t.sin * place.scale;
  const Double3& p = place.position;
  return {float(c), 0,           float(s),  float(p[0]), 0,        float(place.scale),
          0,        float(p[1]), float(-s), 0,           float(c), float(p[2])};
}

mesh::Camera camera(const char* name, const Double3& position, const Double3& target, double degrees) {
  const Double3 back = unit(position - target), right = unit(cross(Double3{0, 1, 0}, back)),
                up = cross(back, right);
  mesh::Camera camera{name, {}, degrees * 3.141592653589793 / 180};
  for (size_t row = 0; row < 3; ++row) {
    const double values[4] = {right[row], up[row], back[row], position[row]};
    for (size_t k = 0; k < 4; ++k) camera.transform[4 * row + k] = float(values[k]);
  }
  return camera;
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
  std::array<uint32_t, kCityKinds> first{};
  std::vector<Deck> decks;
  for (size_t kind = 0; kind < kCityKinds; ++kind) {
    if (kind > 0) first[kind] = first[kind - 1] + kKinds[kind - 1].variants;
    decks.emplace_back(request.seed, kind);
  }
  std::vector<uint32_t> placed(scene.meshes.size());
  const std::vector<CityPlace> places = plan_city(request.seed, request.instances);
  for (const CityPlace& place : places) {
    const uint32_t mesh = first[size_t(place.kind)] + decks[size_t(place.kind)].next();
    scene.instances.push_back(
        {fmt::format("{}.{}", scene.meshes[mesh].name, ++placed[mesh]), mesh, transform_of(place)});
  }
  scene.cameras = make_cameras(places);
  return scene;
}

}  // namespace nif::generate
