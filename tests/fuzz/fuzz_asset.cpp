// Any bytes given to the runtime as an asset: refused with a sentence, or queried without a fault, in memory
// bounded by their size; and what is accepted can be written again.
#include <nif/nif.h>

#include <cmath>
#include <cstdlib>
#include <cstring>

#include "formats/nif/writer.hpp"
#include "kernels/reference/spherical/primary.hpp"
#include "tests/format/damaged.hpp"

namespace {

void must(bool condition) {
  if (!condition) std::abort();
}

/// Counts what the library holds, and stops it where that is out of proportion to the input.
struct Budget {
  uint64_t held = 0, limit;

  static void* allocate(void* user, uint64_t bytes, uint64_t alignment) {
    auto& self = *static_cast<Budget*>(user);
    self.held += bytes;
    must(self.held <= self.limit);
    return ::operator new(bytes, std::align_val_t(alignment));
  }
  static void deallocate(void* user, void* memory, uint64_t bytes, uint64_t alignment) {
    static_cast<Budget*>(user)->held -= bytes;
    ::operator delete(memory, std::align_val_t(alignment));
  }
};

void query(NifScene scene) {
  // Rays through and around wherever the scene says that it is.
  NifSceneInfo info{};
  info.struct_size = sizeof(info);
  must(nifGetSceneInfo(scene, &info) == NIF_OK);
  constexpr int kRays = 24;
  NifRay rays[kRays];
  for (int i = 0; i < kRays; ++i) {
    for (int a = 0; a < 3; ++a) {
      const float low = info.bounds_min[a], high = info.bounds_max[a];
      rays[i].origin[a] = low + (high - low) * static_cast<float>((i * 7 + a * 5) % 9 - 2) / 5;
      rays[i].direction[a] = static_cast<float>((i * 3 + a * (i % 4)) % 7 - 3);
    }
    rays[i].tmin = i % 3 == 0 ? -INFINITY : 0;
    rays[i].tmax = i % 2 == 0 ? INFINITY : (info.bounds_max[0] - info.bounds_min[0]) / 2;
  }
  uint8_t visible[kRays], certain[kRays];
  float probability[kRays];
  int32_t logit[kRays];
  NifQuery description = nifQueryRays(rays, kRays);
  description.visible = visible;
  description.certain = certain;
  description.probability = probability;
  description.logit = logit;
  must(nifQuery(scene, &description) == NIF_OK);
  for (int i = 0; i < kRays; ++i) must(visible[i] <= 1 && probability[i] >= 0 && probability[i] <= 1);
}

/// The runtime has no call for these.
void query(const nif::kernels::PrimaryField& field) {
  for (int i = 0; i < 24; ++i) {
    nif::kernels::Segment ray{{}, {}, 0, i % 2 == 0 ? INFINITY : 1.0f};
    for (int a = 0; a < 3; ++a) {
      ray.origin[a] =
          field.low[a] + (field.high[a] - field.low[a]) * static_cast<float>((i * 7 + a * 5) % 9 - 2) / 5;
      ray.direction[a] = static_cast<float>((i * 3 + a * (i % 4)) % 7 - 3);
    }
    const nif::kernels::PrimaryAnswer answer = nif::kernels::query_primary(field, ray);
    if (!answer.hit) continue;
    must(answer.t <= ray.tmax);
    for (const float x : answer.normal) must(std::fabs(x) <= 1.001f);
  }
}

void exercise(NifAsset asset, NifDevice device) {
  NifScene scene = nullptr;
  must(nifNewScene(device, &scene) == NIF_OK);
  const NifError added = nifAddAsset(scene, asset, nullptr, nullptr, nullptr);
  must(added == NIF_OK || added == NIF_ERROR_SINGULAR_TRANSFORM);
  must(nifCommitScene(scene) == NIF_OK);
  query(scene);
  nifReleaseScene(scene);
  NifAssetInfo info{};
  info.struct_size = sizeof(info);
  must(nifGetAssetInfo(asset, &info) == NIF_OK);
  for (uint32_t object = 0; object < info.object_count && object < 4; ++object) {
    must(nifNewScene(device, &scene) == NIF_OK);
    must(nifAddInstance(scene, asset, object, nullptr, nullptr) == NIF_OK);
    must(nifCommitScene(scene) == NIF_OK);
    query(scene);
    nifReleaseScene(scene);
  }
}

}  // namespace

extern "C" size_t LLVMFuzzerMutate(uint8_t* data, size_t size, size_t max_size);

/// Makes the checksums right after most mutations: without that nothing behind them would ever be reached.
extern "C" size_t LLVMFuzzerCustomMutator(uint8_t* data, size_t size, size_t max_size, unsigned seed) {
  size = LLVMFuzzerMutate(data, size, max_size);
  if (seed % 16 == 0) return size;
  nif::test::Bytes bytes(size);
  std::memcpy(bytes.data(), data, size);
  if (seed % 4 != 0 && size >= sizeof(nif::format::Header)) {
    auto header = nif::test::load<nif::format::Header>(bytes, 0);
    header.file_bytes = size;
    nif::test::store(bytes, 0, header);
  }
  nif::test::fix_checksums(bytes);
  std::memcpy(data, bytes.data(), size);
  return size;
}

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  Budget budget;
  budget.limit = ~uint64_t{0};
  NifDeviceCallbacks callbacks{};
  callbacks.struct_size = sizeof(callbacks);
  callbacks.user = &budget;
  callbacks.allocate = Budget::allocate;
  callbacks.deallocate = Budget::deallocate;
  NifDevice device = nullptr;
  must(nifNewDevice(nullptr, &callbacks, &device) == NIF_OK);
  // What is built at load takes most where a brick that is all alike, two bytes of the file, is spelled out:
  // a byte for each of its 64 voxels, and half a byte that stays.
  budget.limit = budget.held + 64 * size + (64 << 10);
  NifAsset asset = nullptr;
  if (nifLoadAssetMemory(device, data, size, NIF_MEMORY_COPY, &asset) == NIF_OK) {
    exercise(asset, device);
    nif::test::Bytes bytes(size);
    std::memcpy(bytes.data(), data, size);
    const auto view = nif::format::read_asset(bytes, "input");
    for (const nif::format::PrimaryView& primary : view.primaries) query(primary.field);
    const auto written = nif::format::encode(nif::format::to_asset(view));
    must(nif::format::encode(nif::format::to_asset(nif::format::read_asset(written, "output"))) == written);
  } else {
    must(std::strncmp(nifGetErrorMessage(), "memory: ", 8) == 0);
  }
  nifReleaseAsset(asset);
  nifReleaseDevice(device);
  must(budget.held == 0);
  return 0;
}
