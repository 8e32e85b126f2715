// Maps failed calls of the runtime to exit codes: codes for files keep their numbers, out of memory stays
// that, and anything else counts as a defect of nifkit.
#include "tools/common/runtime_handles.hpp"

#include "formats/base/status.hpp"

namespace nif::tools {

void check(NifError error) {
  if (error == NIF_OK) return;
  const bool file = error >= NIF_ERROR_FILE_NOT_FOUND && error <= NIF_ERROR_UNSUPPORTED_NIF;
  throw Error(file ? Status(error)
              : error == NIF_ERROR_OUT_OF_MEMORY || error == NIF_ERROR_OUT_OF_DEVICE_MEMORY
                  ? Status::out_of_memory
                  : Status::internal,
              nifGetErrorMessage());
}

std::string_view metadata_of(const NifAssetInfo& info) {
  return info.metadata ? std::string_view(info.metadata, info.metadata_bytes) : std::string_view();
}

std::vector<NifPartInfo> parts_of(NifAsset asset) {
  std::vector<NifPartInfo> parts;
  NifPartInfo info{};
  info.struct_size = sizeof(info);
  while (nifGetPartInfo(asset, uint32_t(parts.size()), &info) == NIF_OK) parts.push_back(info);
  return parts;
}

uint64_t resident_bytes(std::span<const std::byte> file) {
  uint64_t sum = 0;
  for (const NifPartInfo& part : parts_of(file)) sum += part.resident_bytes;
  return sum;
}

std::vector<NifPartInfo> parts_of(std::span<const std::byte> file) {
  Device device;
  Asset asset;
  check(nifNewDevice(nullptr, nullptr, &device.handle));
  check(nifLoadAssetMemory(device.handle, file.data(), file.size(), NIF_LOAD_COPY, &asset.handle));
  return parts_of(asset.handle);
}

}  // namespace nif::tools
