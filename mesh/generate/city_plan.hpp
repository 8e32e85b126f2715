// Plans where everything in the city stands.
#pragma once

#include <cstdint>
#include <vector>

#include "formats/base/vector.hpp"

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

struct CityPlace {
  CityKind kind;
  Double3 position;
  double turns = 0;  ///< about the vertical axis; after a quarter turn, +z becomes +x
  double scale = 1;
};

/// `count` places in a city with the fewest blocks that hold them: first all of its ground and buildings,
/// then as many of the smaller things as fit.
std::vector<CityPlace> plan_city(uint64_t seed, uint32_t count);

}  // namespace nif::generate
