// A loaded asset: its bytes, wherever they are, and the checked views into them.
#pragma once

#include <string>

#include "device.hpp"
#include "formats/nif/file_memory.hpp"
#include "formats/nif/reader.hpp"
#include "kernel.hpp"

struct NifAssetObject : nif::runtime::Object {
  NifAssetObject(NifDeviceObject* owner, nif::format::FileMemory bytes, std::string_view file_name)
      : device(owner),
        name(file_name, owner->memory()),
        memory(std::move(bytes)),
        view(nif::format::read_asset(memory.bytes(), file_name, owner->memory())),
        kernels(owner->memory()) {
    for (const nif::format::ObjectView& object : view.objects)
      kernels.push_back(nif::runtime::make_kernel(object, owner->configuration.isa, owner->memory()));
  }

  nif::runtime::Ref<NifDeviceObject> device;
  std::pmr::string name;  ///< what messages call it: its file, or "memory"
  nif::format::FileMemory memory;
  nif::format::AssetView view;
  std::pmr::vector<nif::runtime::KernelPointer> kernels;  ///< [object] answers it
};

namespace nif::runtime {

NifAssetObject* load_file(NifDeviceObject* device, const char* path, NifLoadMode mode);
NifAssetObject* load_memory(NifDeviceObject* device, const void* bytes, uint64_t size, NifMemoryMode mode);
void release(NifAssetObject* asset);

/// Checked access; throws Failure where the asset has no such object.
const format::ObjectView& object_of(const NifAssetObject& asset, uint32_t object);
NifAssetInfo describe(const NifAssetObject& asset);
NifObjectInfo describe_object(const NifAssetObject& asset, uint32_t object);
NifInstanceInfo describe_instance(const NifAssetObject& asset, uint32_t instance);

}  // namespace nif::runtime
