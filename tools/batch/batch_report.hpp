// Reports of what a batch did: JSON for programs, HTML for people.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <vector>

#include "tools/batch/baking.hpp"

namespace nif::tools {

inline constexpr const char* kBatchSchema = "nifkit.batch/1";

/// docs/batches.md explains the fields of the schema.
nlohmann::ordered_json to_json(const Manifest& manifest, std::span<const BatchItem> items, double seconds);

/// Makes missing pictures of a report in the manifest's state folder, each by `nif render`. Pictures that
/// cannot be made are left out. Throws nif::Error(interrupted).
void make_thumbnails(const Manifest& manifest, std::span<const BatchItem> items,
                     const std::function<void(double, const std::string&)>& progress);

/// One self-contained page: a table of the assets with their pictures, sizes and errors. Failed assets come
/// first.
std::string to_html(const Manifest& manifest, std::span<const BatchItem> items);

}  // namespace nif::tools
