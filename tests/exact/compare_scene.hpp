// Compares the answers of a random scene by every instruction set with those of the reference.
#pragma once

#include "tests/exact/random_scene.hpp"

namespace nif::test {

struct SceneTally {
  uint64_t rays = 0;
  uint64_t certain = 0, hit = 0, open = 0;  ///< of the rays, by the reference
  uint64_t answers = 0;                     ///< to these rays, by each way and call
  uint64_t differing = 0;                   ///< rays to which some way has another answer
  std::vector<std::string> findings;        ///< the first of each way
  SceneTally& operator+=(const SceneTally& other);
};

/// For each instruction set of this machine, its ways: numbers of threads, and with the least memory.
std::vector<std::vector<Way>> make_scene_ways();

/// Asks by one way of each instruction set, drawn by the scene's number, and in calls of any size. A third of the
/// scenes also by the first, which is scalar.
SceneTally compare(const RandomScene& scene, const std::vector<std::vector<Way>>& ways, uint64_t number);
/// The same with other answers to compare with.
SceneTally compare_with(const Said& expected, const RandomScene& scene,
                        const std::vector<std::vector<Way>>& ways, uint64_t number);

}  // namespace nif::test
