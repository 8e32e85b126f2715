// Examines an asset as closely as possible without its mesh.
#pragma once

#include <cstddef>
#include <span>
#include <string_view>

#include "formats/nif/reader.hpp"
#include "formats/validate/findings.hpp"

namespace nif::validate {

/// Takes all bytes of a file, at an address that is a multiple of format::kAddressAlignment. Safe on any
/// bytes.
///
/// Structural rules build on one another, so only the first broken one is found, except that all wrong
/// checksums of sections are. Metadata and the model are checked if no rule is broken. Throws only
/// std::bad_alloc; memory is bounded by a multiple of the file's size.
Findings validate(std::span<const std::byte> bytes, std::string_view file_name);

/// The single checks, for an asset that has been read.
void check_metadata(const format::AssetView& asset, Findings& findings);
void check_model(const format::AssetView& asset, Findings& findings);

}  // namespace nif::validate
