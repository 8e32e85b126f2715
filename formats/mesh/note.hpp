// Notes of readers about a file: what they left out, and how they read what can be read in several ways.
#pragma once

#include <algorithm>
#include <cstdint>
#include <iterator>
#include <span>
#include <string>
#include <vector>

namespace nif::mesh {

/// docs/meshes.md, "What is not kept", lists them by format. Kinds before bind_pose are losses: some part of
/// the file was not read or not kept. `--strict` refuses files with a loss.
enum class NoteKind : uint8_t {
  short_faces,        ///< faces with fewer than three corners
  non_finite_faces,   ///< triangles that use a vertex that is not finite, if these are dropped
  rounding,           ///< coordinates that floats cannot represent
  crossing_polygons,  ///< OBJ, PLY, OFF: polygons whose outline crosses itself
  curves,             ///< OBJ: points, lines, curves and surfaces
  bytes_after_end,    ///< STL: bytes after the triangles that are not triangles
  points_and_lines,   ///< glTF: primitives that are not triangles, or have no positions
  loose_indices,      ///< glTF: indices after the last complete triangle
  colors,             ///< glTF: colours or texture coordinates
  draco_morphs,       ///< glTF: morph targets of Draco data
  posed_skin,         ///< glTF: joints or weights that cannot be read
  hidden_mesh,        ///< glTF: a mesh that is not in the scene
  gpu_instances,      ///< glTF: EXT_mesh_gpu_instancing of a skinned mesh
  flattened,          ///< glTF: instances that a transform leaves without area
  empty_primitives,   ///< glTF: primitives without a vertex or an index
  see_through,        ///< glTF: materials that let light through
  pictures,           ///< glTF: a picture that cannot be read
  fixtures,           ///< cameras and lights
  volumes,            ///< OpenVDB: grids that are not level sets
  // Remarks: nothing was lost.
  bind_pose,          ///< glTF: skins, read in the bind pose
  morphs,             ///< glTF: morph targets, read with the weights of the file
  pose,               ///< glTF: skins, read in another pose than the bind pose
  hidden,             ///< glTF: nodes hidden by KHR_node_visibility
  helpers,            ///< names of collision shapes and of levels of detail
  bent_polygons,      ///< OBJ, PLY, OFF: polygons of five or more corners that are far from flat
  counted_by_length,  ///< STL: triangles after those that the header counts
};
inline constexpr size_t kNoteKinds = size_t(NoteKind::counted_by_length) + 1;

/// Whether some part of the file was not read or not kept.
constexpr bool is_loss(NoteKind kind) { return kind < NoteKind::bind_pose; }

struct Note {
  NoteKind kind;
  std::string text;  ///< one sentence, which begins with the file's name
};

inline std::vector<std::string> texts_of(std::span<const Note> notes) {
  std::vector<std::string> texts;
  std::ranges::transform(notes, std::back_inserter(texts), &Note::text);
  return texts;
}

}  // namespace nif::mesh
