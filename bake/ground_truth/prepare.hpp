// Prepares meshes for baking or measuring: cleans them, and finds their closed parts and bounds.
#pragma once

#include <string>
#include <vector>

#include "bake/ground_truth/closure.hpp"
#include "bake/ground_truth/ray_sets.hpp"
#include "formats/mesh/clean.hpp"

namespace nif::bake {

/// One prepared mesh: everything that depends neither on the resolution nor on the rays.
struct Prepared {
  const mesh::Mesh* source;  ///< not owned
  mesh::CleanMesh surface;
  ClosedComponents closed;
  mesh::Box box;
  float bias;          ///< its bias_of()
  bool bends = false;  ///< instances of its object can bend: then it keeps all triangles of the source

  /// How many triangles its object has.
  uint64_t triangle_count() const { return bends ? source->triangles.size() : surface.triangles.size(); }
  /// Whether any triangle has holes.
  bool has_holes() const { return !surface.holes.empty(); }
};

/// kBiasFraction of the longest side of a mesh with these bounds; of its middle part if it was merged.
float bias_of(const mesh::Mesh& mesh, const mesh::Box& box);

/// Throws Error(all_degenerate) from clean(), Error(too_large) if the size cannot be computed with.
Prepared prepare(const mesh::Mesh& mesh);

/// The objects of a scene. Meshes with equal positions, triangles and looks share the object of the first;
/// meshes without any area, or that block nothing, are left out, with their instances.
struct PreparedScene {
  static constexpr uint32_t kNone = 0xffffffffu;
  std::vector<Prepared> objects;
  std::vector<uint32_t> object_of;  ///< by mesh: its object, or kNone if it was left out
  std::vector<uint32_t> instances;  ///< of the scene, those that place an object and do not flatten it
  std::vector<std::string> notes;   ///< what was changed or left out, one sentence each; welding is no change
};

/// Refers to the scene's meshes, which must outlive the result. Throws what prepare() of a mesh throws, but
/// all_degenerate only if no object is left; with `strict`, Error(needs_repair) with the first note, if there
/// are any, or with the reader's first loss (mesh::is_loss). `deforms`: objects bend; if any has a skin, those that have one; but
/// none that has holes.
PreparedScene prepare(const mesh::Scene& scene, bool strict = false, bool deforms = false);

/// The ground truth of one object, from its prepared mesh, which must outlive it.
class GroundTruth {
 public:
  explicit GroundTruth(const Prepared& prepared)
      : embree_(prepared.surface),
        inside_(prepared.surface, prepared.closed),
        source_{embree_, inside_, prepared.box, prepared.bias,
                has_free_volume(inside_, prepared.box, prepared.bias)} {}
  const RaySource& source() const { return source_; }

 private:
  EmbreeTruth embree_;
  InsideTest inside_;
  RaySource source_;
};

}  // namespace nif::bake
