// Checks a GPU's answers, and times them: queries each asset's objects one by one and all together as a
// crowd, then the objects of all assets in one scene whose instances are masked, disabled, removed, moved and
// far away, then instances that bend by poses in the GPU's memory. Rays of several sets go to the scalar
// reference on the CPU and to the GPU: nifQuery, nifQueryOpen and nifIntersect, and each answer is compared.
// Prints a table in Markdown, and the first answers that differ to standard error. Ends with 1 if any answer
// differs, with 3 if there is no GPU. tests/gpu/run.sh builds it.
//
//   gpu_proof [--rays N] [--rounds N] [--device N] [--module FILE] [FILE.nif...]
//
// --rays: per set (10000000). --rounds: of timing (7), 0: nothing is timed. Without files it makes its own
// assets.
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <nif/nif.hpp>
#include <numeric>

#include "formats/base/status.hpp"
#include "formats/nif/file_memory.hpp"
#include "formats/nif/writer.hpp"
#include "outputs.hpp"
#include "proof_gpu.hpp"
#include "proof_ray_sets.hpp"
#include "tests/support/random_asset.hpp"

namespace nif::test {
namespace {

constexpr uint64_t kBatch = 1 << 20;  ///< rays that are queried, and timed, at once
constexpr size_t kFewRays = 1000;     ///< fewer are not worth timing
constexpr int kNoGpu = 3;

struct Options {
  uint64_t rays = 10'000'000;
  uint32_t rounds = 7, device = 0;
  std::string module;
  std::vector<std::string> files;
};

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

/// The same scene for three devices: the reference, the CPU at its best, and the GPU.
struct Scenes {
  explicit Scenes(const nifkit::Device (&devices)[3])
      : of{nifkit::Scene(devices[0]), nifkit::Scene(devices[1]), nifkit::Scene(devices[2])} {}
  nifkit::Scene of[3];
};

/// What rays are asked about, besides the scene.
enum class Masked { no, each };

/// Of ray i: none, some and all bits.
uint32_t mask_of(uint64_t i) {
  constexpr uint32_t kMasks[] = {0xffffffff, 1, 2, 4, 0x80000000, 3, 0, 5};
  return kMasks[(i * 0x9e3779b97f4a7c15u) >> 61];
}

/// All 64 bits differ from instance to instance.
uint64_t user_of(uint32_t instance) { return (instance + 1) * 0x9e3779b97f4a7c15u; }

/// A crowd of an asset's objects: turned, mirrored, stretched, one in another.
nifkit::Transform placed(uint32_t i, double size) {
  nifkit::Transform t{};
  const double angle = 0.7 * i, scale = std::pow(1.3, double(i % 5) - 2), mirror = i % 3 == 1 ? -1 : 1;
  t[0] = float(scale * std::cos(angle));
  t[1] = float(-scale * std::sin(angle));
  t[4] = float(scale * std::sin(angle));
  t[5] = float(scale * std::cos(angle));
  t[10] = float(mirror * scale * (i % 4 == 2 ? 2.0 : 1.0));
  t[3] = float(0.4 * size * (i % 4));
  t[7] = float(0.4 * size * (i / 4 % 4));
  t[11] = float(0.3 * size * (i / 16));
  return t;
}

class Proof {
 public:
  Proof(const Options& options, const std::string& gpu)
      : options_(options),
        devices_{nifkit::Device("isa=scalar,threads=0"), nifkit::Device("threads=0"), nifkit::Device(gpu)},
        gpu_(Gpu::open(options.device, options.module)) {}

  const nifkit::Device& gpu() const { return devices_[2]; }
  uint64_t different() const { return different_; }
  const std::string& stages() const { return stages_; }

