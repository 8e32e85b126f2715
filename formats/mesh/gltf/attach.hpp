// Attaches a baked asset to the glTF that it was baked from, with the extension NIF_visibility
// (docs/gltf-extension.md). The file is not rewritten: a few places of its JSON are edited, the asset is
// appended to its binary chunk, and every other byte stays the same. So removing the asset gives back the
// original file.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "formats/mesh/file_bytes.hpp"
#include "formats/mesh/file_pieces.hpp"

namespace nif::mesh {

inline constexpr const char* kVisibilityExtension = "NIF_visibility";

/// A node of the glTF, and the instance of the asset that represents its mesh.
struct AttachedNode {
  uint32_t node = 0;
  uint32_t instance = 0;
};

struct Attachment {
  std::span<const std::byte> asset;  ///< the bytes of a .nif, to be embedded; empty: `uri` refers to it
  std::string uri;                   ///< relative to the glTF, percent-encoded
  std::vector<AttachedNode> nodes;
};

/// A .gltf or .glb in memory, byte for byte.
class GltfFile {
 public:
  /// Loads it. Throws Error: what load_file() throws; not_a_mesh if its content is neither .gltf nor .glb,
  /// also if it is compressed.
  explicit GltfFile(std::filesystem::path file, uint64_t max_bytes);

  const std::filesystem::path& file() const { return file_; }
  std::string_view bytes() const { return bytes_.view(); }
  bool is_glb() const { return bytes().starts_with("glTF"); }

  // The rest requires a file whose bytes mesh::read() has read, so its JSON is valid glTF.

  /// URIs of buffers and images that name other files relative to this one.
  std::vector<std::string> relative_uris() const;
  bool has_attachment() const;

  /// The file with an asset attached, which replaces an existing one. The pieces refer to this object and to
  /// the attachment. Throws Error: malformed_mesh if a part of the JSON that has to be changed has a type
  /// that glTF does not allow, or holds an attachment that is not ours; too_large beyond the 4 GiB of a .glb;
  /// usage if an asset is to be embedded and there is no binary chunk for it.
  FilePieces with(const Attachment& attachment) const;

  /// The file without its attachment. If `nif attach` made it and nobody has changed the file since, this is
  /// byte for byte the original; without an attachment, it is the file itself. Throws as with() does.
  FilePieces without() const;

 private:
  std::filesystem::path file_;
  detail::ByteBuffer bytes_;
};

namespace detail {

/// without() for a file in memory that a parser has read. Never throws because of a file's content: if the
/// attachment cannot be removed, it returns the file unchanged.
FilePieces without_attachment(const std::filesystem::path& file, std::string_view bytes);

}  // namespace detail

}  // namespace nif::mesh
