// Checks a GPU's answers, and times them: queries each asset's objects one by one and all together as a
// crowd, with rays of several sets, by the scalar reference on the CPU and by the GPU: nifQuery, nifQueryOpen
// and nifIntersect, and compares each answer. Prints a table in Markdown. Ends with 1 if any answer differs,
// with 3 if there is no GPU. tests/gpu/run.sh builds it.
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

#include "card.hpp"
#include "formats/base/status.hpp"
#include "formats/nif/file_memory.hpp"
#include "formats/nif/writer.hpp"
#include "ray_sets.hpp"
#include "tests/support/first_hits.hpp"
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

/// All outputs.
struct Outputs {
  std::vector<uint8_t> visible, bits, certain;
  std::vector<float> probability;
  std::vector<int32_t> logit;

  explicit Outputs(size_t count)
      : visible(count), bits((count + 7) / 8), certain(count), probability(count), logit(count) {}
  nifkit::Answers answers() {
    return nifkit::Answers()
        .visible(visible)
        .visible_bits(bits)
        .probability(probability)
        .certain(certain)
        .logit(logit);
  }
};

/// Counts rays with any differing output: in any bit, or for probabilities in more than their last bits.
uint64_t count_different(const Outputs& a, const Outputs& b) {
  uint64_t different = 0;
  for (size_t i = 0; i < a.visible.size(); ++i) {
    const float p = a.probability[i], q = b.probability[i];
    const bool near = q == 0 ? p == 0 : std::fabs(p / q - 1) < 1e-6f;
    different += a.visible[i] != b.visible[i] || a.certain[i] != b.certain[i] || a.logit[i] != b.logit[i] ||
                 (a.bits[i / 8] >> i % 8 & 1) != b.visible[i] || !near;
  }
  return different;
}

/// The result of nifQueryOpen, with its lists sorted by ray, so that their order does not matter.
struct OpenOutputs : Outputs {
  using Outputs::Outputs;
  uint32_t count = 0;
  std::vector<uint32_t> listed;   ///< of each ray: how often the list has it
  std::vector<float> tmin, tmax;  ///< of each ray, 0 where it is not in the list

  void take(const std::vector<uint32_t>& rays, const std::vector<float>& from, const std::vector<float>& to) {
    listed.assign(visible.size(), 0);
    tmin.assign(visible.size(), 0);
    tmax.assign(visible.size(), 0);
    for (size_t k = 0; k < std::min<size_t>(count, rays.size()); ++k) {
      if (rays[k] >= visible.size()) continue;  // then the counts of the others tell
      ++listed[rays[k]];
      tmin[rays[k]] = from[k];
      tmax[rays[k]] = to[k];
    }
  }
};

