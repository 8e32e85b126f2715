// speed ASSET RAYS: how many million rays a second the library of this machine answers on one thread with
// SSE4, and how many of them are visible. The rays are those of speed.mjs.
#include <nif/nif.h>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <numeric>
#include <vector>

namespace {

void must(NifError error) {
  if (error == NIF_OK) return;
  std::fprintf(stderr, "%s\n", nifGetErrorMessage());
  std::exit(1);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) return 2;
  const size_t count = std::strtoul(argv[2], nullptr, 10);
  NifDevice device = nullptr;
  NifAsset asset = nullptr;
  NifScene scene = nullptr;
  must(nifNewDevice("isa=sse4,queries=1", nullptr, &device));
  must(nifLoadAssetFile(device, argv[1], NIF_LOAD_COPY, &asset));
  must(nifNewScene(device, &scene));
  must(nifAddAsset(scene, asset, nullptr, nullptr, nullptr));
  must(nifCommitScene(scene));
  NifSceneInfo info{};
  info.struct_size = sizeof(info);
  must(nifGetSceneInfo(scene, &info));
  uint32_t state = 1;
  const auto unit = [&] { return (state = state * 1664525u + 1013904223u) / 4294967296.0; };
  std::vector<NifRay> rays(count);
  for (NifRay& ray : rays)
    for (int a = 0; a < 3; ++a) {
      const double low = info.bounds_min[a], size = info.bounds_max[a] - low;
      const double from = low + size * (1.5 * unit() - 0.25), to = low + size * unit();
      ray.origin[a] = static_cast<float>(from);
      ray.direction[a] = static_cast<float>(to - from);
      ray.tmax = INFINITY;
    }
  std::vector<uint8_t> visible(count);
  double best = 0;
  for (int round = 0; round < 5; ++round) {
    const NifRays batch = nifMakeRays(rays.data(), count);
    NifAnswers answers{};
    answers.struct_size = sizeof(answers);
    answers.visible = visible.data();
    const auto start = std::chrono::steady_clock::now();
    must(nifQuery(scene, &batch, &answers));
    const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
    best = std::fmax(best, static_cast<double>(count) / seconds.count() / 1e6);
  }
  std::printf("%f %d\n", best, std::accumulate(visible.begin(), visible.end(), 0));
  nifReleaseScene(scene);
  nifReleaseAsset(asset);
  nifReleaseDevice(device);
}
