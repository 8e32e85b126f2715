// Any bytes given to the runtime as an asset: refused with a sentence, or queried without a fault, in memory
// bounded by their size; and what is accepted can be written again.
#include <nif/nif.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "formats/nif/writer.hpp"
#include "kernels/packed/feature_grid.hpp"
#include "kernels/packed/traversal_grid.hpp"
#include "kernels/reference/spherical/primary.hpp"
#include "tests/format/damaged.hpp"
#include "tests/fuzz/fuzz.hpp"
#include "tests/fuzz/object_rays.hpp"

namespace {

using nif::test::Budget, nif::test::must;

constexpr int kRays = 24;

/// Rays through and around wherever the scene says that it is. Where it has one object and that is its
/// field, the answers are the reference's.
void query(NifScene scene, const nif::kernels::AnyField* field, bool proven) {
  NifSceneInfo info{};
  info.struct_size = sizeof(info);
  must(nifGetSceneInfo(scene, &info) == NIF_OK);
  const std::vector<NifRay> rays = nif::test::rays_in_box(info.bounds_min, info.bounds_max, kRays);
  uint8_t visible[kRays], certain[kRays];
  float probability[kRays];
  int32_t logit[kRays];
  const NifRays asked = nifMakeRays(rays.data(), kRays);
  NifAnswers answers{};
  answers.struct_size = sizeof(answers);
  answers.visible = visible;
  answers.certain = certain;
  answers.probability = probability;
  answers.logit = logit;
  must(nifQuery(scene, &asked, &answers) == NIF_OK);
  uint32_t triangle[kRays];
  float color[kRays][3];
  NifHits hits{};
  hits.struct_size = sizeof(hits);
  hits.triangle = triangle;
  hits.color = color[0];
  must(nifIntersect(scene, &asked, &hits) == NIF_OK);
  for (const auto& one : color)
    for (const float c : one) must(c >= 0 && c <= 1);
  for (int i = 0; i < kRays; ++i) {
    must(visible[i] <= 1 && probability[i] >= 0 && probability[i] <= 1);
    if (field == nullptr) continue;
    const nif::kernels::Answer answer = nif::kernels::query(*field, nif::test::segment_of(rays[i]));
    // If planes contradict triangles, kernels may differ in which of them they use.
    if (std::holds_alternative<nif::kernels::ExactField>(*field)) continue;
    must(visible[i] == answer.visible && certain[i] == (answer.certain && proven) &&
         logit[i] == answer.logit);
  }
}

/// The runtime has no calls for these.
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

/// The data of an object that is built for GPUs.
void pack(const nif::kernels::AnyField& any) {
  using nif::kernels::cpu::FeatureGrid, nif::kernels::cpu::TraversalGrid;
  auto* const memory = std::pmr::get_default_resource();
  if (const auto* exact = std::get_if<nif::kernels::ExactField>(&any)) TraversalGrid(exact->planes, memory);
  const auto* field = std::get_if<nif::kernels::SegmentField>(&any);
  if (field == nullptr) return;
  const TraversalGrid grid(*field, memory);
  const FeatureGrid corners(*field, memory);
  if (corners.complete) must(corners.next_pairs().size() == corners.pairs.size());
}

void exercise(NifAsset asset, NifDevice device, const nif::format::AssetView& view) {
  NifScene scene = nullptr;
  must(nifNewScene(device, &scene) == NIF_OK);
  const NifError added = nifAddAsset(scene, asset, nullptr, nullptr, nullptr);
  bool all_supported = true;
  view.for_each_placed([&](uint32_t object, const nif::format::InstanceView*) {
    all_supported = all_supported && !view.objects[object].unsupported;
  });
  must(added == NIF_OK || added == NIF_ERROR_SINGULAR_TRANSFORM ||
       (added == NIF_ERROR_UNSUPPORTED_NIF && !all_supported));
  must(nifCommitScene(scene) == NIF_OK);
  query(scene, nullptr, true);
  nifReleaseScene(scene);
  NifAssetInfo info{};
  info.struct_size = sizeof(info);
  must(nifGetAssetInfo(asset, &info) == NIF_OK);
  for (uint32_t object = 0; object < info.object_count && object < 4; ++object) {
    must(nifNewScene(device, &scene) == NIF_OK);
    const bool supported = !view.objects[object].unsupported;
    must(nifAddInstance(scene, asset, object, nullptr, nullptr) ==
         (supported ? NIF_OK : NIF_ERROR_UNSUPPORTED_NIF));
    if (!supported) {
      nifReleaseScene(scene);
      continue;
    }
    must(nifCommitScene(scene) == NIF_OK);
    const nif::kernels::AnyField field = nif::format::field_of(view.objects[object]);
    query(scene, &field, view.objects[object].proven);
    pack(field);
    nifReleaseScene(scene);
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  Budget budget;
  NifDeviceCallbacks callbacks{};
  callbacks.struct_size = sizeof(callbacks);
  callbacks.user = &budget;
  callbacks.allocate = Budget::allocate;
  callbacks.deallocate = Budget::deallocate;
  NifDevice device = nullptr;
  // Tables of either form; the same input chooses the same form.
  must(nifNewDevice(size % 2 ? "memory=least" : nullptr, &callbacks, &device) == NIF_OK);
  budget.limit = budget.held + nif::test::most_memory(size);
  NifAsset asset = nullptr;
  if (nifLoadAssetMemory(device, data, size, NIF_LOAD_COPY, &asset) == NIF_OK) {
    nif::test::Bytes bytes(size);
    std::memcpy(bytes.data(), data, size);
    const auto view = nif::format::read_asset(bytes, "input");
    exercise(asset, device, view);
    for (const nif::format::PrimaryView& primary : view.primaries) query(primary.field);
    const auto unsupported = [](const nif::format::ObjectView& object) {
      return object.unsupported != nullptr;
    };
    if (std::ranges::none_of(view.objects, unsupported)) {
      const auto owned = nif::format::to_asset(view);
      const auto written = nif::format::encode(owned);
      must(nif::format::encoded_bytes(owned) == written.size());
      must(nif::format::encode(nif::format::to_asset(nif::format::read_asset(written, "output"))) == written);
    }
  } else {
    must(std::strncmp(nifGetErrorMessage(), "memory: ", 8) == 0);
  }
  nifReleaseAsset(asset);
  nifReleaseDevice(device);
  must(budget.held == 0);
  return 0;
}
