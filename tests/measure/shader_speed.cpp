// A study, not a test: how fast shaders answer rays by assets, and rivals by the same triangles. docs/results/shaders.sh runs it.
//
// shader_speed RAYS ROUNDS ASSET...
//
// Two sets of rays, drawn from the first asset, which must have triangles: `lines` from a sphere around it to points in its
// bounds, and `bounces` from what those hit, in any direction. All answer the same rays by turns: assets of one object that is not turned by
// nif_query and nif_first_hit, fields without the text for triangles, others as scenes. If the first asset is but one object of `bvh`, two rivals with a stack answer, too (shader_rivals). Prints a
// line for each of them and set: triangles, bytes of the words, millions of rays a second of one core for visibility and for
// first hits ("-" if it has none), the share of answers that are not certain of each, how many certain ones are not those of
// nifQuery for that asset, and the share that is not nifQuery's for the first asset. The time is that of the processor in the
// fastest run with all rays, less that of the fastest with none of them.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <optional>

#include "formats/nif/file_memory.hpp"
#include "formats/nif/reader.hpp"
#include "kernels/shader/shader_tables.hpp"
#include "tests/measure/shader_rivals/rivals.hpp"
#include "tests/shader/shader_fixture.hpp"
#include "tests/support/query_answers.hpp"
#include "tests/support/test_first_hits.hpp"
#include "tests/support/test_random.hpp"
#include "tests/support/to_world.hpp"

