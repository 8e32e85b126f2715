// Looks at an asset as closely as can be done without its mesh.
#pragma once

#include <cstddef>
#include <span>
#include <string_view>

#include "formats/nif/reader.hpp"
#include "formats/validate/findings.hpp"

namespace nif::validate {

/// All bytes of a file, at an address that is a multiple of format::kAddressAlignment. Safe on any bytes.
///
/// Rules of the structure build on one another, so of those the first that is broken is the only one found;
/// but all wrong checksums of sections are. Metadata and the model are looked at where no rule is broken.
/// Throws only std::bad_alloc; memory is bounded by a multiple of the file's size.
Findings validate(std::span<const std::byte> bytes, std::string_view file_name);

/// The parts of it, for an asset that has been read.
void check_metadata(const format::AssetView& asset, Findings& findings);
void check_model(const format::AssetView& asset, Findings& findings);

}  // namespace nif::validate
