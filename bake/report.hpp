// Turns figures of a bake or an evaluation into JSON, for both `--json` and the asset's metadata.
#pragma once

#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <span>

#include "bake/bake.hpp"

namespace nif::bake {

class Encoder;

/// {"outer-lines": {"rays", "error", "leak", "spurious", "certain", "certain_wrong", "brier"}, ...}; rates
/// are fractions of the set's rays, certain_wrong is a count. Sets without rays are left out.
nlohmann::ordered_json to_json(const SetAccuracies& sets);

/// Adds "calibration_error" to each of these sets that has answers which are not certain, and with `bins` its
/// "calibration": for each tenth of the probabilities {"rays", "probability", "visible"} (docs/ray-sets.md).
void add_calibration(const SetAccuracies& sets, bool bins, nlohmann::ordered_json& json);

/// Adds "hits" to each of these sets whose first hits were measured (docs/ray-sets.md): rates are fractions
/// of the measured rays; percentiles have names.
void add_hits(const SetHitFigures& hits, nlohmann::ordered_json& sets);

/// {"outer-lines": 0.3, ...}: the sets that have a weight.
nlohmann::ordered_json to_json(const Mix& mix);

/// An object as `nif bake --json` reports it.
nlohmann::ordered_json to_json(const ObjectReport& object);

/// The asset's metadata: tool version, seed, resolved options, source hash, the measured figures of each
/// object, the nodes that the instances of a glTF stand for, and what was merged. It contains no path, thread
/// count or time, so that it depends only on the input and the options.
std::string make_metadata(const mesh::Scene& scene, const BakeOptions& options,
                          std::span<const std::unique_ptr<Encoder>> encoders, const BakeResult& result);

/// The form of mesh::Scene::source_hash in the metadata.
std::string source_hash_text(uint64_t hash);

/// Bytes of nodes and merged instances in it. Reads only what is placed from the result.
uint64_t scene_bytes(const mesh::Scene& scene, const BakeResult& result);

}  // namespace nif::bake
