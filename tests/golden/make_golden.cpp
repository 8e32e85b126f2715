// make_golden SEED NAME [BVHS [SPHERICALS [CODED [EXACTS [PROOFS [SOURCES [COLORS [TRANSLATIONS [CUTOUTS [SKINS]]]]]]]]]]:
// writes NAME.nif, with so many `bvh`, `spherical`, `exact` and `proof` objects after the others, coded what
// the bits of CODED say (test::kCodedAll), so many of all with source triangles, so many with colours, and if
// TRANSLATIONS is not 0 with instances where floats are too coarse, so many `cutout` objects, and so many `bvh`
// objects that bend; and NAME.answers and NAME.hits. For what the format newly holds only: files that are in this folder are never made anew.
//
// make_golden --row SEED NAME: likewise, with a row of voxels, once with a network and once without. Rays have
// more open cells than are kept.
//
// make_golden --hits SEED FILE.nif...: writes the hits of assets that are there already.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "formats/base/output_file.hpp"
#include "formats/base/status.hpp"
#include "formats/nif/file_memory.hpp"
#include "formats/nif/writer.hpp"
#include "tests/golden/golden.hpp"
#include "tests/support/query_object.hpp"
#include "tests/support/row_of_voxels.hpp"

namespace {

using namespace nif;

/// For each object and for the whole asset.
constexpr int kHitsOfObject = 50, kHitsOfAsset = 100;

/// Invalid rays, and rays from far away.
void make_odd(test::Random& random, kernels::Segment& ray) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity(),
                  kNaN = std::numeric_limits<float>::quiet_NaN();
  const uint32_t axis = random.below(3);
  switch (random.below(10)) {
    case 0:
      std::swap(ray.tmin, ray.tmax);
      break;
    case 1:
      ray.tmax = kNaN;
      break;
    case 2:
      ray.origin[axis] = random.below(2) ? kNaN : kInfinity;
      break;
    case 3:
      ray.direction[axis] = random.below(2) ? kNaN : kInfinity;
      break;
    case 4:
      std::fill_n(ray.direction, 3, 0.0f);
      break;
    case 5:
      ray.direction[axis] *= 0x1p-45f;
      break;
    case 6:
      std::for_each_n(ray.direction, 3, [](float& d) { d *= 0x1p-70f; });
      break;
    default: {  // the same line, from so far away
      const float back = std::ldexp(1.0f, random.between(4, 30));
      for (size_t a = 0; a < 3; ++a) ray.origin[a] -= ray.direction[a] * back;
      ray.tmin = 0;
      ray.tmax = kInfinity;
    }
  }
}

/// Through a corner, perhaps of several triangles, as exactly as numbers with few digits allow.
kernels::Segment corner_ray(test::Random& random, const kernels::TrianglesField& field) {
  kernels::Segment ray{{}, {}, 0, std::numeric_limits<float>::infinity()};
  const float* corner = field.vertices[random.below(field.vertex_count)];
  for (size_t a = 0; a < 3; ++a) {
    ray.direction[a] = static_cast<float>(random.between(-8, 8)) / 64;
    ray.origin[a] = corner[a] - 4 * ray.direction[a];
  }
  return ray;
}

/// Along a grid of one voxel's thickness.
kernels::Segment row_ray(test::Random& random, const kernels::PlanesField& field) {
  const NifRay ray = test::rays_in_a_row(random, field, 1)[0];
  return {{ray.origin[0], ray.origin[1], ray.origin[2]},
          {ray.direction[0], ray.direction[1], ray.direction[2]},
          ray.tmin,
          ray.tmax};
}

kernels::Segment hit_ray(test::Random& random, const format::ObjectView& object) {
  kernels::Segment ray = test::random_segment(random, object);
  const kernels::TrianglesField* tree = object.triangles ? &object.triangles->field : nullptr;
  if (tree && random.below(3) == 0) ray = corner_ray(random, *tree);
  const kernels::PlanesField* grid = object.planes ? &object.planes->field : nullptr;
  if (grid && grid->voxels[0] == kernels::kMaxVoxels && random.below(2)) ray = row_ray(random, *grid);
  if (random.below(8) == 0) make_odd(random, ray);
  return ray;
}

kernels::Segment to_world(const float* m, const kernels::Segment& ray) {
  kernels::Segment world = ray;
  for (size_t r = 0; r < 3; ++r, m += 4) {
    world.origin[r] = m[0] * ray.origin[0] + m[1] * ray.origin[1] + m[2] * ray.origin[2] + m[3];
    world.direction[r] = m[0] * ray.direction[0] + m[1] * ray.direction[1] + m[2] * ray.direction[2];
  }
  return world;
}

