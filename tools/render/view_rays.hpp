// Training rays as a renderer would ask them: the shadow rays of a scene's cameras.
#pragma once

#include "bake/bake.hpp"
#include "tools/render/lighting.hpp"
#include "tools/render/world.hpp"

namespace nif::render {

/// The shadow rays of all cameras, a round for each sample of a pixel: round i has sample i of every pixel of
/// every camera. What it refers to must outlive it.
class ViewRays {
 public:
  /// Rays for `meshes`, which were read from the file `mesh`: as they meet the objects of the scene that name
  /// that file. Throws Error(usage) where none does.
  ViewRays(const SceneDescription& scene, const World& world, const Lighting& lighting,
           const std::string& mesh, const mesh::Scene& meshes);

  /// Unlabelled, each in the space of every instance of a mesh: one for each box that it meets. In parallel,
  /// and the same for any number of threads.
  bake::MeshRays draw(uint64_t round) const;

 private:
  struct Placement {
    uint32_t mesh;
    std::array<Double3, 3> inverse;  ///< rows: world to object, for directions
    Double3 origin;                  ///< of the object, in world space
    bake::Box box;                   ///< object space
  };
  const SceneDescription& scene_;
  const World& world_;
  const Lighting& lighting_;
  std::vector<Placement> placements_;
};

}  // namespace nif::render
