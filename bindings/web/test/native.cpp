// native ASSET RAYS OUT: writes the answers of this machine's library, for package.test.mjs to compare. For
// each object of the asset, and for the whole asset placed by a transform: RAYS rays (a multiple of 8) and
// all their outputs.
#include <nif/nif.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <vector>

namespace {

void must(NifError error) {
  if (error == NIF_OK) return;
  std::fprintf(stderr, "%s\n", nifGetErrorMessage());
  std::exit(1);
}

/// Rays through and around the box; some along axes, some invalid.
std::vector<NifRay> make_rays(const float (&low)[3], const float (&high)[3], size_t count) {
  std::mt19937 random(19);
  const auto unit = [&] { return static_cast<float>(random() >> 8) * 0x1p-24f; };
  const auto point = [&](int a) { return low[a] + (high[a] - low[a]) * (1.5f * unit() - 0.25f); };
  std::vector<NifRay> rays(count);
  for (NifRay& ray : rays) {
    for (int a = 0; a < 3; ++a) {
      ray.origin[a] = point(a);
      ray.direction[a] = point(a) - ray.origin[a];
      if (random() % 16 == 0) ray.direction[a] = 0;
    }
    ray.tmin = random() % 2 ? 0 : unit() / 2;
    ray.tmax = random() % 2 ? INFINITY : 0.5f + unit();
    if (random() % 256 == 0) ray.origin[random() % 3] = NAN;
  }
  return rays;
}

template <class T>
void write(std::FILE* out, const std::vector<T>& values) {
  if (std::fwrite(values.data(), sizeof(T), values.size(), out) != values.size()) std::abort();
}

void answer(NifScene scene, size_t count, std::FILE* out) {
  must(nifCommitScene(scene));
  NifSceneInfo info{};
  info.struct_size = sizeof(info);
  must(nifGetSceneInfo(scene, &info));
  const std::vector<NifRay> rays = make_rays(info.bounds_min, info.bounds_max, count);
  std::vector<uint8_t> visible(count), bits(count / 8), certain(count), hit(count), proven(count);
  std::vector<float> probability(count), t(count), normal(3 * count), u(count), v(count), low(count),
      high(count), color(3 * count);
  std::vector<int32_t> logit(count);
  std::vector<uint32_t> instance(count), object(count), triangle(count);
  std::vector<uint64_t> user(count);
  const NifRays batch = nifMakeRays(rays.data(), count);
  NifHits hits{};
  hits.struct_size = sizeof(hits);
  hits.hit = hit.data();
  hits.t = t.data();
  hits.normal = normal.data();
  hits.instance = instance.data();
  hits.object = object.data();
  hits.triangle = triangle.data();
  hits.u = u.data();
  hits.v = v.data();
  hits.certain = proven.data();
  hits.t_low = low.data();
  hits.t_high = high.data();
  hits.color = color.data();
  hits.user = user.data();
  must(nifIntersect(scene, &batch, &hits));
  NifAnswers answers{};
  answers.struct_size = sizeof(answers);
  answers.visible = visible.data();
  answers.visible_bits = bits.data();
  answers.probability = probability.data();
  answers.certain = certain.data();
  answers.logit = logit.data();
  must(nifQuery(scene, &batch, &answers));
  write(out, rays);
  write(out, visible), write(out, bits), write(out, probability), write(out, certain), write(out, logit);
  write(out, hit), write(out, t), write(out, normal), write(out, instance), write(out, object),
      write(out, triangle);
  write(out, u), write(out, v), write(out, proven), write(out, low), write(out, high), write(out, color);
  write(out, user);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4) return 2;
  const size_t count = std::strtoul(argv[2], nullptr, 10);
  NifDevice device = nullptr;
  NifAsset asset = nullptr;
  must(nifNewDevice("threads=0", nullptr, &device));
  must(nifLoadAssetFile(device, argv[1], NIF_LOAD_COPY, &asset));
  NifAssetInfo info{};
  info.struct_size = sizeof(info);
  must(nifGetAssetInfo(asset, &info));
  std::FILE* const out = std::fopen(argv[3], "wb");
  if (!out) return 1;
  NifScene scene = nullptr;
  for (uint32_t i = 0; i < info.object_count; ++i) {
    must(nifNewScene(device, &scene));
    must(nifAddInstance(scene, asset, i, nullptr, nullptr));
    answer(scene, count, out);
    nifReleaseScene(scene);
  }
  const float transform[12] = {0, -2, 0, 1, 1.5f, 0, 0, 2, 0, 0.25f, 1, 3};
  must(nifNewScene(device, &scene));
  must(nifAddAsset(scene, asset, transform, nullptr, nullptr));
  answer(scene, count, out);
  if (std::fclose(out) != 0) return 1;
  nifReleaseScene(scene);
  nifReleaseAsset(asset);
  nifReleaseDevice(device);
}
