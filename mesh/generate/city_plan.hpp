// Plans where everything in the city stands.
#pragma once

#include <cstdint>
#include <vector>

#include "mesh/generate/placing.hpp"

namespace nif::generate {

enum class CityKind : uint8_t {
  street,
  side_street,
  crossing,
  lawn,
  square,
  detached,
  terrace,
  apartments,
  tower,
  broadleaf,
  conifer,
  hedge,
  lamp,
  bench,
  bin,
  car,
  statue
};
inline constexpr size_t kCityKinds = size_t(CityKind::statue) + 1;

using CityPlace = PlaceOf<CityKind>;

/// `count` places in a city with the fewest blocks that hold them: first all of its ground and buildings,
/// then as many of the smaller things as fit.
std::vector<CityPlace> plan_city(uint64_t seed, uint32_t count);

}  // namespace nif::generate