void write_hits(uint64_t seed, const std::string& name, std::span<const std::byte> bytes) {
  const auto view = format::read_asset(bytes, name);
  const nifkit::Device device("isa=scalar");
  const auto asset = nifkit::Asset::load(device, bytes);
  test::Random random(seed + 0x68697473);
  std::vector<test::GoldenHit> hits;
  const auto ask = [&](uint32_t scene, const std::vector<kernels::Segment>& rays) {
    const auto more = test::golden_hits(test::golden_scene(device, asset, scene), scene, rays);
    hits.insert(hits.end(), more.begin(), more.end());
  };
  for (uint32_t object = 0; object < view.objects.size(); ++object) {
    std::vector<kernels::Segment> rays;
    for (int i = 0; i < kHitsOfObject; ++i) rays.push_back(hit_ray(random, view.objects[object]));
    ask(object, rays);
  }
  std::vector<kernels::Segment> rays;
  for (int i = 0; i < kHitsOfAsset; ++i) {
    const uint32_t instances = asset.info().instance_count;
    if (instances == 0) {  // each object once
      rays.push_back(hit_ray(random, view.objects[random.below(uint32_t(view.objects.size()))]));
      continue;
    }
    const NifAssetInstanceInfo placed = asset.instance(random.below(instances));
    rays.push_back(to_world(placed.transform, hit_ray(random, view.objects[placed.object])));
  }
  ask(test::kWholeAsset, rays);
  write_output(name + ".hits", std::as_bytes(std::span(hits)));
}

void write_asset(uint64_t seed, const std::string& name, const format::Asset& asset) {
  const auto bytes = format::encode(asset);
  const auto view = format::read_asset(bytes, name);
  std::vector<test::GoldenAnswer> answers;
  test::Random random(seed);
  for (uint32_t object = 0; object < view.objects.size(); ++object)
    for (int i = 0; i < 300; ++i) {
      const kernels::Segment ray = test::random_segment(random, view.objects[object]);
      const kernels::Answer answer = test::query_object(view.objects[object], ray);
      answers.push_back({object, ray, answer.logit, answer.visible, answer.certain, 0});
    }
  write_output(name + ".nif", bytes);
  write_output(name + ".answers", std::as_bytes(std::span(answers)));
  write_hits(seed, name, bytes);
}

/// Where floats are 1/16 apart: instances near each other, at multiples of 1/1024.
void move_far_away(uint64_t seed, format::Asset& asset) {
  test::Random random(seed);
  for (size_t a = 0; a < 3; ++a) {
    const uint32_t place = (1u << 29) + random.below(1u << 29);
    for (format::Instance& instance : asset.instances) {
      const double exact = std::ldexp(double(place + random.below(1u << 13)), -10);
      instance.transform[4 * a + 3] = static_cast<float>(exact);
      instance.remainder[a] = static_cast<float>(exact - double(instance.transform[4 * a + 3]));
    }
  }
}

void make(uint64_t seed, const std::string& name, uint32_t bvhs, uint32_t sphericals, uint32_t coded,
          uint32_t exacts, uint32_t proofs, uint32_t sources, uint32_t colors, bool translations,
          uint32_t cutouts, uint32_t skins) {
  test::RandomAssetOptions options;
  options.objects = 1 + uint32_t(seed % 3);
  options.instances = 2 * uint32_t(seed % 3);
  options.max_voxels = 9;
  options.bvhs = bvhs;
  options.sphericals = sphericals;
  options.coded = coded;
  options.exacts = exacts;
  options.proofs = proofs;
  options.sources = sources;
  options.colors = colors;
  options.cutouts = cutouts;
  options.skins = skins;
  format::Asset asset = test::random_asset(seed, options);
  if (options.instances == 0) asset.metadata.clear();
  if (translations) move_far_away(seed, asset);
  write_asset(seed, name, asset);
}

void make_row(uint64_t seed, const std::string& name) {
  format::Asset asset = test::asset_of_a_row(seed);
  format::Object& bare = asset.objects.emplace_back(asset.objects[0]);
  bare.name = "planes alone";
  bare.network.reset();
  test::Random random(seed);
  for (uint32_t& word : bare.planes->voxel_records) word = test::random_planes(random, true);
  write_asset(seed, name, asset);
}

void add_hits(uint64_t seed, const std::string& path) {
  const auto memory = format::FileMemory::load(path, format::FileMemory::Mode::read);
  write_hits(seed, path.substr(0, path.rfind(".nif")), memory.bytes());
}

}  // namespace

int main(int argc, char** argv) {
  const bool hits = argc > 3 && argv[1] == std::string_view("--hits");
  const bool row = argc == 4 && argv[1] == std::string_view("--row");
  if (!hits && !row && (argc < 3 || argc > 13)) {
    std::fprintf(stderr,
                 "usage: make_golden SEED NAME [BVHS [SPHERICALS [CODED [EXACTS [PROOFS [SOURCES [COLORS "
                 "[TRANSLATIONS [CUTOUTS [SKINS]]]]]]]]]]\n"
                 "       make_golden --row SEED NAME\n"
                 "       make_golden --hits SEED FILE.nif...\n");
    return int(Status::usage);
  }
  try {
    const auto count = [&](int i) { return i < argc ? uint32_t(std::strtoul(argv[i], nullptr, 10)) : 0; };
    if (hits)
      for (int i = 3; i < argc; ++i) add_hits(std::strtoull(argv[2], nullptr, 10) + uint64_t(i), argv[i]);
    else if (row)
      make_row(std::strtoull(argv[2], nullptr, 10), argv[3]);
    else
      make(std::strtoull(argv[1], nullptr, 10), argv[2], count(3), count(4), count(5), count(6), count(7),
           count(8), count(9), count(10) != 0, count(11), count(12));
  } catch (const Error& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return int(error.status());
  } catch (const nifkit::Error& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return int(Status::internal);
  }
}
