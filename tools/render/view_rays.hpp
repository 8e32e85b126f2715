// Generates training rays as a renderer traces them: the shadow rays of a scene's cameras, and the camera
// rays themselves.
#pragma once

#include "bake/bake.hpp"
#include "formats/mesh/transform.hpp"
#include "tools/render/lighting.hpp"
#include "tools/render/world.hpp"

namespace nif::render {

/// The rays of all cameras, with one round for each sample of a pixel: round i has sample i of every pixel of
/// every camera. Everything that it refers to must outlive it.
class ViewRays {
 public:
  /// Rays for `meshes`, which were read from the file `mesh`: those that meet the objects of the scene that
  /// use this file. Throws Error(usage) if no object does.
  ViewRays(const SceneDescription& scene, const World& world, const Lighting& lighting,
           const std::string& mesh, const mesh::Scene& meshes);

  /// Shadow rays without ground truth, in the space of each instance whose box they meet. Runs in parallel,
  /// with the same result for any number of threads.
  bake::MeshRays draw(uint64_t round) const;
  /// The same for the rays that start at the cameras.
  bake::MeshRays draw_primary(uint64_t round) const;

 private:
  struct Placement {
    uint32_t mesh;
    mesh::ToObject to_object;
    mesh::Box box;  ///< object space
  };
  /// Calls `ask` for each pixel with (paths, numbers, x, y, keep), which calls keep(Double3 origin, Double3
  /// direction, float tmax) for each of the pixel's rays.
  template <class Ask>
  bake::MeshRays collect(const Ask& ask) const;
  const SceneDescription& scene_;
  const World& world_;
  const Lighting& lighting_;
  std::vector<Placement> placements_;
};

}  // namespace nif::render