  void add_asset(const std::string& name, std::span<const std::byte> file) {
    std::vector<nifkit::Asset>& assets = assets_.emplace_back();
    for (const nifkit::Device& device : devices_) assets.push_back(nifkit::Asset::load(device, file));
    const uint32_t count = assets[0].info().object_count;
    double size = 0;
    for (uint32_t object = 0; object < count; ++object) {
      const NifObjectInfo info = assets[0].object(object);
      for (int a = 0; a < 3; ++a) size = std::max(size, double(info.bounds_max[a]) - info.bounds_min[a]);
      Scenes scenes(devices_);
      for (size_t d = 0; d < 3; ++d) scenes.of[d].add_instance(assets[d], object, placed(0, 0));
      std::string encoding;
      for (const kernels::EncodingName& known : kernels::kEncodings)
        if (known.number == uint32_t(info.encoding)) encoding = known.name;
      ask(name + " " + std::to_string(object) + ": " + encoding, scenes);
    }
    Scenes crowd(devices_);
    const uint32_t members = std::max(24u, 3 * count);
    for (size_t d = 0; d < 3; ++d)
      for (uint32_t i = 0; i < members; ++i) crowd.of[d].add_instance(assets[d], i % count, placed(i, size));
    ask(name + ": " + std::to_string(members) + " instances", crowd);
  }

  /// The objects of all assets, three of each, in one scene: as they are added, after every change that a scene
  /// can go through, with masks of rays, and with one instance left.
  void ask_mixed() {
    Scenes mixed(devices_);
    std::vector<std::pair<size_t, uint32_t>> objects;
    for (size_t asset = 0; asset < assets_.size(); ++asset)
      for (uint32_t object = 0; object < assets_[asset][0].info().object_count; ++object)
        objects.push_back({asset, object});
    const auto count = std::max(24u, uint32_t(3 * objects.size()));
    const auto add = [&](nifkit::Scene& scene, size_t d, uint32_t i) {
      const auto [asset, object] = objects[i % objects.size()];
      return scene.add_instance(assets_[asset][d], object, placed_alike(assets_[asset][0].object(object), i));
    };
    const auto change = [&](const auto& by) {
      for (size_t d = 0; d < 3; ++d) by(mixed.of[d], d);
    };
    change([&](nifkit::Scene& scene, size_t d) {
      for (uint32_t i = 0; i < count; ++i) {
        add(scene, d, i);
        scene.set_instance_user(i, user_of(i));
        scene.set_instance_mask(i, i % 4 == 0 ? 0xffffffff : 1u << i % 3);
        scene.set_instance_flags(i, i % 7 == 3 ? uint32_t(NIF_INSTANCE_DISABLED) : 0);
      }
    });
    ask("mixed: " + std::to_string(count) + " instances", mixed);

    // Every fifth is removed, and half as many are added, which take the lowest of these numbers. Others are
    // enabled, disabled, hidden and moved; all are 10,000 km away.
    const uint32_t again = (count + 9) / 10;
    const auto exists = [&](uint32_t i) { return i % 5 != 0 || i < 5 * again; };
    constexpr std::array<double, 3> kFar = {1e7 + 1e-4, -1e7, 3e6 + 0.3};
    change([&](nifkit::Scene& scene, size_t d) {
      for (uint32_t i = 0; i < count; i += 5) scene.remove_instance(i);
      for (uint32_t i = 0; i < again; ++i) scene.set_instance_user(add(scene, d, i), ~user_of(i));
      for (uint32_t i = 3; i < count; i += 14)
        if (i % 5 != 0) scene.set_instance_flags(i, 0);
      for (uint32_t i = 11; i < count; i += 20) scene.set_instance_flags(i, NIF_INSTANCE_DISABLED);
      for (uint32_t i = 12; i < count; i += 20) scene.set_instance_mask(i, 0);
      std::vector<uint32_t> moved;
      std::vector<nifkit::Transform> transforms;
      for (uint32_t i = 1; i < count; i += 10) {
        const auto [asset, object] = objects[i % objects.size()];
        moved.push_back(i);
        transforms.push_back(placed_alike(assets_[asset][0].object(object), i + 2));
      }
      scene.set_instance_transforms(moved, transforms);
      scene.set_origin(kFar);
      for (uint32_t i = 0; i < count; ++i)
        if (exists(i)) scene.set_instance_origin(i, {kFar[0] + 1e-3 * i, kFar[1], kFar[2] - 0.01 * (i % 3)});
    });
    ask("mixed, changed", mixed);
    ask("mixed, changed, masks", mixed, Masked::each);

    change([&](nifkit::Scene& scene, size_t) {
      for (uint32_t i = 0; i < count; ++i)
        if (exists(i) && i != 1) scene.set_instance_flags(i, NIF_INSTANCE_DISABLED);
    });
    ask("mixed, one left, masks", mixed, Masked::each);
  }

