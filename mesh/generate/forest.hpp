// `forest`: a scene of many cut-out trees of a few kinds, to bake, render and measure.
#pragma once

#include <cstdint>
#include <string_view>

#include "mesh/generate/cutout_tree.hpp"

namespace nif::generate {

inline constexpr std::string_view kForest = "forest";
inline constexpr std::string_view kForestDescription =
    "a scene of five kinds of trees in many places; their leaves are cut out";

inline constexpr uint32_t kForestFewestInstances = 100, kForestMostInstances = 1'000'000;
inline constexpr uint64_t kForestTreeTriangles = 8'000;  ///< of each tree, at most

struct ForestRequest {
  uint32_t instances = 1'000;  ///< exact number, kForestFewestInstances to kForestMostInstances
  uint64_t seed = 1;
};

/// A scene of a piece of ground and kTreeKinds trees, each with instances, and three cameras. In metres; y is up. The ground
/// is closed. The same request gives the same scene, bit by bit, for any number of threads. Throws Error(usage) if the
/// number of instances is out of range.
PaintedScene make_forest(const ForestRequest& request);

}  // namespace nif::generate
