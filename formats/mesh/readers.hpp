// Declares the readers of all formats, and the checks that they share. Internal to formats/mesh.
#pragma once

#include <functional>
#include <span>
#include <string>
#include <vector>

#include "formats/mesh/hole_collector.hpp"
#include "formats/mesh/input.hpp"

namespace nif::mesh::detail {

Scene read_ply(const Input& input);
Scene read_stl(const Input& input);
Scene read_obj(const Input& input);
Scene read_off(const Input& input);
Scene read_draco(const Input& input);

/// Appends the files of external buffers to `external`, in the order of the file.
Scene read_gltf(const Input& input, std::vector<ExternalFile>& external);

/// Returns true if the bytes can only be an STL file, text or binary.
bool looks_like_stl(std::string_view bytes);

struct DracoData {
  std::string_view bytes;
  std::string where;     ///< the beginning of an error message
  int position_id = -1;  ///< unique id of the attribute to read; -1: the one that is marked as the position
  bool normalized = false;  ///< integer components represent fractions
};

/// Decodes a Draco mesh and appends it to `mesh`.
void append_draco(const Input& input, const DracoData& data, Mesh& mesh);

/// Adds meshes to a scene, each placed once, untransformed. Meshes without triangles are left out.
Scene scene_of(std::vector<Mesh> meshes, Scene scene = {});

/// Makes names valid UTF-8, then throws unless every index is in range, every used vertex is finite and there
/// is at least one triangle.
void check(const Input& input, Scene& scene);

/// Drops the triangles of a mesh for which `keeps(index)` is false, with what the mesh knows of each. Returns how many
/// were dropped.
template <class Keeps>
uint64_t keep_triangles(Mesh& mesh, const Keeps& keeps) {
  size_t kept = 0;
  for (size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (!keeps(t)) continue;
    mesh.triangles[kept] = mesh.triangles[t];
    if (!mesh.look.materials.empty()) mesh.look.materials[kept] = mesh.look.materials[t];
    if (!mesh.alpha.empty()) mesh.alpha[kept] = mesh.alpha[t];
    if (!mesh.holes.empty()) mesh.holes[kept] = mesh.holes[t];
    ++kept;
  }
  const uint64_t dropped = mesh.triangles.size() - kept;
  mesh.triangles.resize(kept);
  if (!mesh.look.materials.empty()) mesh.look.materials.resize(kept);
  if (!mesh.alpha.empty()) mesh.alpha.resize(kept);
  if (!mesh.holes.empty()) mesh.holes.resize(kept);
  if (dropped != 0) drop_unused_maps(mesh);
  return dropped;
}

/// Names come from files in any encoding and go into JSON and to terminals: removes control characters.
std::string clean_name(std::string_view name);

/// Throws too_large.
[[noreturn]] void fail_triangle_limit(const Input& input);

/// Throws too_large if this number of triangles exceeds the limit.
inline void check_triangle_limit(const Input& input, uint64_t count) {
  if (count > input.limits.max_triangles) fail_triangle_limit(input);
}

/// Adds the faces of a file to a mesh as triangles, within the limits.
class FaceSink {
 public:
  FaceSink(const Input& input, Mesh& mesh) : input_(input), mesh_(mesh) {}

  /// Adds a polygon as a fan around its first corner, which is correct for a convex one. Its corners may be
  /// vertices that come later.
  void polygon(std::span<const uint32_t> corners) {
    if (corners.size() != 3) return fan(corners);
    check_triangle_limit(input_, mesh_.triangles.size() + 1);
    mesh_.triangles.push_back({corners[0], corners[1], corners[2]});
  }

  /// To be called once all positions are known: triangulates polygons that are not convex, in place. Adds
  /// notes to the scene about faces that were left out or are not valid polygons. `name_of` returns the name
  /// of the object of a triangle.
  void settle(Scene& scene, const std::function<std::string_view(uint64_t triangle)>& name_of);

 private:
  /// Consecutive polygons with the same number of corners.
  struct Run {
    uint64_t first_triangle;
    uint32_t corners, count;
  };
  void fan(std::span<const uint32_t> corners);
  void remember(size_t corners);

  const Input& input_;
  Mesh& mesh_;
  uint64_t skipped_ = 0;
  std::vector<Run> runs_;  // those of four or more corners
};

}  // namespace nif::mesh::detail
