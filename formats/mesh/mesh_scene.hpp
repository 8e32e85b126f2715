// Defines triangle meshes and their instances, which every reader of formats/mesh fills, and cameras and
// lights for formats that have them.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <iterator>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "formats/base/vector.hpp"
#include "formats/mesh/alpha.hpp"
#include "formats/mesh/appearance.hpp"
#include "formats/mesh/clip.hpp"
#include "formats/mesh/merging.hpp"
#include "formats/mesh/mesh_choice.hpp"

namespace nif::mesh {

// Notes of readers about a file: what they left out, and how they read what can be read in several ways.

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
  see_through,        ///< glTF, OBJ: materials that let light through, where triangles block all of it
  pictures,           ///< glTF, OBJ: a picture that cannot be read
  fixtures,           ///< cameras and lights
  volumes,            ///< OpenVDB: grids that are not level sets
  // Remarks: nothing was lost.
  bind_pose,          ///< glTF: skins, read in the bind pose
  morphs,             ///< glTF: morph targets, read with the weights of the file
  pose,               ///< glTF: skins, read in another pose than the bind pose; vertices without weights
  clips,              ///< glTF: animations that cannot be read, where they are listed
  hidden,             ///< glTF: nodes hidden by KHR_node_visibility
  helpers,            ///< names of collision shapes and of levels of detail
  clear,              ///< glTF, OBJ: triangles that block nothing, because their material lets light through
  materials,          ///< OBJ: a file of materials that cannot be read
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

using Float3 = std::array<float, 3>;
using Triangle = std::array<uint32_t, 3>;  ///< indices into Mesh::positions

/// Row-major 3x4 affine transform from object to world space: world = rows[.][0..2] * p + rows[.][3].
using Transform = std::array<float, 12>;
inline constexpr Transform kIdentity{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};

struct Skin;  // formats/mesh/skin.hpp

/// One object's triangles. Winding as in the file; positions are not welded.
struct Mesh {
  std::string name;  ///< UTF-8, from the file; the file's stem if it has none
  std::vector<Float3> positions;
  std::vector<Triangle> triangles;
  float part_side = 0;  ///< for a merged mesh: the longest side of its median part by size; otherwise 0
  bool merged() const { return part_side > 0; }
  Appearance look{};  ///< only if requested: ReadLimits::colors
  /// [triangles], only if requested: ReadLimits::alpha. Empty: all are solid.
  std::vector<TriangleAlpha> alpha{};
  AlphaMaps alpha_maps{};  ///< in use by `holes`, each once
  /// [triangles]; empty: none has holes. Only triangles that are `cut` have some. A triangle that is `cut` without
  /// holes has holes that are not known exactly: it blocks as if solid.
  std::vector<TriangleHoles> holes{};
  /// How it bends, only if requested: ReadLimits::skins. Null: it does not.
  std::shared_ptr<const Skin> skin{};
  /// Only within readers, and only if requested (Input::exact): positions before rounding.
  std::vector<Double3> exact{};
};

/// One placement of a mesh. Transforms may scale non-uniformly and mirror.
struct Instance {
  std::string name;   ///< the node's name, or else the mesh's
  uint32_t mesh = 0;  ///< index into Scene::meshes
  Transform transform = kIdentity;
  uint32_t node = kNoNode;  ///< index into Scene::nodes of its node, or kNoNode
  bool moves = false;       ///< with its node (see there), or by the joints of a skin
  Double3 remainder{};      ///< rounding error of the transform's translation, to be added to it
  bool deforms = false;     ///< its mesh has a skin or morph targets
};

/// The joints of a skin of a glTF.
struct SkinJoints {
  uint32_t number = 0;  ///< index into the skins of the file, as Skin::number
  struct Joint {
    uint32_t node = 0;  ///< index into the nodes of the file
    /// Row-major 3x4: from the world, as the scene was read, to the space in which meshes are bound. Nothing: it has no inverse.
    std::optional<std::array<double, 12>> to_bound;
  };
  std::vector<Joint> joints;
};

/// A node of a glTF. The transforms of the instances include its transform.
struct Node {
  uint32_t number = 0;        ///< index into the nodes of the file
  std::string name;           ///< may be empty
  uint32_t parent = kNoNode;  ///< index into Scene::nodes, below its own; kNoNode: a root
  bool moves = false;         ///< an animation of the file or its physics moves it or an ancestor
  bool moves_itself = false;  ///< it, not only an ancestor
};

/// A perspective camera at its transform's origin. It looks along -z, with +y up.
struct Camera {
  std::string name;  ///< the node's name, or else the camera's; may be empty
  Transform transform = kIdentity;
  double vertical_fov = 0;  ///< vertical field of view in radians, above 0 and below pi
};

/// A light without extent at its transform's origin. It shines along -z. As in glTF, a transform's scale
/// changes neither intensity nor cone.
struct Light {
  enum class Kind : uint8_t { directional = 0, point = 1, spot = 2 };

  Kind kind = Kind::point;
  std::string name;  ///< the node's name, or else the light's; may be empty
  Transform transform = kIdentity;
  Float3 colour{1, 1, 1};  ///< linear RGB with the primaries of sRGB, not negative
  /// Multiplied by the colour, not negative: irradiance on a surface that faces a directional light (lux),
  /// otherwise intensity per steradian (candela).
  double intensity = 1;
  /// Of a spot, radians from its axis: full light within inner, none outside outer; 0 <= inner <= outer <= pi
  /// / 2.
  double inner_cone = 0, outer_cone = 0;
};

/// A whole input file. Every mesh has at least one instance, or none has: then the scene places nothing.
struct Scene {
  std::vector<Mesh> meshes;
  std::vector<Instance> instances;
  std::vector<Material> materials;  ///< used by Mesh::look
  std::vector<Texture> textures;    ///< used by the materials
  std::vector<Node> nodes;          ///< for glTF: those of the instances, and all their ancestors
  std::vector<Camera> cameras;      ///< for glTF, in the order of the hierarchy; other formats have none
  std::vector<Light> lights;        ///< likewise, from KHR_lights_punctual
  std::vector<Clip> clips;          ///< animations of glTF, with ReadLimits::clips
  std::vector<SkinJoints> skins;    ///< for glTF, with ReadLimits::skins: those that meshes have
  /// XXH3-64 of the bytes of the file (decompressed) and of its buffers; for a glTF with an attached asset,
  /// of the original file without it.
  uint64_t source_hash = 0;
  std::vector<std::string>
      files;                ///< all files that were read: the file itself, its buffers, and its pictures
  std::vector<Note> notes;  ///< what was left out and why
  Choice choice;            ///< with which it was read
  AlphaOptions alpha;       ///< likewise
  std::vector<MaterialAlpha> see_through;  ///< materials that may let light through, if alpha was read
  std::optional<Merging> merging;          ///< if instances of the file have been merged
};

}  // namespace nif::mesh
