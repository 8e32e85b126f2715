// Manifests of `nif bake --manifest`: which meshes become which assets, and how (docs/batches.md).
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace nif::tools {

/// An asset to bake.
struct BatchAsset {
  std::string mesh, output;  ///< paths that can be opened
  std::string name;  ///< the output relative to the manifest's folder: printed, and the same on every machine
  std::vector<std::string>
      options;  ///< options of `nif bake` that determine the asset's bytes, sorted by name
};

struct Manifest {
  std::string file;                ///< as given
  std::filesystem::path state;     ///< folder for the records of earlier bakes
  std::vector<BatchAsset> assets;  ///< in the order of the file, and within an entry by name
};

/// Reads a manifest and lists the files that its patterns match. Throws nif::Error: malformed_manifest with
/// file, line and key, also for contradictions (two meshes for one output, an output that is a mesh of the
/// manifest, contradictory options); and the codes for files that cannot be read.
Manifest read_manifest(const std::string& file);

}  // namespace nif::tools
