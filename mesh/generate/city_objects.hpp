// Builds the objects of a city, one at a time. In metres; y is up, and objects stand on y = 0 around the
// origin. Objects that have a front face +z.
#pragma once

#include <cstdint>

#include "formats/base/random.hpp"
#include "formats/mesh/mesh_scene.hpp"
#include "mesh/generate/assembly.hpp"

namespace nif::generate {

/// Distance between the middles of neighbouring streets along each axis, and the width of streets. Blocks
/// fill the space between.
inline constexpr Ground kPitch{74, 58};
inline constexpr double kStreet = 11;
inline constexpr Ground kBlockHalf{(kPitch.x - kStreet) / 2, (kPitch.z - kStreet) / 2};
inline constexpr double kPavement = 0.15;  ///< height of blocks above streets
/// Largest footprint of each kind of building, along the street and perpendicular to it.
inline constexpr Ground kDetachedPlot{16, 14}, kTerracePlot{27, 12}, kApartmentPlot{26, 15},
    kTowerPlot{20, 20};

/// Everything random about an object comes from `random`; `variant` counts up from 0 within its kind.
using AddObject = void (*)(Assembly& assembly, Random& random, uint32_t variant);

void add_detached_house(Assembly& assembly, Random& random, uint32_t variant);
void add_terrace(Assembly& assembly, Random& random, uint32_t variant);
void add_apartments(Assembly& assembly, Random& random, uint32_t variant);
void add_tower(Assembly& assembly, Random& random, uint32_t variant);

void add_street(Assembly& assembly, Random& random, uint32_t variant);       ///< along x
void add_side_street(Assembly& assembly, Random& random, uint32_t variant);  ///< along z
void add_crossing(Assembly& assembly, Random& random, uint32_t variant);
void add_lawn(Assembly& assembly, Random& random, uint32_t variant);    ///< a block with grass
void add_square(Assembly& assembly, Random& random, uint32_t variant);  ///< a block with plates

void add_broadleaf(Assembly& assembly, Random& random, uint32_t variant);
void add_conifer(Assembly& assembly, Random& random, uint32_t variant);
void add_hedge(Assembly& assembly, Random& random, uint32_t variant);  ///< 6 m along x
void add_lamp(Assembly& assembly, Random& random, uint32_t variant);   ///< its arm reaches towards +z
void add_bench(Assembly& assembly, Random& random, uint32_t variant);
void add_bin(Assembly& assembly, Random& random, uint32_t variant);
void add_car(Assembly& assembly, Random& random, uint32_t variant);  ///< drives towards +x
void add_statue(Assembly& assembly, Random& random, uint32_t variant);

}  // namespace nif::generate
