// Figures of a bake or an evaluation as JSON: the forms that `--json` and the asset's metadata share.
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

/// {"outer-lines": 0.3, ...}: the sets that have a weight.
nlohmann::ordered_json to_json(const Mix& mix);

/// An object as `nif bake --json` reports it.
nlohmann::ordered_json to_json(const ObjectReport& object);

/// The asset's metadata: tool version, seed, resolved options, source hash, for each object what was
/// measured, of a glTF the nodes that its instances stand for, and what was merged. No path, thread count or
/// time, so that it depends on nothing but the input and the options.
std::string make_metadata(const mesh::Scene& scene, const BakeOptions& options,
                          std::span<const std::unique_ptr<Encoder>> encoders, const BakeResult& result);

/// How the metadata states mesh::Scene::source_hash.
std::string source_hash_text(uint64_t hash);

/// What nodes and merged instances take of it. Of the result only what is placed is asked.
uint64_t scene_bytes(const mesh::Scene& scene, const BakeOptions& options, const BakeResult& result);

}  // namespace nif::bake
