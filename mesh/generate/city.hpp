// `city`: a scene of very many small objects, to bake, render and measure.
#pragma once

#include <cstdint>
#include <string_view>

#include "formats/mesh/mesh_scene.hpp"

namespace nif::generate {

inline constexpr std::string_view kCity = "city";
inline constexpr std::string_view kCityDescription =
    "a scene of 200 objects in many places: streets, houses, trees, lamps, cars";

inline constexpr uint32_t kCityObjects = 200;
/// Triangles of each object, and instances of a city.
inline constexpr uint64_t kCityFewestTriangles = 500, kCityMostTriangles = 20'000;
inline constexpr uint32_t kCityFewestInstances = 3'000, kCityMostInstances = 1'000'000;

struct CityRequest {
  uint32_t instances = 10'000;  ///< exact number, kCityFewestInstances to kCityMostInstances
  uint64_t seed = 1;
};

/// A scene of kCityObjects meshes, each with instances, and three cameras. Each mesh consists of closed
/// surfaces that face outwards and may overlap. In metres; y is up, and streets are at y = 0. The same
/// request gives the same scene, bit by bit, for any number of threads. Throws Error(usage) if the number of
/// instances is out of range.
mesh::Scene make_city(const CityRequest& request);

}  // namespace nif::generate
