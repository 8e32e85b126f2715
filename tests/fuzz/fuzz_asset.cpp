// Any bytes given to the runtime as an asset: refused with a sentence, or queried without a fault, in memory
// bounded by their size; and what is accepted can be written again.
#include <nif/nif.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>

#include "formats/nif/writer.hpp"
#include "kernels/packed/feature_grid.hpp"
#include "kernels/packed/walk_grid.hpp"
#include "kernels/reference/spherical/primary.hpp"
#include "tests/format/damaged.hpp"
#include "tests/fuzz/mutate.hpp"

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

constexpr int kRays = 24;

/// Rays through and around wherever the scene says that it is. Where it has one object and that is its
/// field, the answers are the reference's.
void query(NifScene scene, const nif::kernels::AnyField* field) {
  NifSceneInfo info{};
  info.struct_size = sizeof(info);
  must(nifGetSceneInfo(scene, &info) == NIF_OK);
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
  uint32_t triangle[kRays];
  float color[kRays][3];
  NifQuery plain = nifQueryRays(rays, kRays);
  NifHits hits{};
  hits.struct_size = sizeof(hits);
  hits.triangle = triangle;
  hits.color = color[0];
  must(nifIntersect(scene, &plain, &hits) == NIF_OK);
  for (const auto& one : color)
    for (const float c : one) must(c >= 0 && c <= 1);
  for (int i = 0; i < kRays; ++i) {
    must(visible[i] <= 1 && probability[i] >= 0 && probability[i] <= 1);
    if (field == nullptr) continue;
    const NifRay& ray = rays[i];
    const nif::kernels::Answer answer =
        nif::kernels::query(*field, {{ray.origin[0], ray.origin[1], ray.origin[2]},
                                     {ray.direction[0], ray.direction[1], ray.direction[2]},
                                     ray.tmin,
                                     ray.tmax});
    // Planes that contradict the triangles: kernels may differ in which of the two they ask.
    if (std::holds_alternative<nif::kernels::ExactField>(*field)) continue;
    must(visible[i] == answer.visible && certain[i] == answer.certain && logit[i] == answer.logit);
  }
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

/// What is made of an object for a GPU.
void pack(const nif::kernels::AnyField& any) {
  using nif::kernels::cpu::FeatureGrid, nif::kernels::cpu::WalkGrid;
  auto* const memory = std::pmr::get_default_resource();
  if (const auto* exact = std::get_if<nif::kernels::ExactField>(&any)) WalkGrid(exact->proof, memory);
  const auto* field = std::get_if<nif::kernels::SegmentField>(&any);
  if (field == nullptr) return;
  const WalkGrid walk(*field, memory);
  const FeatureGrid corners(*field, memory);
  if (corners.complete) must(corners.next_pairs().size() == corners.pairs.size());
}

void exercise(NifAsset asset, NifDevice device, const nif::format::AssetView& view) {
  NifScene scene = nullptr;
  must(nifNewScene(device, &scene) == NIF_OK);
  const NifError added = nifAddAsset(scene, asset, nullptr, nullptr, nullptr);
  must(added == NIF_OK || added == NIF_ERROR_SINGULAR_TRANSFORM);
  must(nifCommitScene(scene) == NIF_OK);
  query(scene, nullptr);
  nifReleaseScene(scene);
  NifAssetInfo info{};
  info.struct_size = sizeof(info);
  must(nifGetAssetInfo(asset, &info) == NIF_OK);
  for (uint32_t object = 0; object < info.object_count && object < 4; ++object) {
    must(nifNewScene(device, &scene) == NIF_OK);
    must(nifAddInstance(scene, asset, object, nullptr, nullptr) == NIF_OK);
    must(nifCommitScene(scene) == NIF_OK);
    const nif::kernels::AnyField field = nif::format::field_of(view.objects[object]);
    query(scene, &field);
    pack(field);
    nifReleaseScene(scene);
  }
}

}  // namespace

extern "C" size_t LLVMFuzzerMutate(uint8_t* data, size_t size, size_t max_size);

/// Most mutations keep offsets and checksums right: without that nothing behind them would ever be reached.
extern "C" size_t LLVMFuzzerCustomMutator(uint8_t* data, size_t size, size_t max_size, unsigned seed) {
  nif::test::Random random(seed);
  const uint32_t kind = random.below(8);
  nif::test::Bytes bytes(size);
  if (size > 0) std::memcpy(bytes.data(), data, size);
  if (kind > 2) {
    bytes = nif::test::mutate_structure(bytes, random, LLVMFuzzerMutate);
    if (bytes.size() > max_size) return size;
  } else {
    size = LLVMFuzzerMutate(data, size, max_size);
    if (kind == 0) return size;
    bytes.resize(size);
    std::memcpy(bytes.data(), data, size);
    if (kind == 1 && size >= sizeof(nif::format::Header)) {
      auto header = nif::test::load<nif::format::Header>(bytes, 0);
      header.file_bytes = size;
      nif::test::store(bytes, 0, header);
    }
    nif::test::fix_checksums(bytes);
  }
  std::memcpy(data, bytes.data(), bytes.size());
  return bytes.size();
}

extern "C" size_t LLVMFuzzerCustomCrossOver(const uint8_t* one, size_t one_size, const uint8_t* other,
                                            size_t other_size, uint8_t* out, size_t max_size, unsigned) {
  const auto bytes_of = [](const uint8_t* data, size_t size) {
    const auto* bytes = reinterpret_cast<const std::byte*>(data);
    return nif::test::Bytes(bytes, bytes + size);
  };
  const nif::test::Bytes joined =
      nif::test::join_assets(bytes_of(one, one_size), bytes_of(other, other_size));
  constexpr size_t kEnough = 24 << 10;  // else what is tried becomes ever larger and slower
  if (joined.size() > std::min(max_size, kEnough)) return 0;
  if (!joined.empty()) std::memcpy(out, joined.data(), joined.size());
  return joined.size();
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
  // What is built at load takes most where a brick that is all alike is spelled out: a word for each of its
  // 64 voxels, and as much again, and a little more, while boxes are looked for. Each brick has at least two
  // bytes of the file, coded or not. Payloads that are coded decode to at most 16 times what they take of the
  // file, and one line more for each of three.
  constexpr uint64_t kBuilt = 264, kDecoded = nif::format::kMostExpansion + 2;
  budget.limit = budget.held + (kBuilt + kDecoded) * size + (64 << 10);
  NifAsset asset = nullptr;
  if (nifLoadAssetMemory(device, data, size, NIF_MEMORY_COPY, &asset) == NIF_OK) {
    nif::test::Bytes bytes(size);
    std::memcpy(bytes.data(), data, size);
    const auto view = nif::format::read_asset(bytes, "input");
    exercise(asset, device, view);
    for (const nif::format::PrimaryView& primary : view.primaries) query(primary.field);
    const auto owned = nif::format::to_asset(view);
    const auto written = nif::format::encode(owned);
    must(nif::format::encoded_bytes(owned) == written.size());
    must(nif::format::encode(nif::format::to_asset(nif::format::read_asset(written, "output"))) == written);
  } else {
    must(std::strncmp(nifGetErrorMessage(), "memory: ", 8) == 0);
  }
  nifReleaseAsset(asset);
  nifReleaseDevice(device);
  must(budget.held == 0);
  return 0;
}
