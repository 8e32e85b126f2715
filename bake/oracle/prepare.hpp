// Meshes made ready for baking or measuring: cleaned, with their closed parts and bounds known.
#pragma once

#include <string>
#include <vector>

#include "bake/oracle/closure.hpp"
#include "bake/oracle/ray_sets.hpp"
#include "formats/mesh/clean.hpp"

namespace nif::bake {

/// One mesh, made ready: all that depends neither on the resolution nor on the rays.
struct Prepared {
  const mesh::Mesh* source;  ///< not owned
  mesh::CleanMesh surface;
  ClosedComponents closed;
  mesh::Box box;
  float bias;  ///< bias_of() it
};

/// kBiasFraction of the longest side of a mesh with these bounds; of its middle part if it was merged.
float bias_of(const mesh::Mesh& mesh, const mesh::Box& box);

/// Throws Error(all_degenerate) from clean(), Error(too_large) where the size cannot be computed with.
Prepared prepare(const mesh::Mesh& mesh);

/// The objects of a scene. Of several meshes with equal positions, triangles and looks the first stands for
/// all; meshes without any area are left out, with their instances.
struct PreparedScene {
  static constexpr uint32_t kNone = 0xffffffffu;
  std::vector<Prepared> objects;
  std::vector<uint32_t> object_of;  ///< by mesh: its object, or kNone where it was left out
  std::vector<uint32_t> instances;  ///< of the scene, those that place an object and do not flatten it
  std::vector<std::string> notes;   ///< what was changed or left out, a sentence each; welding is no change
};

/// Refers to the scene's meshes, which must outlive the result. Throws as prepare() of a mesh, all_degenerate
/// only where no object is left; with `strict`, Error(needs_repair) with the first note where there are any,
/// or the first loss of the reader (mesh::is_loss).
PreparedScene prepare(const mesh::Scene& scene, bool strict = false);

/// The ground truth of one object, over its prepared mesh, which must outlive it.
class GroundTruth {
 public:
  explicit GroundTruth(const Prepared& prepared)
      : oracle_(prepared.surface.positions, prepared.surface.triangles),
        inside_(prepared.surface, prepared.closed),
        source_{oracle_, inside_, prepared.box, prepared.bias,
                has_free_volume(inside_, prepared.box, prepared.bias)} {}
  const RaySource& source() const { return source_; }

 private:
  Oracle oracle_;
  InsideTest inside_;
  RaySource source_;
};

}  // namespace nif::bake
