// The outer layers of glTF: the GLB container, the JSON text and the buffers, checked before tinygltf sees
// them.
#pragma once

#include <deque>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "formats/mesh/gltf/fixtures.hpp"
#include "formats/mesh/input.hpp"

namespace nif::mesh::detail {

/// What the reader takes of a container: views into Input::bytes.
struct GltfContainer {
  std::string_view text;                   ///< JSON, with the padding of a GLB; the whole of a .gltf
  std::optional<std::string_view> binary;  ///< the binary chunk of a GLB, with its padding
  uint64_t length = 0;                     ///< of a GLB, as its header says; the file may be longer
};

/// Throws file_truncated, malformed_mesh, or not_a_mesh for a GLB of another version.
GltfContainer open_container(const Input& input);

/// What moves a mesh with its joints.
struct GltfSkin {
  std::vector<size_t> joints;      ///< nodes; none where the skin is malformed
  int inverse_bind_matrices = -1;  ///< an accessor; -1: all are the identity
};

/// Of all skins of a document. Throws nothing but bad_alloc, whatever the document holds.
std::vector<GltfSkin> read_skins(const nlohmann::json& root);

/// The nodes that animations of a document have as targets, also by KHR_animation_pointer. Throws nothing but
/// bad_alloc, whatever the document holds.
std::set<size_t> read_animated_nodes(const nlohmann::json& root);

/// Null where `object` is not an object, or has no such member.
const nlohmann::json* member(const nlohmann::json& object, const char* name);

/// The first 128 bytes of a name that may be that of many things: any number of nodes can name one mesh,
/// camera or light, and each of them gets its name.
std::string short_name(std::string_view name);

/// A material's base colour.
struct GltfMaterial {
  Material material;    ///< its texture is not known yet
  int image = -1;       ///< index into GltfLook::images; -1: none; others below 0: one that cannot be had
  int coordinates = 0;  ///< TEXCOORD_n
};

struct GltfImage {
  int view = -1;    ///< a buffer view; -1: at the URI
  std::string uri;  ///< of a file beside the glTF, or with the bytes
};

struct GltfLook {
  std::vector<GltfMaterial> materials;
  std::vector<GltfImage> images;
};

/// Of a document. What is malformed counts as not said. Throws nothing but bad_alloc, whatever the document
/// holds.
GltfLook read_look(const nlohmann::json& root);

/// What of a material decides whether it lets light through, and its name.
struct GltfSurface {
  enum class Alpha : uint8_t { opaque, mask, blend };

  std::string name;
  Alpha alpha = Alpha::opaque;
  double cutoff = 0.5, factor = 1;
  bool textured = false;   ///< its base colour has a picture, which may have alpha
  bool transmits = false;  ///< KHR_materials_transmission

  /// Whether it may, somewhere: `colors_have_alpha` is of the vertices.
  bool lets_light_through(bool colors_have_alpha) const;
};

/// The name under which a primitive of GltfSource::json has its indices among its attributes: tinygltf
/// refuses files with indices that have no buffer view, which are empty or sparse.
inline constexpr const char* kIndicesAttribute = "_NIFKIT_INDICES";

/// Of all materials of a document. What is malformed counts as not said. Throws nothing but bad_alloc.
std::vector<GltfSurface> read_surfaces(const nlohmann::json& root);

struct GltfSource {
  std::string json;  ///< reduced to what the geometry depends on

  /// One for each buffer of the file; none where a buffer has no data of its own, as the fallbacks of
  /// compression extensions do.
  std::vector<std::optional<std::string_view>> buffers;

  std::deque<std::string> owned;      ///< what the views point into, where it is not the file itself
  std::vector<GltfFixture> fixtures;  ///< cameras and lights, by node
  std::vector<GltfSkin> skins;
  std::set<size_t> animated;          ///< nodes
  GltfLook look;                      ///< with ReadLimits::colors
  std::vector<GltfSurface> surfaces;  ///< [material]
  std::vector<Note> notes;
};

/// Throws an Error for everything that keeps a file from being read, missing buffers and extensions included.
/// Appends the files of external buffers to `external`.
GltfSource open_gltf(const Input& input, std::vector<ExternalFile>& external);

}  // namespace nif::mesh::detail
