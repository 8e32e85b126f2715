// Writes objects as shaders read them, with rays and what nifQuery answers on the CPU, for hosts that are no C++ programs:
// tests/shader/wgsl/answer.mjs reads them.
//
//   shader_cases FOLDER RAYS    RAYS: of each named set through a baked torus; fewer through other objects
//
// A case is one file of 32-bit words: 0x4353494e, 1 if it is a scene, its words, rays, 1 if it has triangles, 1 if it asks for
// first hits, 0, 0; then its words, the rays, 8 floats each as in NifRay, and the answers, 3 words each: bit 0 visible, bit 1
// certain, the logit, 0; of first hits bit 0 hit, the triangle, t. All numbers of rays are finite, because WGSL has neither
// infinities nor NaN. Beside each case lies its text, nif.wgsl with the sections that it needs; and sections-N.wgsl are all others.
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <stdexcept>
#include <string>

#include "tests/golden/golden.hpp"
#include "tests/gpu/baked.hpp"
#include "tests/runtime/open_answers.hpp"
#include "tests/support/query_object.hpp"
#include "tests/support/random_asset.hpp"
#include "tests/support/test_first_hits.hpp"
#include "tests/support/test_shapes.hpp"
#include "tools/export_shader/shader_sections.hpp"

namespace nif::test {
namespace {

class Writer {
 public:
  explicit Writer(std::filesystem::path folder) : folder_(std::move(folder)) {}

  /// All combinations of sections that have something to ask.
  void write_texts() const {
    for (int bits = 0; bits < 32; ++bits) {
      const tools::ShaderSections sections{(bits & 1) != 0, (bits & 2) != 0, (bits & 4) != 0, (bits & 8) != 0,
                                           (bits & 16) != 0};
      if ((sections.planes || sections.triangles) && sections.planes >= sections.network &&
          sections.triangles >= sections.first_hits)
        write_text("sections-" + std::to_string(bits), sections);
    }
  }

  void write(const std::string& name, const nifkit::Scene& scene, bool is_scene,
             const std::vector<uint32_t>& words, bool has_triangles, std::vector<NifRay> rays) const {
    make_finite(rays);
    std::vector<uint8_t> visible(rays.size()), certain(rays.size());
    std::vector<int32_t> logits(rays.size());
    scene.query(nifkit::Rays(rays), nifkit::Answers().visible(visible).certain(certain).logit(logits));
    std::vector<uint32_t> answers;
    for (size_t i = 0; i < rays.size(); ++i)
      answers.insert(answers.end(), {uint32_t(visible[i] | certain[i] << 1), uint32_t(logits[i]), 0u});
    put(name, {0x4353494e, is_scene, uint32_t(words.size()), uint32_t(rays.size()), has_triangles, 0, 0, 0},
        words, rays, answers);
  }

  /// First hits.
  void write_hits(const std::string& name, const nifkit::Scene& scene, bool is_scene,
                  const std::vector<uint32_t>& words, std::vector<NifRay> rays) const {
    make_finite(rays);
    FirstHits hits(rays.size());
    const NifRays asked = nifMakeRays(rays.data(), rays.size());
    const NifHits outputs = hits.outputs();
    if (nifIntersect(scene.get(), &asked, &outputs) != NIF_OK) throw std::runtime_error(nifGetErrorMessage());
    std::vector<uint32_t> answers;
    for (size_t i = 0; i < rays.size(); ++i)
      answers.insert(answers.end(), {hits.hit[i], hits.triangle[i], std::bit_cast<uint32_t>(hits.t[i])});
    put(name, {0x4353494e, is_scene, uint32_t(words.size()), uint32_t(rays.size()), 1, 1, 0, 0}, words, rays,
        answers);
  }

  /// One object alone, in its own space; if it has triangles, also first hits of some of the rays.
  void write_object(const std::string& name, const nifkit::Device& device, const nifkit::Asset& asset,
                    uint32_t object, std::vector<NifRay> rays) const {
    nifkit::Scene scene(device);
    scene.add_instance(asset, object);
    scene.commit();
    const std::vector<uint32_t> words = asset.shader_tables(object);
    const bool has_triangles = (words[3] & 4) != 0;
    if (has_triangles) {
      const size_t some = std::min(rays.size(), kHits);
      write_hits("hits-" + name, scene, false, words, {rays.begin(), rays.begin() + ptrdiff_t(some)});
    }
    write(name, scene, false, words, has_triangles, std::move(rays));
  }

 private:
  static constexpr size_t kHits = 10'000;

