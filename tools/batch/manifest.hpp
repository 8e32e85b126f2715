// Manifests of `nif bake --manifest`: which meshes become which assets, and how (docs/batches.md).
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace nif::tools {

/// One asset to be baked.
struct BatchAsset {
  std::string mesh, output;  ///< paths that can be opened
  std::string name;  ///< of the output, from the manifest's folder: what is printed, and the same anywhere
  std::vector<std::string>
      options;  ///< of `nif bake`, that decide the asset's bytes, in the order of their names
};

struct Manifest {
  std::string file;                ///< as given
  std::filesystem::path state;     ///< folder for what is known of earlier bakes
  std::vector<BatchAsset> assets;  ///< in the order of the file, and within an entry by name
};

/// Reads a manifest and lists the files that its patterns match. Throws nif::Error: malformed_manifest with
/// file, line and key, for what contradicts itself, too (two meshes for one output, an output that is a mesh
/// of the manifest, options that contradict each other); the codes of a file that cannot be read.
Manifest read_manifest(const std::string& file);

}  // namespace nif::tools
