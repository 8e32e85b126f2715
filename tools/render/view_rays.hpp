// Training rays as a renderer asks them: the shadow rays of a scene's cameras, and the camera rays
// themselves.
#pragma once

#include "bake/bake.hpp"
#include "formats/mesh/transform.hpp"
#include "tools/render/lighting.hpp"
#include "tools/render/world.hpp"

namespace nif::render {

/// The rays of all cameras, a round for each sample of a pixel: round i has sample i of every pixel of every
/// camera. What it refers to must outlive it.
class ViewRays {
 public:
  /// Rays for `meshes`, which were read from the file `mesh`: as they meet the objects of the scene that name
  /// that file. Throws Error(usage) where none does.
  ViewRays(const SceneDescription& scene, const World& world, const Lighting& lighting,
           const std::string& mesh, const mesh::Scene& meshes);

  /// Shadow rays, unlabelled, each in the space of every instance of a mesh: one for each box that it meets.
  /// In parallel, and the same for any number of threads.
  bake::MeshRays draw(uint64_t round) const;
  /// Likewise the rays that start at the cameras.
  bake::MeshRays draw_primary(uint64_t round) const;

 private:
  struct Placement {
    uint32_t mesh;
    mesh::ToObject to_object;
    mesh::Box box;  ///< object space
  };
  /// `ask` is called for each pixel with (paths, numbers, x, y, keep), and keep(Double3 origin, Double3
  /// direction, float tmax) for each of its rays.
  template <class Ask>
  bake::MeshRays collect(const Ask& ask) const;
  const SceneDescription& scene_;
  const World& world_;
  const Lighting& lighting_;
  std::vector<Placement> placements_;
};

}  // namespace nif::render