  static void make_finite(std::vector<NifRay>& rays) {
    for (NifRay& ray : rays) {  // large, as docs/shaders.md says
      ray.tmin = std::max(ray.tmin, -1e30f);
      ray.tmax = std::min(ray.tmax, 1e30f);
    }
    std::erase_if(rays, [](const NifRay& ray) {
      const float* const numbers = ray.origin;
      return !std::all_of(numbers, numbers + 8, [](float number) { return std::isfinite(number); });
    });
  }
  void put(const std::string& name, std::vector<uint32_t> file, const std::vector<uint32_t>& words,
           const std::vector<NifRay>& rays, const std::vector<uint32_t>& answers) const {
    file.insert(file.end(), words.begin(), words.end());
    for (const NifRay& ray : rays)
      for (size_t i = 0; i < 8; ++i) file.push_back(std::bit_cast<uint32_t>((&ray.origin[0])[i]));
    file.insert(file.end(), answers.begin(), answers.end());
    write_file(name + ".case", file.data(), 4 * file.size());

    tools::ShaderSections sections;
    sections.scenes = file[1] != 0;
    if (!sections.scenes) sections.add_object(words[3]);
    for (uint32_t i = 0; sections.scenes && i < words[4]; ++i)
      sections.add_object(words[(words[16 + 24 * i + 21] & 0x1fffffffu) + 3]);
    write_text(name, sections);
  }
  void write_text(const std::string& name, const tools::ShaderSections& sections) const {
    const std::string text = cut_shader(nifkit::shader_source(NIF_SHADER_WGSL), sections);
    write_file(name + ".wgsl", text.data(), text.size());
  }
  void write_file(const std::string& name, const void* bytes, size_t size) const {
    const std::filesystem::path path = folder_ / name;
    std::ofstream out(path, std::ios::binary);
    out.write(static_cast<const char*>(bytes), std::streamsize(size));
    out.close();
    if (!out) throw std::runtime_error(path.string() + ": cannot be written");
  }

  std::filesystem::path folder_;
};

bool has_tables(const nifkit::Asset& asset, uint32_t object) {
  uint64_t count = 0;
  return nifGetShaderTables(asset.get(), object, nullptr, 0, &count) == NIF_OK;
}

std::vector<NifRay> to_rays(const std::vector<kernels::Segment>& segments) {
  std::vector<NifRay> rays;
  for (const kernels::Segment& segment : segments) rays.push_back(to_nif_ray(segment));
  return rays;
}

void write_cases(const Writer& writer, size_t count) {
  writer.write_texts();
  const nifkit::Device device("shaders=on");
  for (const char* encoding : {"segment", "proof", "bvh", "exact"}) {
    const Baked baked(torus(60, 30), encoding);
    const nifkit::Asset asset = nifkit::Asset::load(device, std::span<const std::byte>(baked.file));
    const bake::Prepared prepared = bake::prepare(baked.scene.meshes[0]);
    const bake::GroundTruth truth(prepared);
    for (const bake::RaySet set : bake::kRaySets)
      writer.write_object(std::string(encoding) + "-" + std::string(bake::name_of(set)), device, asset, 0,
                          to_rays(bake::draw_ray_set(truth.source(), set, count, 7).segments));
  }
  const size_t some = std::min<size_t>(count, 50'000);
  for (uint64_t seed = 1; seed <= 3; ++seed) {
    const auto file =
        format::encode(random_asset(seed, {.objects = 2, .instances = 6, .proofs = 1, .features = 2}));
    const format::AssetView view = format::read_asset(file, "test");
    const nifkit::Asset asset = nifkit::Asset::load(device, std::span<const std::byte>(file));
    for (uint32_t i = 0; i < view.objects.size(); ++i) {
      if (!has_tables(asset, i)) continue;
      Random random(seed + i);
      std::vector<NifRay> rays(some);
      for (NifRay& ray : rays) ray = to_nif_ray(random_segment(random, view.objects[i]));
      writer.write_object("random-" + std::to_string(seed) + "-" + std::to_string(i), device, asset, i,
                          std::move(rays));
    }
    nifkit::Scene scene(device);
    scene.add_asset(asset);
    scene.commit();
    writer.write("scene-" + std::to_string(seed), scene, true, scene.shader_tables(), false,
                 rays_near(view, seed, some));
  }
  const auto file =
      format::encode(random_asset(4, {.objects = 0, .instances = 5, .bvhs = 1, .exacts = 1, .sources = 1}));
  const format::AssetView view = format::read_asset(file, "test");
  const nifkit::Asset asset = nifkit::Asset::load(device, std::span<const std::byte>(file));
  nifkit::Scene scene(device);
  scene.add_asset(asset);
  scene.commit();
  writer.write_hits("hits-scene", scene, true, scene.shader_tables(), rays_near(view, 4, some));
  for (const auto& entry : std::filesystem::directory_iterator(NIF_GOLDEN_FOLDER)) {
    std::filesystem::path path = entry.path();
    if (path.extension() != ".nif") continue;
    const nifkit::Asset asset = nifkit::Asset::load(device, path.string());
    std::ifstream file(path.replace_extension(".answers"), std::ios::binary);
    std::map<uint32_t, std::vector<NifRay>> of_object;
    for (GoldenAnswer golden; file.read(reinterpret_cast<char*>(&golden), sizeof(golden));)
      of_object[golden.object].push_back(to_nif_ray(golden.ray));
    for (auto& [object, rays] : of_object)
      if (has_tables(asset, object))
        writer.write_object("golden-" + path.stem().string() + "-" + std::to_string(object), device, asset,
                            object, std::move(rays));
  }
}

}  // namespace
}  // namespace nif::test

int main(int argc, char** argv) {
  const long rays = argc == 3 ? std::atol(argv[2]) : 0;
  if (rays < 1 || rays > 10'000'000) {
    std::fprintf(stderr, "usage: shader_cases FOLDER RAYS, at most 10,000,000\n");
    return 2;
  }
  try {
    nif::test::write_cases(nif::test::Writer(argv[1]), size_t(rays));
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "shader_cases: %s\n", error.what());
    return 1;
  }
}
