// The whole way from a scene of meshes to an asset of `spherical` objects: prepare, train, measure.
#pragma once

#include "bake/bake.hpp"

namespace nif::bake {

/// bake() where options.encoding is EncodingOption::spherical. Throws as bake() does, Error(usage) where
/// check() of the options does, too_large where an object's size cannot be computed with.
BakeResult bake_spherical(const mesh::Scene& scene, const BakeOptions& options, const BakeCallback& callback,
                          const std::atomic<bool>& cancel);

}  // namespace nif::bake
