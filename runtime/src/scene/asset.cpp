// Loading assets and telling what is in them.
#include "scene/asset.hpp"

#include "api/error.hpp"

void NifAssetObject::drop_bytes() {
  size_t size = view.metadata.size();
  for (const auto& object : view.objects) size += object.name.size() + 1;
  for (const auto& instance : view.instances) size += instance.name.size() + 1;
  texts.reserve(size);  // which is enough, so that what is handed out below stays where it is
  const auto keep = [&](std::string_view& text, bool with_end) {
    const size_t start = texts.size();
    texts.insert(texts.end(), text.begin(), text.end());
    if (with_end) texts.push_back(0);
    text = {texts.data() + start, text.size()};
  };
  if (!view.metadata.empty()) keep(view.metadata, false);
  for (nif::format::ObjectView& object : view.objects) keep(object.name, true);
  for (nif::format::InstanceView& instance : view.instances) keep(instance.name, true);
  view.drop_bytes();
  memory = nif::format::FileMemory::borrow({});
}

namespace nif::runtime {

NifAssetObject* load_file(NifDeviceObject* device, const char* path, NifLoadMode mode) {
  using Mode = format::FileMemory::Mode;
  if (mode != NIF_LOAD_READ && mode != NIF_LOAD_MAP)
    refuse_argument(std::string(path) + ": unknown load mode " + std::to_string(int(mode)));
  auto* memory = device->memory();
  return create<NifAssetObject>(
      memory, device, format::FileMemory::load(path, mode == NIF_LOAD_MAP ? Mode::map : Mode::read, memory),
      path);
}

NifAssetObject* load_memory(NifDeviceObject* device, const void* bytes, uint64_t size, NifMemoryMode mode) {
  if (bytes == nullptr && size != 0) refuse_argument("memory: bytes is null");
  if (mode != NIF_MEMORY_COPY && mode != NIF_MEMORY_BORROW)
    refuse_argument("memory: unknown memory mode " + std::to_string(int(mode)));
  if (mode == NIF_MEMORY_BORROW && reinterpret_cast<uintptr_t>(bytes) % NIF_ASSET_ALIGNMENT != 0)
    refuse_argument("memory: borrowed bytes must be aligned to " + std::to_string(NIF_ASSET_ALIGNMENT));
  const std::span<const std::byte> given(static_cast<const std::byte*>(bytes), size);
  auto* memory = device->memory();
  if (mode == NIF_MEMORY_BORROW)
    return create<NifAssetObject>(memory, device, format::FileMemory::borrow(given), "memory");
  // Before the copy, so that a wrong size takes no memory.
  format::check_header(given.first(std::min<size_t>(given.size(), sizeof(format::Header))), size, "memory");
  return create<NifAssetObject>(memory, device, format::FileMemory::copy(given, memory), "memory");
}

void release(NifAssetObject* asset) {
  if (asset == nullptr || !asset->drop()) return;
  const Ref<NifDeviceObject> device = asset->device;
  destroy(device->memory(), asset);
}

const format::ObjectView& object_of(const NifAssetObject& asset, uint32_t object) {
  if (object >= asset.view.objects.size())
    refuse_argument(std::string(asset.name) + ": no object " + std::to_string(object) + "; there are only " +
                    std::to_string(asset.view.objects.size()));
  return asset.view.objects[object];
}

NifAssetInfo describe(const NifAssetObject& asset) {
  const format::AssetView& view = asset.view;
  NifAssetInfo info{};
  info.object_count = uint32_t(view.objects.size());
  info.instance_count = uint32_t(view.instances.size());
  info.network_count = view.network_count();
  info.format_version = format::kVersion;
  info.file_bytes = asset.file_bytes;
  info.resident_bytes = sizeof(NifAssetObject) + asset.name.capacity() + view.resident_bytes() +
                        asset.texts.capacity() + asset.kernels.capacity() * sizeof(KernelPointer) +
                        asset.copies.resident_bytes();
  for (const KernelPointer& kernel : asset.kernels)
    info.resident_bytes += kernel.get_deleter().bytes + kernel->resident_bytes();
  info.metadata = view.metadata.empty() ? nullptr : view.metadata.data();
  info.metadata_bytes = view.metadata.size();
  info.gpu_bytes = asset.gpu_bytes;
  return info;
}

NifObjectInfo describe_object(const NifAssetObject& asset, uint32_t object) {
  const format::ObjectView& view = object_of(asset, object);
  NifObjectInfo info{};
  info.name = view.name.data();
  info.encoding = NifEncoding(format::encoding_number(view.content));
  info.network = asset.view.network_of(view);
  std::copy(view.aabb_min.begin(), view.aabb_min.end(), info.bounds_min);
  std::copy(view.aabb_max.begin(), view.aabb_max.end(), info.bounds_max);
  info.bias = view.bias;
  info.triangles = view.triangles;
  info.resident_bytes = bytes_of(view) + sizeof(format::ObjectView) + asset.kernels[object]->resident_bytes();
  return info;
}

NifInstanceInfo describe_instance(const NifAssetObject& asset, uint32_t instance) {
  if (instance >= asset.view.instances.size())
    refuse_argument(std::string(asset.name) + ": no instance " + std::to_string(instance) +
                    "; there are only " + std::to_string(asset.view.instances.size()));
  const format::InstanceView& view = asset.view.instances[instance];
  NifInstanceInfo info{};
  info.name = view.name.data();
  info.object = view.object;
  std::copy(view.transform.begin(), view.transform.end(), info.transform);
  return info;
}

}  // namespace nif::runtime