  /// Instances that bend, by a skin and by vertices in turn: the GPU's scene takes both from memory of the GPU.
  void ask_bent() {
    constexpr uint32_t kInstances = 24;
    format::Asset made = random_asset(2, {.objects = 0, .instances = 0, .bvhs = 1, .skins = 1});
    format::Object& object = made.objects[0];
    Random random(3);
    object.skin = random_skin(random, object.skin->vertex_count, 4, 2);
    const std::vector<std::byte> file = format::encode(made);
    std::vector<nifkit::Asset> assets;
    Scenes scenes(devices_);
    for (size_t d = 0; d < 3; ++d) {
      assets.push_back(nifkit::Asset::load(devices_[d], file));
      for (uint32_t i = 0; i < kInstances; ++i)
        scenes.of[d].add_instance(assets[d], 0, placed_alike(assets[0].object(0), i));
    }
    GpuArrays arrays(*gpu_);
    // Twice, so that the memory of the first poses is used again.
    for (uint32_t frame = 0; frame < 2; ++frame) {
      for (uint32_t i = 0; i < kInstances; ++i) {
        const bool by_skin = (i + frame) % 2 == 0;
        std::vector<float> joints(by_skin ? size_t{object.skin->joint_count} * 12 : 0), weights, positions;
        for (size_t k = 0; k < joints.size(); ++k)
          joints[k] = (k % 12 % 5 == 0 ? 1.0f : 0.0f) + random.between(-0.2f, 0.2f);
        for (uint32_t t = 0; by_skin && t < object.skin->target_count; ++t)
          weights.push_back(random.between(-0.5f, 0.5f));
        // A vertex of 5 words, as a compute shader might have it. Each of the object is one of the source.
        for (uint32_t v = 0; !by_skin && v < object.skin->vertex_count; ++v)
          for (size_t a = 0; a < 5; ++a) {
            const bool stored = v < object.triangles->vertices.size() && a < 3;
            positions.push_back(stored ? object.triangles->vertices[v][a] + random.between(-0.3f, 0.3f) : 0);
          }
        auto pose = nifkit::sized<NifPose>();
        pose.joints = by_skin ? joints.data() : nullptr;
        pose.weights = by_skin ? weights.data() : nullptr;
        pose.joint_count = uint32_t(joints.size() / 12);
        pose.target_count = uint32_t(weights.size());
        pose.positions = by_skin ? nullptr : positions.data();
        pose.position_stride = 20;
        for (size_t d = 0; d < 2; ++d) scenes.of[d].pose_instance(i, pose);
        if (by_skin) {
          pose.joints = arrays.copy(joints);
          pose.weights = arrays.copy(weights);
        } else {
          pose.positions = arrays.copy(positions);
        }
        pose.memory = NIF_MEMORY_DEVICE;
        pose.stream = gpu_->stream();
        scenes.of[2].pose_instance(i, pose);
      }
      for (nifkit::Scene& scene : scenes.of) scene.commit();
    }
    ask("bent: " + std::to_string(kInstances) + " instances", scenes);
  }

