// Wraps the runtime's handles and errors for the tools.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include "nif/nif.hpp"

namespace nif::tools {

/// Turns a failed call of the runtime into an exception; its codes for files are our exit codes.
void check(NifError error);

template <class Handle, void (*kRelease)(Handle)>
struct Released {
  Handle handle = nullptr;
  Released() = default;
  Released(Released&& other) noexcept : handle(std::exchange(other.handle, nullptr)) {}
  Released& operator=(Released&& other) noexcept {
    std::swap(handle, other.handle);
    return *this;
  }
  ~Released() { kRelease(handle); }
};
using Device = Released<NifDevice, nifReleaseDevice>;
using Asset = Released<NifAsset, nifReleaseAsset>;
using Scene = Released<NifScene, nifReleaseScene>;

/// Empty if there is none. Valid as long as the asset.
std::string_view metadata_of(const NifAssetInfo& info);

/// All parts of an asset. Their names stay valid as long as the library is loaded.
std::vector<NifPartInfo> parts_of(NifAsset asset);

/// Bytes that the runtime keeps in memory for an asset, with the best instruction set of this machine.
uint64_t resident_bytes(std::span<const std::byte> file);
/// The same, part by part.
std::vector<NifPartInfo> parts_of(std::span<const std::byte> file);

}  // namespace nif::tools
