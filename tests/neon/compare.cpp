// compare ASSET...: whether NEON gives the scalar reference's bits.
#include <nif/nif.h>

#include <cstdio>
#include <cstring>
#include <vector>

#include "tests/support/box_rays.hpp"

namespace {

constexpr size_t kRays = 200'000;

struct Loaded {
  NifDevice device = nullptr;
  NifAsset asset = nullptr;
  bool open(const char* configuration, const char* path) {
    if (nifNewDevice(configuration, nullptr, &device) == NIF_OK &&
        nifLoadAssetFile(device, path, NIF_LOAD_COPY, &asset) == NIF_OK)
      return true;
    std::fprintf(stderr, "%s\n", nifGetErrorMessage());
    return false;
  }
  std::vector<int32_t> answers(uint32_t object, const std::vector<NifRay>& rays) const {
    NifScene scene = nullptr;
    std::vector<int32_t> logits(rays.size());
    std::vector<uint8_t> certain(rays.size());
    const NifRays query = nifMakeRays(rays.data(), rays.size());
    NifAnswers outputs{};
    outputs.struct_size = sizeof(outputs);
    outputs.logit = logits.data();
    outputs.certain = certain.data();
    if (nifNewScene(device, &scene) != NIF_OK ||
        nifAddInstance(scene, asset, object, nullptr, nullptr) != NIF_OK || nifCommitScene(scene) != NIF_OK ||
        nifQuery(scene, &query, &outputs) != NIF_OK) {
      std::fprintf(stderr, "%s\n", nifGetErrorMessage());
      return {};
    }
    nifReleaseScene(scene);
    for (size_t i = 0; i < rays.size(); ++i) logits[i] ^= int32_t(certain[i]) << 30;
    return logits;
  }
};

}  // namespace

int main(int argc, char** argv) {
  size_t different = 0;
  for (int i = 1; i < argc; ++i) {
    Loaded neon, scalar;
    if (!neon.open("isa=neon", argv[i]) || !scalar.open("isa=scalar", argv[i])) return 1;
    NifAssetInfo about{};
    about.struct_size = sizeof(about);
    nifGetAssetInfo(scalar.asset, &about);
    for (uint32_t object = 0; object < about.object_count; ++object) {
      NifObjectInfo info{};
      info.struct_size = sizeof(info);
      nifGetObjectInfo(scalar.asset, object, &info);
      const std::vector<NifRay> rays = nif::test::make_box_rays(info, kRays, 1);
      const std::vector<int32_t> a = neon.answers(object, rays), b = scalar.answers(object, rays);
      if (a.size() != kRays || b.size() != kRays) return 1;
      for (size_t r = 0; r < kRays; ++r) different += a[r] != b[r];
    }
    std::printf("%s: %u objects, %zu rays each, %zu answers differ\n", argv[i], about.object_count, kRays,
                different);
  }
  return different != 0;
}
