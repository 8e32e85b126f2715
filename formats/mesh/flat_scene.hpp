// Merges a scene into one mesh: the transformed triangles of each instance, one instance after the other.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "formats/mesh/mesh_source.hpp"

namespace nif::mesh {

/// Instances with the identity keep their mesh's positions to the bit; others are rounded once. The triangles
/// of mirrored instances are flipped, so that they face as before.
class FlatScene : public MeshSource {
 public:
  /// Refers to the arrays, which must outlive it. Throws Error(too_large) if 32-bit indices are too small.
  FlatScene(std::span<const Mesh> meshes, std::span<const Instance> instances);
  explicit FlatScene(const Scene& scene) : FlatScene(scene.meshes, scene.instances) {}

  uint64_t vertex_count() const override { return first_vertex_.back(); }
  uint64_t triangle_count() const override { return first_triangle_.back(); }
  void vertices(uint64_t first, std::span<Float3> out) const override;
  void exact(uint64_t first, std::span<Double3> out) const override;
  bool needs_doubles() const override;
  void triangles(uint64_t first, std::span<Triangle> out) const override;

  /// Finds instances that floats are too coarse for (far_from_origin.hpp). From then on, exact() gives the
  /// positions of these with few digits, and those of others like vertices().
  void find_far();
  bool far(size_t instance) const { return !offsets_.empty() && offsets_[instance].has_value(); }
  /// The most by which vertices() rounds the far ones.
  double rounding() const;

  /// The colours of its meshes, as far as they are known, with white for all others.
  Appearance look() const;
  std::vector<TriangleAlpha> alpha() const;
  bool has_holes() const;
  /// Gives a mesh with its triangles their holes.
  void give_holes(Mesh& flat) const;

  size_t instance_count() const { return mirrored_.size(); }
  /// Number of the first vertex or triangle of an instance; for [instances]: the end.
  uint64_t first_vertex(size_t instance) const { return first_vertex_[instance]; }
  uint64_t first_triangle(size_t instance) const { return first_triangle_[instance]; }

 private:
  std::span<const Mesh> meshes_;
  std::span<const Instance> instances_;
  std::vector<uint64_t> first_vertex_, first_triangle_;
  std::vector<bool> mirrored_;
  std::vector<std::optional<Double3>> offsets_;  // [instance] set for those that are far, after find_far()
};

/// All of it in memory, with a name.
Mesh flatten(const FlatScene& flat, const std::string& name);
inline Mesh flatten(const Scene& scene, const std::string& name) { return flatten(FlatScene(scene), name); }

}  // namespace nif::mesh
