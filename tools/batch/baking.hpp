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
  std::set<std::string> only;      ///< names of the assets that count; empty: all
  uint32_t threads = 0;            ///< of all bakes together; 0: all
  uint64_t memory = 0;             ///< for all bakes together, in bytes; 0: four fifths of what is free
  bool keep_going = false;         ///< after an asset that fails
  bool force = false;              ///< bakes what is up to date, too
  uint32_t shard = 0, shards = 1;  ///< does the assets number shard, shard + shards, ... of these
};

/// What became of an asset.
struct BatchItem {
  enum class Outcome : uint8_t { current, baked, failed, left };  ///< left: not begun, as another had failed

  BatchAsset asset;
  std::string reason;  ///< for baking it; empty where it is up to date
  std::string record;  ///< which record that was said by: Records::version_of()
  Outcome outcome = Outcome::left;
  int code = 0;                   ///< where it failed: exit code of its bake
  std::string error;              ///< where it failed: one sentence
  nlohmann::ordered_json report;  ///< nifkit.bake/1; null where there is none
};
const char* name_of(BatchItem::Outcome outcome);

/// The error by which a command ends whose item failed so: with the code of its bake, or `internal` where a
/// signal ended it.
Error failure_of(const BatchItem& item);

/// The assets of this shard, each with the reason for which it would be baked. Reads sources only as far as
/// their times do not tell. Throws nif::Error: interrupted; malformed_manifest where `only` names what the
/// manifest has not.
std::vector<BatchItem> plan(const Manifest& manifest, const BatchOptions& options);

/// Bakes what plan() has found, each in a process of its own, and keeps a record of each as soon as it is
/// done: after a crash, a cancel or a failure the next run goes on from there. Waits for assets that another
/// process bakes, and takes its results. `progress` hears the fraction done and what is in work. Throws
/// nif::Error(interrupted) once all processes have ended; a bake that fails is no exception.
void bake_batch(const Manifest& manifest, const BatchOptions& options, std::vector<BatchItem>& items,
                const std::function<void(double, const std::string&)>& progress);

/// What a bake of an asset will need at most: estimated by the file's size and kind, or what it took the last
/// time and some more.
struct Needs {
  uint64_t memory;   ///< bytes
  uint32_t minutes;  ///< on one core
};
Needs needs_of(const BatchAsset& asset, const std::optional<BakeRecord>& last);

}  // namespace nif::tools
