// A loaded asset: its bytes, the checked views into them, and the kernels made from them. If no kernel reads
// the bytes any more, they are freed; the views then keep only names, boxes and numbers.
#pragma once

#include <array>
#include <atomic>
#include <map>
#include <mutex>
#include <string>

#include "api/device.hpp"
#include "formats/nif/file_memory.hpp"
#include "formats/nif/reader.hpp"
#include "scene/bending.hpp"
#include "scene/kernel.hpp"

struct NifAssetObject : nif::runtime::Object {
  NifAssetObject(NifDeviceObject* owner, nif::format::FileMemory bytes, std::string_view file_name)
      : device(owner),
        name(file_name, owner->memory()),
        memory(std::move(bytes)),
        view(nif::format::read_asset(memory.bytes(), file_name, owner->memory())),
        texts(owner->memory()),
        copies(owner->memory()),
        kernels(owner->memory()),
        file_bytes(memory.bytes().size()),
        shader_words(view.objects.size(), owner->memory()),
        bending_(owner->memory()) {
    const nif::format::FileParts parts = nif::format::bytes_by_part(view);
    for (size_t i = 0; i < parts.size(); ++i) file_parts[i] = parts[i].bytes;
    kernels.reserve(view.objects.size());
    nif::runtime::KernelChoice choice = owner->configuration.kernels;
    choice.decodes = nif::runtime::may_decode(view);
    for (const nif::format::ObjectView& object : view.objects)
      kernels.push_back(object.unsupported
                            ? nif::runtime::KernelPointer()
                            : nif::runtime::make_kernel(object, choice, owner->memory(), copies));
    // Details of hits are looked up in the file's bytes, a GPU reads them when a scene with this asset is
    // committed, and tables for shaders are made from them.
    bool read = device->gpu.has_value() || device->configuration.shaders || !view.numbers.empty() ||
                !view.colors.empty();
    for (const nif::runtime::KernelPointer& kernel : kernels)
      read = read || (kernel && kernel->reads_field());
    if (!read) drop_bytes();
  }

  ~NifAssetObject() {
    if (on_gpu) device->gpu->free(*this);
  }

  nif::runtime::Ref<NifDeviceObject> device;
  uintptr_t handle = 0;   ///< the caller's handle
  std::pmr::string name;  ///< in messages: its file, or "memory"
  nif::format::FileMemory memory;
  nif::format::AssetView view;
  std::pmr::vector<char> texts;       ///< names and metadata of the view, once `memory` is freed
  nif::runtime::SharedCopies copies;  ///< data that kernels share
  std::pmr::vector<nif::runtime::KernelPointer>
      kernels;  ///< [object] answers its queries; null if unsupported
  uint64_t file_bytes;
  /// The file's bytes_by_part(), kept even if the file's bytes are freed.
  std::array<uint64_t, nif::format::FileParts::kMost> file_parts;
  /// What instances of an object share that bend: made for the first one. Thread-safe.
  const nif::runtime::BendingObject& bending(uint32_t object);
  uint64_t bending_bytes() const;

  nif::runtime::GpuAsset* on_gpu = nullptr;  ///< set once a scene with the asset was committed
  std::atomic<uint64_t> gpu_bytes = 0;
  /// [object] how many words its tables for shaders have; 0 until they are counted.
  mutable std::pmr::vector<std::atomic<uint64_t>> shader_words;

 private:
  void drop_bytes();

  mutable std::mutex bending_made_;
  std::pmr::map<uint32_t, nif::runtime::BendingObject> bending_;
};

namespace nif::runtime {

NifAssetObject* load_file(NifDeviceObject* device, const char* path, NifLoadMode mode);
NifAssetObject* load_memory(NifDeviceObject* device, const void* bytes, uint64_t size, NifLoadMode mode);
NifAssetObject* load_reader(NifDeviceObject* device, const NifReader& reader);
void release(NifAssetObject* asset);

/// Returns an object; throws Failure if the asset has no such object.
const format::ObjectView& object_of(const NifAssetObject& asset, uint32_t object);
/// The same, but throws Failure also if this build cannot answer the object.
const format::ObjectView& answerable(const NifAssetObject& asset, uint32_t object);
NifAssetInfo describe(const NifAssetObject& asset);
/// Describes a part; throws Failure if there is no such part.
NifPartInfo describe_part(const NifAssetObject& asset, uint32_t part);
NifObjectInfo describe_object(const NifAssetObject& asset, uint32_t object);
NifAssetInstanceInfo describe_instance(const NifAssetObject& asset, uint32_t instance);

}  // namespace nif::runtime
