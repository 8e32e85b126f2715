// Reads the outer layers of glTF: the GLB container, the JSON text and the buffers, checked before tinygltf
// sees them.
#pragma once

#include <deque>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "formats/mesh/gltf/fixtures.hpp"
#include "formats/mesh/input.hpp"

namespace nif::mesh::detail {

/// The parts of a container that the reader uses: views into Input::bytes.
struct GltfContainer {
  std::string_view text;                   ///< JSON, with the padding of a GLB; for a .gltf the whole file
  std::optional<std::string_view> binary;  ///< the binary chunk of a GLB, with its padding
  uint64_t length = 0;                     ///< for a GLB, the length in its header; the file may be longer
};

/// Throws file_truncated, malformed_mesh, or not_a_mesh for a GLB of another version.
GltfContainer open_container(const Input& input);

/// Deforms a mesh by its joints.
struct GltfSkin {
  std::vector<size_t> joints;      ///< nodes; empty if the skin is malformed
  int inverse_bind_matrices = -1;  ///< an accessor; -1: all are the identity
};

/// All skins of a document. Throws only bad_alloc, whatever the document contains.
std::vector<GltfSkin> read_skins(const nlohmann::json& root);

/// What moves a property of a node.
struct GltfChannel {
  enum class Path : uint8_t { translation, rotation, scale, weights };
  enum class Interpolation : uint8_t { linear, step, cubic_spline };

  size_t node = 0;
  Path path = Path::translation;
  Interpolation interpolation = Interpolation::linear;
  int times = -1, values = -1;  ///< accessors
};

struct GltfClip {
  std::string name;
  std::vector<GltfChannel> channels;
  bool malformed = false;  ///< channels that move a node were left out, because they cannot be read
};

/// All animations of a document, with the channels that move or deform nodes, also by KHR_animation_pointer. Throws
/// only bad_alloc, whatever the document contains.
std::vector<GltfClip> read_clips(const nlohmann::json& root);

/// The nodes that are targets of a document's animations, including those of KHR_animation_pointer, and those
/// that its physics moves. Throws only bad_alloc, whatever the document contains.
std::set<size_t> read_moving_nodes(const nlohmann::json& root);

/// Where the target of a channel points by KHR_animation_pointer, if that is in a node: the node's number, and the rest of
/// the pointer, such as "/translation", which lives as long as `target`.
std::optional<std::pair<size_t, std::string_view>> pointed_node(const nlohmann::json& target);

/// Null if `object` is not an object or has no such member.
const nlohmann::json* member(const nlohmann::json& object, const char* name);

/// What a material says of its base colour. Null: nothing.
struct GltfBaseColor {
  const nlohmann::json *factor = nullptr, *texture = nullptr;
};

/// Of KHR_materials_pbrSpecularGlossiness if the material has that, otherwise of pbrMetallicRoughness, which is then only
/// for readers that do not know the extension.
GltfBaseColor base_color_of(const nlohmann::json& material);

/// The first 128 bytes of a name that may be used by many things: any number of nodes can refer to one mesh,
/// camera or light, and each of them gets its name.
std::string short_name(std::string_view name);

/// Stand for an image that only an extension refers to, and for one that the file does not have.
inline constexpr int kInExtension = -2, kNoSuchImage = -3;

/// A material's base colour.
struct GltfMaterial {
  Material material;  ///< its texture is set later
  /// Index into GltfLook::images; -1: none; other negative values: one that is not available.
  int image = -1;
  int coordinates = 0;  ///< TEXCOORD_n
};

struct GltfImage {
  int view = -1;    ///< a buffer view; -1: at the URI
  std::string uri;  ///< of a file beside the glTF, or a data URI
};

struct GltfLook {
  std::vector<GltfMaterial> materials;
  std::vector<GltfImage> images;
};

/// The look of a document. Malformed members count as absent. Throws only bad_alloc, whatever the document
/// contains.
GltfLook read_look(const nlohmann::json& root);

/// The properties of a material that decide whether it lets light through, and its name.
struct GltfSurface {
  enum class Alpha : uint8_t { opaque, mask, blend };

  std::string name;
  Alpha alpha = Alpha::opaque;
  double cutoff = 0.5, factor = 1;
  bool textured = false;   ///< its base colour has a texture, which may have alpha
  bool transmits = false;  ///< KHR_materials_transmission

  /// Whether any part of it may let light through: `colors_have_alpha` is for the vertex colours.
  bool lets_light_through(bool colors_have_alpha) const;
};

/// In GltfSource::json, a primitive's indices are an attribute with this name, because tinygltf refuses files
/// with indices that have no buffer view, which are empty or sparse.
inline constexpr const char* kIndicesAttribute = "_NIFKIT_INDICES";

/// All materials of a document. Malformed members count as absent. Throws only bad_alloc.
std::vector<GltfSurface> read_surfaces(const nlohmann::json& root);

struct GltfSource {
  std::string json;  ///< reduced to what the geometry depends on

  /// One for each buffer of the file; empty if a buffer has no data of its own, like the fallbacks of
  /// compression extensions.
  std::vector<std::optional<std::string_view>> buffers;

  std::deque<std::string> owned;      ///< memory that the views point into, unless that is the file
  std::vector<GltfFixture> fixtures;  ///< cameras and lights, by node
  std::vector<GltfSkin> skins;
  std::set<size_t> moving;            ///< numbers of nodes
  std::vector<GltfClip> clips;        ///< with ReadLimits::clips or moment
  GltfLook look;                      ///< with ReadLimits::colors or alpha
  std::vector<GltfSurface> surfaces;  ///< [material]
  std::vector<Note> notes;
};

/// Throws an Error for everything that prevents a file from being read, including missing buffers and
/// extensions. Appends the files of external buffers to `external`.
GltfSource open_gltf(const Input& input, std::vector<ExternalFile>& external);

}  // namespace nif::mesh::detail
