// `nif bake --manifest`: bakes the assets that have changed, several at a time.
#pragma once

#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "formats/base/status.hpp"
#include "tools/batch/manifest.hpp"
#include "tools/batch/record.hpp"

namespace nif::tools {

struct BatchOptions {
  std::set<std::string> only;      ///< names of the assets to bake; empty: all
  uint32_t threads = 0;            ///< for all bakes together; 0: all cores
  uint64_t memory = 0;             ///< for all bakes together, in bytes; 0: four fifths of the free memory
  bool keep_going = false;         ///< continue after an asset fails
  bool force = false;              ///< also bake assets that are up to date
  uint32_t shard = 0, shards = 1;  ///< bake only the assets with numbers shard, shard + shards, ...
};

/// An asset of a batch and its outcome.
struct BatchItem {
  /// left: not started because another one failed
  enum class Outcome : uint8_t { current, baked, failed, left };

  BatchAsset asset;
  std::string reason;  ///< why it has to be baked; empty if it is up to date
  std::string record;  ///< version of the record that `reason` comes from: Records::version_of()
  Outcome outcome = Outcome::left;
  int code = 0;                   ///< if it failed: exit code of its bake
  std::string error;              ///< if it failed: one sentence
  nlohmann::ordered_json report;  ///< nifkit.bake/2; null if there is none
};
const char* name_of(BatchItem::Outcome outcome);

/// The error with which a command ends if this item failed: it has the code of the item's bake, or `internal`
/// if a signal killed that.
Error failure_of(const BatchItem& item);

/// Lists the assets of this shard, each with the reason to bake it. Reads a source only if its time does not
/// show whether it changed. Throws nif::Error: interrupted; malformed_manifest if `only` names something that
/// the manifest does not have.
std::vector<BatchItem> plan(const Manifest& manifest, const BatchOptions& options);

/// Bakes what plan() found, each asset in its own process, and writes the record of each as soon as it is
/// done, so that the next run continues after a crash, a cancel or a failure. Waits for assets that another
/// process bakes, and takes over its results. `progress` gets the fraction done and a text that says what is
/// being baked. Throws nif::Error(interrupted) once all processes have ended. A bake that fails does not
/// throw.
void bake_batch(const Manifest& manifest, const BatchOptions& options, std::vector<BatchItem>& items,
                const std::function<void(double, const std::string&)>& progress);

/// Upper estimate of what a bake of an asset needs: from the mesh file's size and kind, or from the last bake
/// plus a margin.
struct Needs {
  uint64_t memory;   ///< bytes
  uint32_t minutes;  ///< on one core
};
Needs needs_of(const BatchAsset& asset, const std::optional<BakeRecord>& last);

}  // namespace nif::tools
