// Records of each asset's last bake, so that it is not baked again if nothing has changed.
#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "tools/batch/manifest.hpp"

namespace nif::tools {

/// A file as it was: its content by hash, and what tells without reading it that it is still the same.
struct FileState {
  std::string path;  ///< as it can be opened from the manifest's folder, or absolute
  uint64_t size = 0;
  int64_t modified = 0;  ///< ns since the epoch; 0: too fresh to tell by it, so the content counts
  std::string hash;      ///< XXH3-128 of the bytes, in hexadecimal
};

/// One asset's record: a file in the manifest's state folder, which is there only after the asset itself.
struct BakeRecord {
  std::string version;               ///< of the program
  std::vector<std::string> options;  ///< BatchAsset::options
  std::vector<FileState> sources;    ///< all files that were read
  FileState asset;
  nlohmann::ordered_json report;  ///< nifkit.bake/1
};

/// The state of a file now; nothing where it is not there or cannot be read. Where `known` has the same size
/// and time of change, its hash is taken over, and the file is not read.
std::optional<FileState> state_of(const std::filesystem::path& folder, const std::string& path,
                                  const FileState* known = nullptr);

/// What the file system says of a file, that changes with it; empty where there is none.
std::string stamp_of(const std::filesystem::path& file);

/// Records of a manifest's assets, in its state folder.
class Records {
 public:
  explicit Records(const Manifest& manifest);

  /// Nothing where there is none, or it is damaged: then the asset is baked.
  std::optional<BakeRecord> load(const BatchAsset& asset) const;
  /// Another word once another record is there; empty where there is none.
  std::string version_of(const BatchAsset& asset) const;
  /// Whole or not at all. Throws nif::Error(output_not_writable).
  void store(const BatchAsset& asset, const BakeRecord& record) const;

  /// Why an asset has to be baked; empty where it is up to date. A file with other times but the same content
  /// is the same.
  std::string why_stale(const BatchAsset& asset, const std::optional<BakeRecord>& record) const;

  /// Of a mesh just baked: `report` names the files that were read.
  BakeRecord make(const BatchAsset& asset, nlohmann::ordered_json report) const;

  /// In the state folder, of this asset alone: its name with another ending.
  std::filesystem::path path_for(const BatchAsset& asset, const std::string& ending) const;

 private:
  std::filesystem::path folder_, state_;
};

}  // namespace nif::tools