namespace {

using namespace nif;
using namespace nif::test;

/// Of the processor, by all threads: other programs take turns with this one.
double now() {
  timespec time;
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return double(time.tv_sec) + 1e-9 * double(time.tv_nsec);
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

/// What answers rays: an asset, or a rival.
struct Contestant {
  std::string name;
  std::vector<uint32_t> words;
  uint64_t triangles = 0;
  std::string visibility, hits;  ///< shaders; `hits` is empty if it finds none
  std::optional<nifkit::Scene> scene;
  bool is_scene = false;
};

Contestant place(const nifkit::Device& device, const std::string& path) {
  Contestant made{std::filesystem::path(path).stem().string(), {}, 0, "", "", nifkit::Scene(device), true};
  const nifkit::Asset asset = nifkit::Asset::load(device, path);
  made.scene->add_asset(asset);
  made.scene->commit();
  made.words = made.scene->shader_tables();
  const NifAssetInfo about = asset.info();
  bool has_triangles = false;
  for (uint32_t i = 0; i < about.object_count; ++i) {
    made.triangles += asset.object(i).triangles;
    has_triangles = has_triangles || (asset.shader_tables(i)[3] & 4) != 0;
  }
  const uint32_t only = made.words[kernels::shader::kSceneWords + kernels::shader::kObjectWord];
  made.is_scene = about.object_count > 1 || (only & kernels::shader::kIdentityBit) == 0;
  if (!made.is_scene) made.words = asset.shader_tables(0);
  made.visibility = made.is_scene ? "default_scene" : has_triangles ? "default" : "planes";
  if (has_triangles) made.hits = made.is_scene ? "hits_scene" : "hits";
  return made;
}

/// Of an asset's only object.
std::vector<Contestant> rivals_of(const std::string& path) {
  const auto memory = format::FileMemory::load(path, format::FileMemory::Mode::read);
  const format::AssetView view = format::read_asset(memory.bytes(), path);
  if (view.objects.size() != 1 || view.instances.size() != 1 ||
      !view.objects[0].is<kernels::TrianglesField>() || view.objects[0].triangle_count < 2)
    return {};
  const auto field = view.objects[0].as<kernels::TrianglesField>();
  std::vector<Contestant> rivals;
  rivals.push_back({"BVH2, stack", binary_rival(field), field.triangle_count, "rival_binary", "", {}, false});
  rivals.push_back({"CWBVH, stack", wide_rival(field), field.triangle_count, "rival_wide", "", {}, false});
  return rivals;
}

std::vector<Set> draw(const Contestant& from, size_t count) {
  Random random(5);
  const NifSceneInfo about = from.scene->info();
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
  if (nifIntersect(from.scene->get(), &asked, &outputs) != NIF_OK)
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
  std::string speed(size_t kind, size_t rays) const {
    return with[kind] == 1e9 ? "-"
                             : fmt::format("{:.3f}", double(rays) / (with[kind] - without[kind]) * 1e-6);
  }
};

/// Shares of all rays, in percent; and a number.
struct Counts {
  size_t open = 0, open_hits = 0, wrong = 0, other = 0;
};

Answers ask(const nifkit::Scene& scene, const std::vector<NifRay>& rays) {
  Answers answers(rays.size());
  const NifRays asked = nifMakeRays(rays.data(), rays.size());
  const NifAnswers outputs = answers.outputs();
  if (nifQuery(scene.get(), &asked, &outputs) != NIF_OK) throw std::runtime_error(nifGetErrorMessage());
  return answers;
}

Counts compare(VulkanCompute& vulkan, const Contestant& contestant, const Set& set, const Answers& truth) {
  const std::vector<kernels::Segment> segments = set.segments();
  const auto answers = ask_shader(vulkan, shader_code(contestant.visibility), contestant.words, 0, segments);
  Counts counts;
  for (size_t k = 0; k < segments.size(); ++k) {
    counts.open += !answers[k].certain;
    counts.other += answers[k].visible != truth.visible[k];
  }
  if (!contestant.scene) return counts;
  const Answers cpu = ask(*contestant.scene, set.rays);
  for (size_t k = 0; k < segments.size(); ++k)
    counts.wrong += answers[k].certain && answers[k].visible != cpu.visible[k];
  if (contestant.hits.empty()) return counts;
  FirstHits hits(segments.size());
  const NifRays asked = nifMakeRays(set.rays.data(), segments.size());
  const NifHits outputs = hits.outputs();
  if (nifIntersect(contestant.scene->get(), &asked, &outputs) != NIF_OK)
    throw std::runtime_error(nifGetErrorMessage());
  const auto found = hits_of_shader(vulkan, shader_code(contestant.hits), contestant.words, segments);
  for (size_t k = 0; k < segments.size(); ++k) {
    counts.open_hits += !found[k].certain;
    counts.wrong +=
        found[k].certain && (found[k].hit != hits.hit[k] || found[k].triangle != hits.triangle[k]);
  }
  return counts;
}

}  // namespace

int main(int count, char** arguments) {
  if (count < 4) return 2;
  const size_t rays = std::strtoull(arguments[1], nullptr, 10);
  const int rounds = std::atoi(arguments[2]);
  const nifkit::Device device("shaders=on");
  std::vector<Contestant> all;
  for (int i = 3; i < count; ++i) all.push_back(place(device, arguments[i]));
  for (Contestant& rival : rivals_of(arguments[3])) all.push_back(std::move(rival));
  VulkanCompute vulkan;
  for (const Set& set : draw(all[0], rays)) {
    const std::vector<kernels::Segment> segments = set.segments();
    std::vector<Row> rows(all.size());
    for (int round = 0; round <= rounds; ++round)
      for (size_t i = 0; i < all.size(); ++i)
        for (size_t kind = 0; kind < 2; ++kind) {
          if (kind == 1 && all[i].hits.empty()) continue;
          const auto code = shader_code(kind == 0 ? all[i].visibility : all[i].hits);
          const auto run = [&](uint32_t mask) {
            const double start = now();
            run_for_rays(vulkan, code, all[i].words, 0, segments, mask, kind == 0 ? 8 : kHitWords);
            return now() - start;
          };
          const double without = run(0), with = run(0xffffffffu);
          if (round == 0) continue;  // compiles
          rows[i].without[kind] = std::min(rows[i].without[kind], without);
          rows[i].with[kind] = std::min(rows[i].with[kind], with);
        }
    const Answers truth = ask(*all[0].scene, set.rays);
    for (size_t i = 0; i < all.size(); ++i) {
      const size_t n = segments.size();
      const Counts counts = compare(vulkan, all[i], set, truth);
      const auto percent = [&](size_t of) { return fmt::format("{:.4f}", 100 * double(of) / double(n)); };
      fmt::print("{}\t{}\t{}\t{}\t{}\t{}\t{}\t{}\t{}\t{}\n", all[i].name, set.name, all[i].triangles,
                 4 * all[i].words.size(), rows[i].speed(0, n), rows[i].speed(1, n), percent(counts.open),
                 all[i].hits.empty() ? "-" : percent(counts.open_hits),
                 all[i].scene ? std::to_string(counts.wrong) : "-", percent(counts.other));
      std::fflush(stdout);
    }
  }
}