uint64_t count_different(const OpenOutputs& a, const OpenOutputs& b) {
  uint64_t different = count_different(static_cast<const Outputs&>(a), static_cast<const Outputs&>(b));
  for (size_t i = 0; i < a.listed.size(); ++i)
    different += a.listed[i] != b.listed[i] || std::memcmp(&a.tmin[i], &b.tmin[i], sizeof(float)) != 0 ||
                 std::memcmp(&a.tmax[i], &b.tmax[i], sizeof(float)) != 0;
  return different + (a.count != b.count);
}

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
        card_(Card::open(options.device, options.module)) {}

  const nifkit::Device& gpu() const { return devices_[2]; }
  uint64_t different() const { return different_; }
  const std::string& stages() const { return stages_; }

  void add_asset(const std::string& name, std::span<const std::byte> file) {
    std::vector<nifkit::Asset> assets;
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

 private:
  void ask(const std::string& name, Scenes& scenes) {
    for (nifkit::Scene& scene : scenes.of) scene.commit();
    const NifSceneInfo info = scenes.of[0].info();
    for (const BoxRays set : kBoxRays) {
      uint64_t different = 0, different_open = 0, different_hits = 0;
      std::vector<double> pipeline, one_kernel, open, hits, cpu;
      std::vector<NifRay> ambiguous;
      for (uint64_t first = 0; first < options_.rays; first += kBatch) {
        const uint64_t count = std::min(kBatch, options_.rays - first);
        const std::vector<NifRay> rays =
            make_rays(set, info.bounds_min, info.bounds_max, 1, first, count, options_.rays);
        Outputs expected(count), copied(count);
        scenes.of[0].query(nifkit::Rays(rays), expected.answers());
        scenes.of[2].query(nifkit::Rays(rays), copied.answers());
        different += count_different(copied, expected);
        // And by memory of the card, in a stream, by either way.
        for (const NifMeasure way : {NIF_MEASURE_ONE_KERNEL, NIF_MEASURE_PIPELINE}) {
          Outputs there(count);
          double once;
          measure(scenes, rays, there.answers(), way, 1, &once);
          different += count_different(there, expected);
        }
        different_open += compare_open(scenes, rays, first == 0 ? &open : nullptr);
        different_hits += compare_hits(scenes, rays, first == 0 ? &hits : nullptr);
        if (first == 0) time(scenes, rays, pipeline, one_kernel, cpu);
        for (size_t i = 0; i < count && ambiguous.size() < kBatch; ++i)
          if (!expected.certain[i]) ambiguous.push_back(rays[i]);
      }
      different_ += different + different_open + different_hits;
      std::printf("| %s | %s | %llu |", name.c_str(), name_of(set),
                  static_cast<unsigned long long>(options_.rays));
      for (const uint64_t count : {different, different_open, different_hits})
        std::printf(" %llu |", static_cast<unsigned long long>(count));
      if (options_.rounds > 0) {
        const double rays = double(std::min(kBatch, options_.rays)) * 1e-6;
        for (const auto* seconds : {&pipeline, &one_kernel, &open, &hits, &cpu})
          std::printf(" %.1f |", rays / median(*seconds));
        time_stages(name + " | " + name_of(set), scenes, ambiguous);
      }
      std::printf("\n");
      std::fflush(stdout);
    }
  }

  /// Has `ask` put work into the card's stream, and waits for it; once more for each round that is timed, by
  /// the host's clock, if seconds are wanted.
  template <class Ask>
  void in_stream(std::vector<double>* seconds, const Ask& ask) {
    for (uint32_t round = 0; round <= (seconds ? options_.rounds : 0); ++round) {
      const auto start = std::chrono::steady_clock::now();
      nifkit::check(ask());
      card_->wait();
      if (round > 0)
        seconds->push_back(std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
    }
  }

  /// Of memory of the card that the program has from the driver. Returns how many answers differ.
  uint64_t compare_open(Scenes& scenes, const std::vector<NifRay>& rays, std::vector<double>* seconds) {
    const size_t count = rays.size();
    std::vector<uint32_t> numbers(count), counted;
    std::vector<float> from(count), to(count);
    OpenOutputs expected(count), got(count);
    expected.count = scenes.of[0].query_open(nifkit::Rays(rays), expected.answers(), numbers, from, to);
    expected.take(numbers, from, to);

    CardArrays arrays(*card_);
    NifRays query = nifMakeRays(arrays.copy(rays), count);
    query.memory = NIF_MEMORY_DEVICE;
    query.stream = card_->stream();
    auto outputs = nifkit::sized<NifAnswers>();
    outputs.visible = arrays.output(got.visible, count);
    outputs.visible_bits = arrays.output(got.bits, got.bits.size());
    outputs.probability = arrays.output(got.probability, count);
    outputs.certain = arrays.output(got.certain, count);
    outputs.logit = arrays.output(got.logit, count);
    auto open = nifkit::sized<NifOpenRays>();
    open.capacity = count;
    open.rays = arrays.output(numbers, count);
    open.tmin = arrays.output(from, count);
    open.tmax = arrays.output(to, count);
    open.count = arrays.copy(std::vector<uint32_t>{0xa5a5a5a5});
    in_stream(seconds, [&] { return nifQueryOpen(scenes.of[2].get(), &query, &outputs, &open); });
    arrays.fetch(got.visible, outputs.visible);
    arrays.fetch(got.bits, outputs.visible_bits);
    arrays.fetch(got.probability, outputs.probability);
    arrays.fetch(got.certain, outputs.certain);
    arrays.fetch(got.logit, outputs.logit);
    arrays.fetch(numbers, open.rays);
    arrays.fetch(from, open.tmin);
    arrays.fetch(to, open.tmax);
    counted.resize(1);
    arrays.fetch(counted, open.count);
    got.count = counted[0];
    got.take(numbers, from, to);
    return count_different(got, expected);
  }

  uint64_t compare_hits(Scenes& scenes, const std::vector<NifRay>& rays, std::vector<double>* seconds) {
    FirstHits expected(rays.size()), got(rays.size());
    NifRays query = nifMakeRays(rays.data(), rays.size());
    NifHits outputs = expected.outputs();
    nifkit::check(nifIntersect(scenes.of[0].get(), &query, &outputs));

    CardArrays arrays(*card_);
    query = nifMakeRays(arrays.copy(rays), rays.size());
    query.memory = NIF_MEMORY_DEVICE;
    query.stream = card_->stream();
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
    return count_different_hits(got, expected);
  }

  /// Uses the GPU's clock; `seconds` as nifMeasureQuery writes them.
  static void measure(const Scenes& scenes, const std::vector<NifRay>& rays, const nifkit::Answers& answers,
                      NifMeasure way, uint32_t rounds, double* seconds) {
    nifkit::check(nifMeasureQuery(scenes.of[2].get(), &nifkit::Rays(rays).get(), &answers.get(rays.size()),
                                  way, rounds, seconds));
  }

  /// Requests only visibility, as a renderer would.
  void time(Scenes& scenes, const std::vector<NifRay>& rays, std::vector<double>& pipeline,
            std::vector<double>& one_kernel, std::vector<double>& cpu) const {
    if (options_.rounds == 0) return;
    std::vector<uint8_t> visible(rays.size());
    const nifkit::Answers answers = nifkit::Answers().visible(visible);
    for (const auto& [way, seconds] :
         {std::pair(NIF_MEASURE_PIPELINE, &pipeline), std::pair(NIF_MEASURE_ONE_KERNEL, &one_kernel)}) {
      seconds->resize(options_.rounds);
      measure(scenes, rays, answers, way, options_.rounds, seconds->data());
    }
    for (uint32_t round = 0; round <= options_.rounds; ++round) {
      const auto start = std::chrono::steady_clock::now();
      scenes.of[1].query(nifkit::Rays(rays), answers);
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
  std::unique_ptr<Card> card_;
  uint64_t different_ = 0;
  std::string stages_;  ///< lines of a table
};

std::vector<std::byte> read_file(const std::string& path) {
  const auto memory = format::FileMemory::load(path, format::FileMemory::Mode::read);
  return {memory.bytes().begin(), memory.bytes().end()};
}

/// Where a card is in the machine, and which one it is.
std::string place_of(uint32_t device) {
  const NifCardInfo card = nifkit::card(device);
  char text[64];
  std::snprintf(text, sizeof(text), " at %04x:%02x:%02x, UUID ", card.pci_domain, card.pci_bus,
                card.pci_device);
  std::string place = text;
  for (const uint8_t byte : card.uuid) {
    std::snprintf(text, sizeof(text), "%02x", byte);
    place += text;
  }
  return place + (card.has_luid ? ", with a LUID" : "");
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
  std::printf("%s%s, beside a CPU with `%s`.", proof.gpu().info().card,
              options.module.empty() ? place_of(options.device).c_str() : "", nifkit::Device().info().isa);
  if (options.rounds > 0)
    std::printf(
        " Millions of rays a second, median of %u rounds of %llu rays, rays and answers\n"
        "in the GPU's memory: `nifQuery` of what is visible, by its own clock, both ways; `nifQueryOpen` "
        "(open)\n"
        "and `nifIntersect` (hits) with all outputs, at odd addresses, by the host's clock; the CPU with all "
        "threads.",
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
    const RandomAssetOptions kinds{
        .objects = 2, .max_voxels = 80, .bvhs = 1, .sphericals = 1, .exacts = 1, .proofs = 1, .features = 2};
    proof.add_asset("random", format::encode(random_asset(1, kinds)));
  }
  if (!proof.stages().empty())
    std::printf(
        "\nAmbiguous rays, about which nothing is proven, by the pipeline: microseconds for a million of "
        "them, and\n"
        "of these its stages, timed by themselves.\n\n"
        "| scene | rays | asked | a million | walk | order | outer inputs | outer networks | inner inputs | "
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
