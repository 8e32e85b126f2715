// Loads assets, and describes what is in them.
#include "scene/asset.hpp"

#include <algorithm>
#include <array>
#include <span>
#include <string_view>

#include "api/error.hpp"
#include "formats/base/size.hpp"
#include "kernels/reference/planes/cells.hpp"

void NifAssetObject::drop_bytes() {
  size_t size = view.metadata.size();
  for (const auto& object : view.objects) size += object.name.size() + 1;
  for (const auto& instance : view.instances) size += instance.name.size() + 1;
  texts.reserve(size);  // enough for all texts, so that views into it stay valid
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

const nif::runtime::BendingObject& NifAssetObject::bending(uint32_t object) {
  const std::lock_guard lock(bending_made_);
  const auto at = bending_.find(object);
  if (at != bending_.end()) return at->second;
  return bending_.try_emplace(object, view, object, device->memory()).first->second;
}

uint64_t NifAssetObject::bending_bytes() const {
  const std::lock_guard lock(bending_made_);
  uint64_t sum = 0;
  for (const auto& [object, bending] : bending_) sum += sizeof(bending) + bending.bytes();
  return sum;
}

namespace nif::runtime {

namespace {

void check_mode(const char* name, NifLoadMode mode) {
  if (mode != NIF_LOAD_COPY && mode != NIF_LOAD_IN_PLACE)
    refuse_argument(std::string(name) + ": unknown load mode " + std::to_string(int(mode)));
}

}  // namespace

NifAssetObject* load_file(NifDeviceObject* device, const char* path, NifLoadMode mode) {
  using Mode = format::FileMemory::Mode;
  check_mode(path, mode);
  auto* memory = device->memory();
  return create<NifAssetObject>(
      memory, device, format::FileMemory::load(path, mode == NIF_LOAD_COPY ? Mode::read : Mode::map, memory),
      path);
}

NifAssetObject* load_memory(NifDeviceObject* device, const void* bytes, uint64_t size, NifLoadMode mode) {
  if (bytes == nullptr && size != 0) refuse_argument("memory: bytes is null");
  check_mode("memory", mode);
  if (mode == NIF_LOAD_IN_PLACE && reinterpret_cast<uintptr_t>(bytes) % NIF_ASSET_ALIGNMENT != 0)
    refuse_argument("memory: bytes that are used in place must be aligned to " +
                    std::to_string(NIF_ASSET_ALIGNMENT));
  const std::span<const std::byte> given(static_cast<const std::byte*>(bytes), memory_size(size));
  auto* memory = device->memory();
  if (mode == NIF_LOAD_IN_PLACE)
    return create<NifAssetObject>(memory, device, format::FileMemory::borrow(given), "memory");
  // Checked before the copy, so that a wrong size allocates nothing.
  format::check_header(given.first(std::min<size_t>(given.size(), sizeof(format::Header))), size, "memory");
  return create<NifAssetObject>(memory, device, format::FileMemory::copy(given, memory), "memory");
}

NifAssetObject* load_reader(NifDeviceObject* device, const NifReader& reader) {
  const char* name = reader.name ? reader.name : "reader";
  if (reader.read == nullptr) refuse_argument(std::string(name) + ": read is null");
  const auto read = [&](uint64_t offset, void* to, uint64_t size) {
    // Any other value is a failure: a function may return -1, or how many bytes it could read.
    if (size != 0 && reader.read(reader.user, offset, to, size) != 1)
      throw Failure(
          NIF_ERROR_FILE_UNREADABLE,
          std::string(name) + ": the caller's read function failed at byte " + std::to_string(offset));
  };
  // Reads the header first, so that a wrong size allocates nothing.
  std::array<std::byte, sizeof(format::Header)> header;
  const size_t start = std::min<size_t>(memory_size(reader.size), header.size());
  read(0, header.data(), start);
  format::check_header({header.data(), start}, reader.size, name);
  auto* memory = device->memory();
  format::FileMemory bytes =
      format::FileMemory::filled(memory_size(reader.size), memory, [&](std::span<std::byte> to) {
        std::copy(header.begin(), header.end(), to.begin());
        read(start, to.data() + start, to.size() - start);
      });
  return create<NifAssetObject>(memory, device, std::move(bytes), name);
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

const format::ObjectView& answerable(const NifAssetObject& asset, uint32_t object) {
  const format::ObjectView& view = object_of(asset, object);
  if (view.unsupported)
    throw Failure(NIF_ERROR_UNSUPPORTED_NIF, std::string(asset.name) + ": object " + std::to_string(object) +
                                                 " ('" + std::string(view.name) + "') " + view.unsupported);
  return view;
}

namespace {

/// Adds up the bytes of an asset's parts, in the file and in memory. Every byte is counted exactly once.
class Parts {
 public:
  explicit Parts(const NifAssetObject& asset) {
    const format::AssetView& view = asset.view;
    const bool kept = !view.bytes.empty();
    const format::FileParts now = format::bytes_by_part(view);
    uint64_t rest = asset.file_bytes - view.metadata.size();
    for (size_t i = 0; i < now.size(); ++i) {
      const uint64_t file = asset.file_parts[i];
      add(now[i].name, file, (kept ? file : 0) + now[i].decoded);
      using kernels::cpu::Shared;
      const std::string_view name = now[i].name;
      if (name == "network")
        parts_[count_ - 1].resident_bytes += asset.copies.resident_bytes(Shared::network);
      if (name == "alpha_maps")
        parts_[count_ - 1].resident_bytes += asset.copies.resident_bytes(Shared::alpha_map);
      rest -= file;
    }
    add("metadata", view.metadata.size(), view.metadata.size());
    add("shell", rest, kept ? rest : asset.texts.capacity() - view.metadata.size());
    kernels::BuiltBytes built;
    uint64_t kernels = asset.kernels.capacity() * sizeof(KernelPointer);
    for (const KernelPointer& kernel : asset.kernels) {
      if (!kernel) continue;
      built.traversal_words += kernel->built_bytes().traversal_words;
      built.corner_bricks += kernel->built_bytes().corner_bricks;
      built.decoded_triangles += kernel->built_bytes().decoded_triangles;
      kernels += kernel.get_deleter().bytes;
    }
    add("traversal_words", 0, built.traversal_words);
    add("corner_bricks", 0, built.corner_bricks);
    add("decoded_triangles", 0, built.decoded_triangles);
    add("views", 0,
        sizeof(NifAssetObject) + asset.name.capacity() + view.view_bytes() + kernels + asset.bending_bytes() +
            asset.shader_words.capacity() * sizeof(asset.shader_words[0]));
  }

  std::span<const NifPartInfo> all() const { return {parts_.data(), count_}; }
  uint64_t resident_bytes() const {
    uint64_t sum = 0;
    for (const NifPartInfo& part : all()) sum += part.resident_bytes;
    return sum;
  }

 private:
  void add(const char* name, uint64_t file, uint64_t resident) {
    parts_[count_++] = {0, name, file, resident};
  }

  std::array<NifPartInfo, format::FileParts::kMost + 6> parts_;
  size_t count_ = 0;
};

}  // namespace

NifPartInfo describe_part(const NifAssetObject& asset, uint32_t part) {
  const Parts parts(asset);
  if (part >= parts.all().size())
    refuse_argument(std::string(asset.name) + ": no part " + std::to_string(part) + "; there are only " +
                    std::to_string(parts.all().size()));
  return parts.all()[part];
}

NifAssetInfo describe(const NifAssetObject& asset) {
  const format::AssetView& view = asset.view;
  NifAssetInfo info{};
  info.object_count = uint32_t(view.objects.size());
  info.instance_count = uint32_t(view.instances.size());
  info.network_count = view.network_count();
  info.format_version = format::kVersion;
  info.file_bytes = asset.file_bytes;
  info.resident_bytes = Parts(asset).resident_bytes();
  info.metadata = view.metadata.empty() ? nullptr : view.metadata.data();
  info.metadata_bytes = view.metadata.size();
  info.gpu_bytes = asset.gpu_bytes;
  info.places_nothing = view.places_nothing;
  info.arithmetic = view.arithmetic;
  info.prover = view.prover;
  info.proves = format::proves(view.prover);
  return info;
}

NifObjectInfo describe_object(const NifAssetObject& asset, uint32_t object) {
  const format::ObjectView& view = object_of(asset, object);
  NifObjectInfo info{};
  info.name = view.name.data();
  info.level = view.level;
  info.error = view.error;
  info.unsupported = view.unsupported ? view.unsupported : "";
  info.network = asset.view.network_of(view);
  std::copy(view.aabb_min.begin(), view.aabb_min.end(), info.bounds_min);
  std::copy(view.aabb_max.begin(), view.aabb_max.end(), info.bounds_max);
  info.bias = view.bias;
  info.triangles = view.triangle_count;
  if (view.unsupported) return info;
  info.encoding = format::encoding_of(view).number;
  const kernels::BuiltBytes built = asset.kernels[object]->built_bytes();
  info.resident_bytes = bytes_of(view) + sizeof(format::ObjectView) + built.traversal_words +
                        built.corner_bricks + built.decoded_triangles;
  for (uint32_t kind = format::kSourceTriangles; kind <= format::kMostNumbers; ++kind)
    if (const auto* numbers = asset.view.numbers_of(object, format::NumbersKind(kind))) {
      info.resident_bytes += numbers->bytes;
      if (kind == format::kSourceTriangles)
        info.source_triangles = numbers->below ? numbers->below : 0xffffffffu;  // 0 stands for 2^32
    }
  info.vertices = uint32_t(bending_vertices(asset.view, object));
  if (const auto* skin = asset.view.skin_of(object)) {
    info.resident_bytes += skin->bytes();
    info.joints = skin->field.joint_count;
    info.targets = skin->field.target_count;
  }
  if (const auto* colors = asset.view.colors_of(object)) {
    info.resident_bytes += colors->bytes();
    info.colors = 1;
  }
  info.proves = !view.is<kernels::PlanesField>() || kernels::has_planes(view.planes->field);
  return info;
}

NifAssetInstanceInfo describe_instance(const NifAssetObject& asset, uint32_t instance) {
  if (instance >= asset.view.instances.size())
    refuse_argument(std::string(asset.name) + ": no instance " + std::to_string(instance) +
                    "; there are only " + std::to_string(asset.view.instances.size()));
  const format::InstanceView& view = asset.view.instances[instance];
  NifAssetInstanceInfo info{};
  info.name = view.name.data();
  info.object = view.object;
  info.user = view.user;
  info.mask = view.mask;
  info.flags = view.flags;
  info.parent = view.parent;
  std::copy(view.transform.begin(), view.transform.end(), info.transform);
  return info;
}

}  // namespace nif::runtime
