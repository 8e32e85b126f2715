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

/// A node of the glTF, and the instance of the asset that stands for its mesh.
struct AttachedNode {
  uint32_t node = 0;
  uint32_t instance = 0;
};

struct Attachment {
  std::span<const std::byte> asset;  ///< the bytes of a .nif, to be embedded; empty: named by `uri`
  std::string uri;                   ///< relative to the glTF, with percent signs where URIs want them
  std::vector<AttachedNode> nodes;
};

/// A .gltf or .glb in memory, as it lies on the disk.
class GltfFile {
 public:
  /// Loads it. Throws Error: what load_file() throws; not_a_mesh where it is neither .gltf nor .glb by its
  /// content, compressed ones included.
  explicit GltfFile(std::filesystem::path file, uint64_t max_bytes);

  const std::filesystem::path& file() const { return file_; }
  std::string_view bytes() const { return bytes_.view(); }
  bool is_glb() const { return bytes().starts_with("glTF"); }

  // The rest is for a file whose bytes mesh::read() has read: its JSON is JSON, and glTF.

  /// URIs of buffers and images that name other files relative to this one.
  std::vector<std::string> relative_uris() const;
  bool has_attachment() const;

  /// The file with an asset attached, in place of one that is. The pieces refer to this object and to the
  /// attachment. Throws Error: malformed_mesh where a place of the JSON that is to be changed is of a type
  /// that glTF does not allow, or holds an attachment that is none of ours; too_large beyond the 4 GiB of a
  /// .glb; usage for an asset to be embedded into what has no binary chunk to take it.
  FilePieces with(const Attachment& attachment) const;

  /// The file without its attachment: where `nif attach` made it and nobody has changed the file since, byte
  /// for byte what it was before; the file as it is where it has none. Throws as with().
  FilePieces without() const;

 private:
  std::filesystem::path file_;
  detail::ByteBuffer bytes_;
};

namespace detail {

/// without() for a file in memory that a parser has read; it throws nothing for what a file holds: one whose
/// attachment cannot be taken out is given as it is.
FilePieces without_attachment(const std::filesystem::path& file, std::string_view bytes);

}  // namespace detail

}  // namespace nif::mesh
