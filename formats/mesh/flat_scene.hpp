// Merges a scene into one mesh: the triangles of each instance at their places, one instance after the other.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "formats/mesh/mesh_source.hpp"

namespace nif::mesh {

/// Positions of instances that stand where their mesh does are its own, to the bit; others are rounded once.
/// Mirrored instances have their triangles turned, so that they face as before.
class FlatScene : public MeshSource {
 public:
  /// Refers to the arrays, which must outlive it. Throws Error(too_large) where 32-bit indices do not reach.
  FlatScene(std::span<const Mesh> meshes, std::span<const Instance> instances);
  explicit FlatScene(const Scene& scene) : FlatScene(scene.meshes, scene.instances) {}

  uint64_t vertex_count() const override { return first_vertex_.back(); }
  uint64_t triangle_count() const override { return first_triangle_.back(); }
  void vertices(uint64_t first, std::span<Float3> out) const override;
  void exact(uint64_t first, std::span<Double3> out) const override;
  bool needs_doubles() const override;
  void triangles(uint64_t first, std::span<Triangle> out) const override;

  /// Finds instances that floats are too coarse for (far_from_origin.hpp). From then on exact() says of those with few
  /// digits where they stand, and of others as vertices().
  void find_far();
  bool far(size_t instance) const { return !offsets_.empty() && offsets_[instance].has_value(); }
  /// How far vertices() rounds those that are far, at most.
  double rounding() const;

  /// What is known of any of its meshes' colours, with white for all others.
  Appearance look() const;

  size_t instance_count() const { return mirrored_.size(); }
  /// Where the vertices and triangles of an instance start; [instances]: where they end.
  uint64_t first_vertex(size_t instance) const { return first_vertex_[instance]; }
  uint64_t first_triangle(size_t instance) const { return first_triangle_[instance]; }

 private:
  std::span<const Mesh> meshes_;
  std::span<const Instance> instances_;
  std::vector<uint64_t> first_vertex_, first_triangle_;
  std::vector<bool> mirrored_;
  std::vector<std::optional<Double3>> offsets_;  // [instance] of one that is far, once they were looked for
};

/// The whole of it in memory, under a name.
Mesh flatten(const FlatScene& flat, const std::string& name);
inline Mesh flatten(const Scene& scene, const std::string& name) { return flatten(FlatScene(scene), name); }

}  // namespace nif::mesh
