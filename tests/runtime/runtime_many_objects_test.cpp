// Assets with very many objects: shared data is stored once, whatever the kernels make of it.
#include "tests/support/many_objects.hpp"

#include "tests/runtime/runtime_fixture.hpp"

namespace nif::test {
namespace {

/// Bytes that the library holds now, and the most that it held.
struct Held {
  uint64_t now = 0, most = 0;

  NifDeviceCallbacks callbacks() {
    NifDeviceCallbacks result{};
    result.struct_size = sizeof(result);
    result.user = this;
    result.allocate = [](void* user, uint64_t bytes, uint64_t alignment) {
      auto& held = *static_cast<Held*>(user);
      held.most = std::max(held.most, held.now += bytes);
      return ::operator new(bytes, std::align_val_t(alignment));
    };
    result.deallocate = [](void* user, void* memory, uint64_t bytes, uint64_t alignment) {
      static_cast<Held*>(user)->now -= bytes;
      ::operator delete(memory, std::align_val_t(alignment));
    };
    return result;
  }
};

/// A copy of the network for each object would take 40 GB.
TEST(ManyObjects, ShareTheirNetworksInMemory) {
  constexpr uint32_t kObjects = 100'000;
  const auto file = format::encode(many_objects(kObjects));
  Held held;
  const NifDeviceCallbacks callbacks = held.callbacks();
  NifDevice device = nullptr;
  ASSERT_EQ(nifNewDevice("threads=1", &callbacks, &device), NIF_OK);
  const uint64_t before = held.now;
  NifAsset asset = nullptr;
  ASSERT_EQ(nifLoadAssetMemory(device, file.data(), file.size(), NIF_LOAD_COPY, &asset), NIF_OK)
      << nifGetErrorMessage();
  EXPECT_LT(held.most - before, 8 * file.size());
  NifAssetInfo info{};
  info.struct_size = sizeof(info);
  ASSERT_EQ(nifGetAssetInfo(asset, &info), NIF_OK);
  EXPECT_EQ(info.object_count, kObjects);
  EXPECT_GE(info.resident_bytes + 1024, held.now - before);
  EXPECT_LT(info.resident_bytes, 8 * file.size());

  NifScene scene = nullptr;
  ASSERT_EQ(nifNewScene(device, &scene), NIF_OK);
  ASSERT_EQ(nifAddAsset(scene, asset, nullptr, nullptr, nullptr), NIF_OK);
  ASSERT_EQ(nifCommitScene(scene), NIF_OK);
  EXPECT_LT(held.most - before, 16 * file.size());
  nifReleaseScene(scene);
  nifReleaseAsset(asset);
  nifReleaseDevice(device);
}

}  // namespace
}  // namespace nif::test