 private:
  /// placed(), of objects that are made alike large and lie around 0 first.
  static nifkit::Transform placed_alike(const NifObjectInfo& object, uint32_t i) {
    nifkit::Transform place = placed(i, 1);
    double size = 0;
    for (int a = 0; a < 3; ++a) size = std::max(size, double(object.bounds_max[a]) - object.bounds_min[a]);
    for (size_t row = 0; row < 3; ++row)
      for (size_t a = 0; a < 3; ++a) {
        const double scaled = place[4 * row + a] / size;
        place[4 * row + 3] -= float(scaled * 0.5 * (double(object.bounds_min[a]) + object.bounds_max[a]));
        place[4 * row + a] = float(scaled);
      }
    return place;
  }

  /// Counts the rays that differ, and prints the first few.
  template <class Some, class Differ>
  uint64_t count_different(const char* call, const Some& got, const Some& expected, size_t count,
                           const Differ& differs) {
    uint64_t different = 0;
    for (size_t i = 0; i < count; ++i) {
      if (!differs(got, expected, i) || ++different > 3 || printed_++ > 50) continue;
      const NifRay& ray = now_.rays[i];
      std::fprintf(
          stderr,
          "%s, %s: ray %llu (from %.9g %.9g %.9g, direction %.9g %.9g %.9g, t %.9g to %.9g, mask %x):\n"
          "  GPU: %s\n  CPU: %s\n",
          now_.what.c_str(), call, static_cast<unsigned long long>(now_.first + i), double(ray.origin[0]),
          double(ray.origin[1]), double(ray.origin[2]), double(ray.direction[0]), double(ray.direction[1]),
          double(ray.direction[2]), double(ray.tmin), double(ray.tmax),
          now_.masks.empty() ? 0xffffffffu : now_.masks[i], describe(got, i).c_str(),
          describe(expected, i).c_str());
    }
    return different;
  }
  template <class Some>
  uint64_t count_different(const char* call, const Some& got, const Some& expected, size_t count) {
    return count_different(call, got, expected, count,
                           [](const Some& a, const Some& b, size_t i) { return differ(a, b, i); });
  }

  void ask(const std::string& name, Scenes& scenes, Masked masked = Masked::no) {
    for (nifkit::Scene& scene : scenes.of) scene.commit();
    const NifSceneInfo info = scenes.of[0].info();
    for (const BoxRays set : kBoxRays) {
      uint64_t different = 0, different_open = 0, different_hits = 0;
      std::vector<double> pipeline, one_kernel, open, hits, cpu;
      std::vector<NifRay> open_rays;
      for (uint64_t first = 0; first < options_.rays; first += kBatch) {
        const uint64_t count = std::min(kBatch, options_.rays - first);
        now_ = {name + ", " + name_of(set),
                first,
                make_rays(set, info.bounds_min, info.bounds_max, 1, first, count, options_.rays),
                {}};
        if (masked == Masked::each)
          for (uint64_t i = 0; i < count; ++i) now_.masks.push_back(mask_of(first + i));
        Outputs expected(count);
        scenes.of[0].query(rays_now(), expected.answers());
        different +=
            compare_answers(scenes, expected, first == 0 && masked == Masked::each ? &one_kernel : nullptr);
        different_open += compare_open(scenes, first == 0 ? &open : nullptr);
        different_hits += compare_hits(scenes, first == 0 ? &hits : nullptr);
        if (first == 0) time(scenes, pipeline, one_kernel, cpu);
        for (size_t i = 0; i < count && open_rays.size() < kBatch && masked == Masked::no; ++i)
          if (!expected.certain[i]) open_rays.push_back(now_.rays[i]);
      }
      different_ += different + different_open + different_hits;
      std::printf("| %s | %s | %llu |", name.c_str(), name_of(set),
                  static_cast<unsigned long long>(options_.rays));
      for (const uint64_t count : {different, different_open, different_hits})
        std::printf(" %llu |", static_cast<unsigned long long>(count));
      if (options_.rounds > 0) {
        const double rays = double(std::min(kBatch, options_.rays)) * 1e-6;
        for (const auto* seconds : {&pipeline, &one_kernel, &open, &hits, &cpu})
          if (seconds->empty())
            std::printf(" - |");
          else
            std::printf(" %.1f |", rays / median(*seconds));
        time_stages(name + " | " + name_of(set), scenes, open_rays);
      }
      std::printf("\n");
      std::fflush(stdout);
    }
  }

