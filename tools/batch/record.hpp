// Records each asset's last bake, so that it is not baked again if nothing has changed.
#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "tools/batch/manifest.hpp"

namespace nif::tools {

/// A file's state: a hash of its content, and size and time, which show without reading it that it is
/// unchanged.
struct FileState {
  std::string path;  ///< as it can be opened from the manifest's folder, or absolute
  uint64_t size = 0;
  int64_t modified = 0;  ///< ns since the epoch; 0: too recent to rely on, so the content decides
  std::string hash;      ///< XXH3-128 of the bytes, in hexadecimal
};

/// One asset's record: a file in the manifest's state folder, written only after the asset itself.
struct BakeRecord {
  std::string version;               ///< of the program
  std::vector<std::string> options;  ///< BatchAsset::options
  std::vector<FileState> sources;    ///< all files that were read
  FileState asset;
  nlohmann::ordered_json report;  ///< nifkit.bake/2
};

/// The state of a file now; nothing if it does not exist or cannot be read. If `known` has the same size and
/// time of change, its hash is reused and the file is not read.
std::optional<FileState> state_of(const std::filesystem::path& folder, const std::string& path,
                                  const FileState* known = nullptr);

/// A text made of file system attributes that changes when the file does; empty if there is no file.
std::string stamp_of(const std::filesystem::path& file);

/// Records of a manifest's assets, in its state folder.
class Records {
 public:
  explicit Records(const Manifest& manifest);

  /// Returns nothing if there is no record or it is damaged: then the asset is baked.
  std::optional<BakeRecord> load(const BatchAsset& asset) const;
  /// Returns a text that differs once the record is replaced; empty if there is none.
  std::string version_of(const BatchAsset& asset) const;
  /// Writes it whole or not at all. Throws nif::Error(output_not_writable).
  void store(const BatchAsset& asset, const BakeRecord& record) const;

  /// Why an asset has to be baked; empty if it is up to date. A file whose times changed but whose content
  /// did not counts as unchanged.
  std::string why_stale(const BatchAsset& asset, const std::optional<BakeRecord>& record) const;

  /// Makes the record of an asset that was just baked: `report` names the files that were read.
  BakeRecord make(const BatchAsset& asset, nlohmann::ordered_json report) const;

  /// A path in the state folder for this asset alone: its name with another ending.
  std::filesystem::path path_for(const BatchAsset& asset, const std::string& ending) const;

 private:
  std::filesystem::path folder_, state_;
};

}  // namespace nif::tools
