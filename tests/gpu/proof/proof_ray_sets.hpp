// Rays for any box, made from a seed and nothing else: no mesh is needed, and no library.
#pragma once

#include <nif/nif.h>

#include <cstdint>
#include <vector>

namespace nif::test {

/// After the named sets of docs/ray-sets.md, as far as these can be had without a mesh.
enum class BoxRays {
  lines,     ///< lines through the box from outside, in all directions
  inner,     ///< origins in the box, directions all around, without an end
  segments,  ///< origins in the box, 1 % to 100 % of its diagonal long
  sun,       ///< one direction, origins side by side
};
inline constexpr BoxRays kBoxRays[] = {BoxRays::lines, BoxRays::inner, BoxRays::segments, BoxRays::sun};
const char* name_of(BoxRays set);

/// Rays first .. first + count - 1 of `all` that the seed stands for. Which part is asked for changes no ray.
std::vector<NifRay> make_rays(BoxRays set, const float low[3], const float high[3], uint64_t seed,
                              uint64_t first, uint64_t count, uint64_t all);

}  // namespace nif::test