  /// Has `ask` put work into the GPU's stream, and waits for it; once more for each round that is timed, by
  /// the host's clock, if seconds are wanted.
  template <class Ask>
  void in_stream(std::vector<double>* seconds, const Ask& ask) {
    for (uint32_t round = 0; round <= (seconds ? options_.rounds : 0); ++round) {
      const auto start = std::chrono::steady_clock::now();
      nifkit::check(ask());
      gpu_->wait();
      if (round > 0)
        seconds->push_back(std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
    }
  }

  nifkit::Rays rays_now() const {
    nifkit::Rays rays(now_.rays);
    if (!now_.masks.empty()) rays.masks(now_.masks);
    return rays;
  }
  /// The same in memory of the GPU that the program has from the driver, and in its stream.
  NifRays rays_there(GpuArrays& arrays) const {
    NifRays rays = nifMakeRays(arrays.copy(now_.rays), now_.rays.size());
    if (!now_.masks.empty()) {  // at an odd address
      std::vector<char> odd(1 + now_.masks.size() * sizeof(uint32_t));
      std::memcpy(odd.data() + 1, now_.masks.data(), odd.size() - 1);
      rays.mask = reinterpret_cast<const uint32_t*>(arrays.copy(odd) + 1);
      rays.mask_stride = sizeof(uint32_t);
    }
    rays.memory = NIF_MEMORY_DEVICE;
    rays.stream = gpu_->stream();
    return rays;
  }
  static NifAnswers outputs_there(GpuArrays& arrays, Outputs& host) {
    auto outputs = nifkit::sized<NifAnswers>();
    outputs.visible = arrays.output(host.visible, host.visible.size());
    outputs.visible_bits = arrays.output(host.bits, host.bits.size());
    outputs.probability = arrays.output(host.probability, host.probability.size());
    outputs.certain = arrays.output(host.certain, host.certain.size());
    outputs.logit = arrays.output(host.logit, host.logit.size());
    return outputs;
  }
  static void fetch(GpuArrays& arrays, const NifAnswers& outputs, Outputs& host) {
    arrays.fetch(host.visible, outputs.visible);
    arrays.fetch(host.bits, outputs.visible_bits);
    if (outputs.probability) arrays.fetch(host.probability, outputs.probability);
    if (outputs.certain) arrays.fetch(host.certain, outputs.certain);
    if (outputs.logit) arrays.fetch(host.logit, outputs.logit);
  }

  /// nifQuery: in memory of the host and of the GPU, by either way, with all outputs and with visibility
  /// alone, for which there are other kernels. The functions below return how many answers differ.
  uint64_t compare_answers(Scenes& scenes, const Outputs& expected, std::vector<double>* seconds) {
    const size_t count = now_.rays.size();
    uint64_t different = 0;
    for (const bool all : {true, false}) {
      const auto check = [&](const char* call, const Outputs& got) {
        different += all ? count_different(call, got, expected, count)
                         : count_different(call, got, expected, count, differ_visibly);
      };
      const auto wanted = [&](Outputs& got) {
        return all ? got.answers() : nifkit::Answers().visible(got.visible).visible_bits(got.bits);
      };
      Outputs copied(count);
      scenes.of[2].query(rays_now(), wanted(copied));
      check("nifQuery of host memory", copied);
      for (const NifMeasure way : {NIF_MEASURE_ONE_KERNEL, NIF_MEASURE_PIPELINE}) {
        if (!now_.masks.empty()) break;  // which are not measured
        Outputs measured(count);
        double once;
        measure(scenes, now_.rays, wanted(measured), way, 1, &once);
        check(way == NIF_MEASURE_PIPELINE ? "the pipeline" : "the one kernel", measured);
      }
      GpuArrays arrays(*gpu_);
      const NifRays query = rays_there(arrays);
      Outputs there(count);
      NifAnswers outputs = outputs_there(arrays, there);
      if (!all) outputs.probability = nullptr, outputs.certain = nullptr, outputs.logit = nullptr;
      in_stream(all ? nullptr : seconds, [&] { return nifQuery(scenes.of[2].get(), &query, &outputs); });
      fetch(arrays, outputs, there);
      check("nifQuery of device memory", there);
    }
    return different;
  }

  uint64_t compare_open(Scenes& scenes, std::vector<double>* seconds) {
    const size_t count = now_.rays.size();
    std::vector<uint32_t> numbers(count), instances(count), counted(1);
    std::vector<float> from(count), to(count);
    OpenOutputs expected(count), got(count);
    auto open = nifkit::sized<NifOpenRays>();
    open.capacity = count;
    open.rays = numbers.data();
    open.tmin = from.data();
    open.tmax = to.data();
    open.count = &expected.count;
    open.instance = instances.data();
    scenes.of[0].query_open(rays_now(), expected.answers(), open);
    expected.take(numbers, from, to, instances);

    GpuArrays arrays(*gpu_);
    const NifRays query = rays_there(arrays);
    const NifAnswers outputs = outputs_there(arrays, got);
    open.rays = arrays.output(numbers, count);
    open.tmin = arrays.output(from, count);
    open.tmax = arrays.output(to, count);
    open.instance = arrays.output(instances, count);
    open.count = arrays.copy(std::vector<uint32_t>{0xa5a5a5a5});
    in_stream(seconds, [&] { return nifQueryOpen(scenes.of[2].get(), &query, &outputs, &open); });
    fetch(arrays, outputs, got);
    arrays.fetch(numbers, open.rays);
    arrays.fetch(from, open.tmin);
    arrays.fetch(to, open.tmax);
    arrays.fetch(instances, open.instance);
    arrays.fetch(counted, open.count);
    got.count = counted[0];
    got.take(numbers, from, to, instances);
    return count_different("nifQueryOpen", got, expected, count) + (got.count != expected.count);
  }

  uint64_t compare_hits(Scenes& scenes, std::vector<double>* seconds) {
    FirstHits expected(now_.rays.size()), got(now_.rays.size());
    NifHits outputs = expected.outputs();
    nifkit::check(nifIntersect(scenes.of[0].get(), &rays_now().get(), &outputs));

    GpuArrays arrays(*gpu_);
    const NifRays query = rays_there(arrays);
    const auto each = [&](const auto& visit) {
      visit(outputs.hit, got.hit), visit(outputs.certain, got.certain);
      visit(outputs.t, got.t), visit(outputs.t_low, got.low), visit(outputs.t_high, got.high);
      visit(outputs.normal, got.normal), visit(outputs.color, got.color);
      visit(outputs.u, got.u), visit(outputs.v, got.v);
      visit(outputs.instance, got.instance), visit(outputs.object, got.object);
      visit(outputs.triangle, got.triangle), visit(outputs.user, got.user);
    };
    each([&](auto*& output, auto& host) { output = arrays.output(host, host.size()); });
    in_stream(seconds, [&] { return nifIntersect(scenes.of[2].get(), &query, &outputs); });
    each([&](auto*& output, auto& host) { arrays.fetch(host, output); });
    return count_different("nifIntersect", got, expected, got.hit.size());
  }

  /// Uses the GPU's clock; `seconds` as nifMeasureQuery writes them.
  static void measure(const Scenes& scenes, const std::vector<NifRay>& rays, const nifkit::Answers& answers,
                      NifMeasure way, uint32_t rounds, double* seconds) {
    nifkit::check(nifMeasureQuery(scenes.of[2].get(), &nifkit::Rays(rays).get(), &answers.get(rays.size()),
                                  way, rounds, seconds));
  }

  /// Requests only visibility, as a renderer would.
  void time(Scenes& scenes, std::vector<double>& pipeline, std::vector<double>& one_kernel,
            std::vector<double>& cpu) const {
    const std::vector<NifRay>& rays = now_.rays;
    if (options_.rounds == 0) return;
    std::vector<uint8_t> visible(rays.size());
    const nifkit::Answers answers = nifkit::Answers().visible(visible);
    for (const auto& [way, seconds] :
         {std::pair(NIF_MEASURE_PIPELINE, &pipeline), std::pair(NIF_MEASURE_ONE_KERNEL, &one_kernel)}) {
      if (!now_.masks.empty()) break;  // which are not measured
      seconds->resize(options_.rounds);
      measure(scenes, rays, answers, way, options_.rounds, seconds->data());
    }
    for (uint32_t round = 0; round <= options_.rounds; ++round) {
      const auto start = std::chrono::steady_clock::now();
      scenes.of[1].query(rays_now(), answers);
      if (round > 0)
        cpu.push_back(std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
    }
  }

  /// Of rays that nothing is proven about, by the pipeline: all of it, and its stages.
  void time_stages(const std::string& what, Scenes& scenes, const std::vector<NifRay>& rays) {
    if (rays.size() < kFewRays) return;
    std::vector<uint8_t> visible(rays.size());
    const nifkit::Answers answers = nifkit::Answers().visible(visible);
    const uint32_t rounds = options_.rounds;
    std::vector<double> whole(rounds), stages(size_t(rounds) * NIF_MEASURED_STAGES);
    measure(scenes, rays, answers, NIF_MEASURE_PIPELINE, rounds, whole.data());
    measure(scenes, rays, answers, NIF_MEASURE_STAGES, rounds, stages.data());
    const double microseconds = 1e6 * 1e6 / double(rays.size());
    char text[64];
    const auto add = [&](const char* format, double value) {
      std::snprintf(text, sizeof(text), format, value);
      stages_ += text;
    };
    stages_ += "| " + what;
    add(" | %.0f |", double(rays.size()));
    add(" %.1f |", microseconds * median(whole));
    for (size_t stage = 0; stage < NIF_MEASURED_STAGES; ++stage) {
      std::vector<double> of;
      for (uint32_t round = 0; round < rounds; ++round)
        of.push_back(stages[round * NIF_MEASURED_STAGES + stage]);
      add(" %.1f |", microseconds * median(of));
    }
    stages_ += "\n";
  }

  Options options_;
  nifkit::Device devices_[3];
  std::unique_ptr<Gpu> gpu_;
  std::vector<std::vector<nifkit::Asset>> assets_;  ///< of each file, for each device
  /// The batch that is asked at the moment.
  struct {
    std::string what;
    uint64_t first = 0;
    std::vector<NifRay> rays;
    std::vector<uint32_t> masks;  ///< none: rays without masks
  } now_;
  uint32_t printed_ = 0;
  uint64_t different_ = 0;
  std::string stages_;  ///< lines of a table
};

std::vector<std::byte> read_file(const std::string& path) {
  const auto memory = format::FileMemory::load(path, format::FileMemory::Mode::read);
  return {memory.bytes().begin(), memory.bytes().end()};
}

/// Where a GPU is in the machine, and which one it is.
std::string place_of(uint32_t device) {
  const NifGpuInfo gpu = nifkit::gpu(device);
  char text[64];
  std::snprintf(text, sizeof(text), " at %04x:%02x:%02x, UUID ", gpu.pci_domain, gpu.pci_bus, gpu.pci_device);
  std::string place = text;
  for (const uint8_t byte : gpu.uuid) {
    std::snprintf(text, sizeof(text), "%02x", byte);
    place += text;
  }
  return place + (gpu.has_luid ? ", with a LUID" : "");
}

int run(const Options& options) {
  std::string config = "backend=gpu,device=" + std::to_string(options.device);
  if (!options.module.empty()) config += ",module=" + options.module;
  {
    NifDevice device = nullptr;
    const NifError error = nifNewDevice(config.c_str(), nullptr, &device);
    nifReleaseDevice(device);
    if (error != NIF_OK) {
      std::fprintf(stderr, "gpu_proof: %s\n", nifGetErrorMessage());
      return kNoGpu;
    }
  }
  Proof proof(options, config);
  std::printf("%s%s, beside a CPU with `%s`.", proof.gpu().info().gpu,
              options.module.empty() ? place_of(options.device).c_str() : "", nifkit::Device().info().isa);
  if (options.rounds > 0)
    std::printf(
        " Millions of rays a second, median of %u rounds of %llu rays, rays and answers\n"
        "in the GPU's memory: `nifQuery` of what is visible, by its own clock, both ways; `nifQueryOpen` "
        "(open)\n"
        "and `nifIntersect` (hits) with all outputs, at odd addresses, and rays with masks by the host's "
        "clock;\nthe CPU with all threads.",
        options.rounds, static_cast<unsigned long long>(std::min(kBatch, options.rays)));
  std::printf("\n\n| scene | rays | asked | different | of open | of hits |%s\n",
              options.rounds ? " pipeline | one kernel | open | hits | CPU |" : "");
  std::printf("| --- | --- | ---: | ---: | ---: | ---: |%s\n",
              options.rounds ? " ---: | ---: | ---: | ---: | ---: |" : "");
  for (const std::string& file : options.files) {
    const size_t slash = file.rfind('/');
    proof.add_asset(file.substr(slash == std::string::npos ? 0 : slash + 1), read_file(file));
  }
  if (options.files.empty()) {
    const RandomAssetOptions kinds{.objects = 2,
                                   .max_voxels = 80,
                                   .bvhs = 1,
                                   .sphericals = 1,
                                   .exacts = 1,
                                   .proofs = 1,
                                   .cutouts = 1,
                                   .features = 2};
    proof.add_asset("random", format::encode(random_asset(1, kinds)));
  }
  proof.ask_mixed();
  proof.ask_bent();
  if (!proof.stages().empty())
    std::printf(
        "\nOpen rays, about which nothing is proven, by the pipeline: microseconds for a million of "
        "them, and\n"
        "of these its stages, timed by themselves.\n\n"
        "| scene | rays | asked | a million | traversal | order | outer inputs | outer networks | inner "
        "inputs | "
        "inner networks | rest |\n"
        "| --- | --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |\n%s",
        proof.stages().c_str());
  std::printf("\nAnswers that differ from the reference: %llu.\n",
              static_cast<unsigned long long>(proof.different()));
  return proof.different() == 0 ? 0 : 1;
}

/// Returns false if the command line is invalid.
bool parse(int argc, char** argv, Options& options) {
  for (int i = 1; i < argc; ++i) {
    const std::string argument = argv[i];
    if (!argument.starts_with("-")) {
      options.files.push_back(argument);
      continue;
    }
    if (++i == argc) return false;
    char* end = nullptr;
    const uint64_t number = std::strtoull(argv[i], &end, 10);
    const bool is_number = *argv[i] >= '0' && *argv[i] <= '9' && *end == 0;
    if (argument == "--module")
      options.module = argv[i];
    else if (argument == "--rays" && is_number && number > 0)
      options.rays = number;
    else if (argument == "--rounds" && is_number && number <= 1000)
      options.rounds = uint32_t(number);
    else if (argument == "--device" && is_number && number < 1024)
      options.device = uint32_t(number);
    else
      return false;
  }
  return true;
}

}  // namespace
}  // namespace nif::test

int main(int argc, char** argv) {
  nif::test::Options options;
  if (!nif::test::parse(argc, argv, options)) {
    std::fputs("usage: gpu_proof [--rays N] [--rounds N] [--device N] [--module FILE] [FILE.nif...]\n",
               stderr);
    return int(nif::Status::usage);
  }
  try {
    return nif::test::run(options);
  } catch (const nif::Error& error) {
    std::fprintf(stderr, "gpu_proof: %s\n", error.what());
    return int(error.status());
  } catch (const std::exception& error) {
    std::fprintf(stderr, "gpu_proof: %s\n", error.what());
    return 1;
  }
}
