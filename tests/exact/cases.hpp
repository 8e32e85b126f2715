// A case: a mesh, a transform and some rays; how it is drawn, judged, cut down and kept as a file.
#pragma once

#include <atomic>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "tests/exact/generators.hpp"
#include "tests/exact/subject.hpp"

namespace nif::test {

struct Case {
  std::string name;  ///< of the generators
  HostileMesh hostile;
  Transform transform;
  std::vector<NifRay> rays;
  uint64_t grid;  ///< seed of the planes' grid
};

/// A wrong answer.
struct Finding {
  Placed placed;
  std::string way;
  NifRay ray;
  std::string what;
};

struct Tally {
  uint64_t rays = 0;     ///< judged, each in one scene
  uint64_t certain = 0;  ///< of them, called certain
  uint64_t answers = 0;  ///< to these rays, by each way and call
  uint64_t refused = 0;  ///< meshes that cannot be baked
  Tally& operator+=(const Tally& other);
};

/// Case `number` of a seed; always the same one. Generators take turns.
Case draw_case(uint64_t seed, uint64_t number, uint32_t rays);

/// Queries and judges. A GPU gets `gpu_rays` of the rays.
std::vector<Finding> judge(const Case& one, const std::vector<Way>& ways, uint32_t gpu_rays, Tally& tally);

/// The case reduced to one ray, and to as few triangles as show the same kind of error.
Case minimise(const Case& one, const Finding& finding, const std::vector<Way>& ways);

/// To text with hexadecimal numbers, and back. Throws std::runtime_error if the text is not a case.
std::string to_text(const Case& one, const std::vector<std::string>& remarks);
Case read_case(const std::filesystem::path& file);

}  // namespace nif::test
