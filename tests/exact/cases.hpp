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
  std::string name;  ///< of its generators
  HostileMesh hostile;
  Transform transform;
  std::vector<NifRay> rays;
  uint64_t grid;  ///< seed of the grid that its planes lie in
};

/// What is wrong with an answer.
struct Finding {
  Placed placed;
  std::string way;
  NifRay ray;
  std::string what;
};

struct Tally {
  uint64_t rays = 0;     ///< judged, each in one scene
  uint64_t certain = 0;  ///< of them called certain
  uint64_t answers = 0;  ///< to these rays, by each way and each of kCalls
  uint64_t refused = 0;  ///< meshes that cannot be baked
  Tally& operator+=(const Tally& other);
};

/// Case `number` of a seed: always the same one. Generators take turns.
Case draw_case(uint64_t seed, uint64_t number, uint32_t rays);

/// Asks and judges. A GPU is asked about `gpu_rays` of the rays.
std::vector<Finding> judge(const Case& one, const std::vector<Way>& ways, uint32_t gpu_rays, Tally& tally);

/// The case with one ray, and as few triangles as it takes for the same kind of thing to be wrong.
Case minimise(const Case& one, const Finding& finding, const std::vector<Way>& ways);

/// As text, with numbers in hexadecimal; and back. Throws std::runtime_error of what is no case.
std::string to_text(const Case& one, const std::vector<std::string>& remarks);
Case read_case(const std::filesystem::path& file);

}  // namespace nif::test
