// A study, not a test: how fast shaders answer rays by assets. docs/results/shaders.sh runs it.
//
// shader_speed RAYS ROUNDS ASSET...
//
// Two sets of rays, drawn from the first asset: `lines` from a sphere around it to points in its bounds, and `bounces` from
// what those hit, in any direction. All assets answer the same rays by turns, in query.spv's and hits.spv's scenes. Prints a
// line for each asset and set: triangles, instances, bytes of the words, millions of rays a second for visibility and for
// first hits, the share of answers that are not certain of each, and how many certain ones are not the CPU's. The time is
// that of the fastest run with all rays less that of the fastest with none of them.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <filesystem>

#include "tests/shader/shader_fixture.hpp"
#include "tests/support/query_answers.hpp"
#include "tests/support/test_first_hits.hpp"
#include "tests/support/test_random.hpp"
#include "tests/support/to_world.hpp"

namespace {

using namespace nif;
using namespace nif::test;

double now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

struct Set {
  const char* name;
  std::vector<NifRay> rays;
  std::vector<kernels::Segment> segments() const {
    std::vector<kernels::Segment> all;
    for (const NifRay& ray : rays) all.push_back(to_segment(ray));
    return all;
  }
};

struct Placed {
  std::string name;
  nifkit::Asset asset;
  nifkit::Scene scene;
  std::vector<uint32_t> words;
  uint64_t triangles = 0, instances = 0;

  Placed(const nifkit::Device& device, const std::string& path)
      : name(std::filesystem::path(path).stem().string()),
        asset(nifkit::Asset::load(device, path)),
        scene(device) {
    scene.add_asset(asset);
    scene.commit();
    words = scene.shader_tables();
    const NifAssetInfo about = asset.info();
    for (uint32_t i = 0; i < about.object_count; ++i) triangles += asset.object(i).triangles;
    instances = scene.info().instance_count;
  }
};

std::vector<Set> draw(const Placed& from, size_t count) {
  Random random(5);
  const NifSceneInfo about = from.scene.info();
  float radius = 0;
  for (size_t a = 0; a < 3; ++a) radius = std::max(radius, about.bounds_max[a] - about.bounds_min[a]);
  const auto direction = [&](float(&to)[3]) {
    float square;
    do {
      square = 0;
      for (float& x : to) x = random.between(-1.0f, 1.0f), square += x * x;
    } while (!(square > 0.01f && square <= 1));
    for (float& x : to) x /= std::sqrt(square);
  };
  std::vector<Set> sets = {{"lines", std::vector<NifRay>(count)}, {"bounces", {}}};
  for (NifRay& ray : sets[0].rays) {
    direction(ray.origin);
    for (size_t a = 0; a < 3; ++a) {
      const float low = about.bounds_min[a], high = about.bounds_max[a];
      ray.origin[a] = 0.5f * (low + high) + radius * ray.origin[a];
      ray.direction[a] = random.between(low, high) - ray.origin[a];
    }
    ray.tmin = 0;
    ray.tmax = INFINITY;
  }
  FirstHits hits(count);
  const NifRays asked = nifMakeRays(sets[0].rays.data(), count);
  const NifHits outputs = hits.outputs();
  if (nifIntersect(from.scene.get(), &asked, &outputs) != NIF_OK)
    throw std::runtime_error(nifGetErrorMessage());
  for (size_t i = 0; i < count; ++i) {
    if (!hits.hit[i]) continue;
    NifRay ray = sets[0].rays[i];
    for (size_t a = 0; a < 3; ++a)
      ray.origin[a] += hits.t[i] * ray.direction[a] + 1e-3f * radius * hits.normal[3 * i + a];
    direction(ray.direction);
    sets[1].rays.push_back(ray);
  }
  return sets;
}

struct Row {
  double with[2] = {1e9, 1e9}, without[2] = {1e9, 1e9};
  double seconds(size_t kind) const { return with[kind] - without[kind]; }
  double open[2] = {};
  size_t wrong = 0;
};

}  // namespace

int main(int count, char** arguments) {
  if (count < 4) return 2;
  const size_t rays = std::strtoull(arguments[1], nullptr, 10);
  const int rounds = std::atoi(arguments[2]);
  const nifkit::Device device("shaders=on");
  std::vector<std::unique_ptr<Placed>> all;
  for (int i = 3; i < count; ++i) all.push_back(std::make_unique<Placed>(device, arguments[i]));
  VulkanCompute vulkan;
  const std::vector<uint32_t> code[2] = {shader_code("default_scene"), shader_code("hits_scene")};
  for (const Set& set : draw(*all[0], rays)) {
    const std::vector<kernels::Segment> segments = set.segments();
    std::vector<Row> rows(all.size());
    for (int round = 0; round <= rounds; ++round)
      for (size_t i = 0; i < all.size(); ++i)
        for (size_t kind = 0; kind < 2; ++kind) {
          const size_t each = kind == 0 ? 8 : 12;
          const auto run = [&](uint32_t mask) {
            const double start = now();
            run_for_rays(vulkan, code[kind], all[i]->words, 0, segments, mask, each);
            return now() - start;
          };
          const double without = run(0), with = run(0xffffffffu);
          if (round == 0) continue;  // compiles
          rows[i].without[kind] = std::min(rows[i].without[kind], without);
          rows[i].with[kind] = std::min(rows[i].with[kind], with);
        }
    for (size_t i = 0; i < all.size(); ++i) {
      const size_t n = segments.size();
      FirstHits hits(n);
      const NifRays asked = nifMakeRays(set.rays.data(), n);
      const NifHits hit_outputs = hits.outputs();
      Answers cpu(n);
      const NifAnswers outputs = cpu.outputs();
      if (nifIntersect(all[i]->scene.get(), &asked, &hit_outputs) != NIF_OK ||
          nifQuery(all[i]->scene.get(), &asked, &outputs) != NIF_OK)
        throw std::runtime_error(nifGetErrorMessage());
      const auto answers = ask_shader(vulkan, code[0], all[i]->words, 0, segments);
      const auto found = hits_of_shader(vulkan, code[1], all[i]->words, segments);
      Row& row = rows[i];
      for (size_t k = 0; k < n; ++k) {
        row.open[0] += !answers[k].certain;
        row.open[1] += !found[k].certain;
        row.wrong += answers[k].certain && answers[k].visible != cpu.visible[k];
        row.wrong +=
            found[k].certain && (found[k].hit != hits.hit[k] || found[k].triangle != hits.triangle[k]);
      }
      fmt::print("{}\t{}\t{}\t{}\t{}\t{:.3f}\t{:.3f}\t{:.4f}\t{:.4f}\t{}\n", all[i]->name, set.name,
                 all[i]->triangles, all[i]->instances, 4 * all[i]->words.size(),
                 double(n) / row.seconds(0) * 1e-6, double(n) / row.seconds(1) * 1e-6,
                 100 * row.open[0] / double(n), 100 * row.open[1] / double(n), row.wrong);
      std::fflush(stdout);
    }
  }
}
