// Draws a forest twice: by Embree with a filter function that looks up where leaves are, and by an asset, which needs none.
// Prints what each takes in time and memory, and how much the pictures differ.
#include <algorithm>
#include <charconv>
#include <cstdio>
#include <cstring>
#include <exception>
#include <functional>
#include <memory>
#include <string>

#include "asset_trees.hpp"
#include "draw.hpp"
#include "embree_trees.hpp"

namespace {

constexpr char kHelp[] =
    "grove SCENE.glb ASSET.nif [options]: a forest under sun and sky, by Embree and by an asset.\n"
    "\n"
    "ASSET.nif was baked from SCENE.glb (or .gltf).\n"
    "\n"
    "  -o NAME        writes NAME-embree.png, NAME-asset.png and NAME-both.png, side by side "
    "(default: no pictures)\n"
    "  --copies N     places the whole scene N times instead of once, in rows that chance moves\n"
    "  --width N      pixels of a row (default 640); the height is 9/16 of it\n"
    "  --samples N    camera rays of a pixel, each with a ray to the sun and one to the sky (default 8)\n"
    "  --rounds N     how often each draws, by turns; the median counts (default 3)\n"
    "  --least        the asset takes the least memory, and is slower (memory=least)\n"
    "  --compact      Embree takes less memory, and is slower (RTC_SCENE_FLAG_COMPACT)\n"
    "  --help         this text\n";

struct Options {
  std::string scene, asset, pictures;
  uint32_t copies = 0, width = 640, samples = 8, rounds = 3;
  bool least = false, compact = false;
};

struct Usage {
  std::string sentence;
};

uint32_t read_number(const std::string& option, const char* text, uint32_t least, uint32_t most) {
  uint32_t number = 0;
  const char* end = text + std::strlen(text);
  const auto [stop, error] = std::from_chars(text, end, number);
  if (error != std::errc() || stop != end || number < least || number > most)
    throw Usage{option + " takes a whole number, " + std::to_string(least) + " to " + std::to_string(most)};
  return number;
}

Options read_options(int argc, char** argv) {
  Options options;
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    if (word.empty() || word[0] != '-') {
      if (!options.asset.empty()) throw Usage{"give only one scene and one asset, not also '" + word + "'"};
      (options.scene.empty() ? options.scene : options.asset) = word;
      continue;
    }
    if (word == "--least" || word == "--compact") {
      (word == "--least" ? options.least : options.compact) = true;
      continue;
    }
    if (word != "-o" && word != "--copies" && word != "--width" && word != "--samples" && word != "--rounds")
      throw Usage{"unknown option '" + word + "'; see --help"};
    if (++i == argc) throw Usage{word + " needs a value; see --help"};
    if (word == "-o") options.pictures = argv[i];
    if (word == "--copies") options.copies = read_number(word, argv[i], 1, 1'000'000);
    if (word == "--width") options.width = read_number(word, argv[i], 16, 4096);
    if (word == "--samples") options.samples = read_number(word, argv[i], 1, 64);
    if (word == "--rounds") options.rounds = read_number(word, argv[i], 1, 99);
  }
  if (options.asset.empty()) throw Usage{"give a scene and the asset baked from it; see --help"};
  return options;
}

/// One way to draw, and what its rounds took.
struct Entrant {
  const char* name;
  Tracer* tracer;
  std::vector<Drawn> rounds = {};

  double median(const std::function<double(const Drawn&)>& value) const {
    std::vector<double> values;
    for (const Drawn& round : rounds) values.push_back(value(round));
    std::nth_element(values.begin(), values.begin() + ptrdiff_t(values.size() / 2), values.end());
    return values[values.size() / 2];
  }
  double seconds() const { return median(&Drawn::seconds); }
};

void print_times(const std::vector<Entrant>& entrants) {
  const Drawn& first = entrants[0].rounds[0];
  std::printf("%-26s %10s %10s %10s %10s   million rays/s: %s\n", "seconds of the thread", "camera", "sun",
              "sky", "all", "camera, sun, sky");
  for (const Entrant& e : entrants) {
    const double camera = e.median([](const Drawn&d) { return d.camera; }),
                 sun = e.median([](const Drawn&d) { return d.sun; }),
                 sky = e.median([](const Drawn&d) { return d.sky; });
    const double shadow = 1e-6 * double(first.shadow_rays);
    std::printf("%-26s %10.3f %10.3f %10.3f %10.3f   %.2f, %.2f, %.2f\n", e.name, camera, sun, sky,
                e.seconds(), 1e-6 * double(first.camera_rays) / camera, shadow / sun, shadow / sky);
  }
}

Picture beside(const Picture& a, const Picture& b) {
  Picture both{a.width + b.width, a.height, {}};
  for (uint32_t y = 0; y < a.height; ++y)
    for (const Picture* one : {&a, &b}) {
      const auto row = one->colours.begin() + ptrdiff_t(size_t{y} * one->width);
      both.colours.insert(both.colours.end(), row, row + ptrdiff_t(one->width));
    }
  return both;
}

void run(const Options& options) {
  Trees trees = read_trees(options.scene);
  if (options.copies > 0) plant(trees, options.copies);
  const EmbreeTrees embree(trees, options.compact);
  AssetTrees asset(trees, options.asset, options.least ? "threads=1,memory=least" : "threads=1");

  size_t triangles = 0, placed = 0;
  std::vector<size_t> of_model;
  for (const Model& model : trees.models) {
    size_t sum = 0;
    for (const Part& part : model.parts) sum += part.triangles.size();
    of_model.push_back(sum);
    triangles += sum;
  }
  for (const Placed& one : trees.placed) placed += of_model[one.model];
  std::printf("%zu triangles in %zu models, placed %zu times: %zu triangles. One thread, %s.\n\n", triangles,
              trees.models.size(), trees.placed.size(), placed, asset.isa().c_str());

  const auto embree_all = double(embree.bytes() + embree.bytes_of_masks());
  std::printf("%-26s %12s %12s %12s %12s\n", "bytes", "models", "instances", "all", "of Embree's");
  std::printf("%-26s %12lld %12lld %12.0f\n", "Embree, with its masks",
              (long long)(embree.bytes_of_models() + embree.bytes_of_masks()),
              (long long)(embree.bytes() - embree.bytes_of_models()), embree_all);
  const uint64_t models = asset.bytes_of_models(), instances = asset.bytes_of_instances();
  std::printf("%-26s %12llu %12llu %12llu %10.1f %%\n", "asset, in memory", (unsigned long long)models,
              (unsigned long long)instances, (unsigned long long)(models + instances),
              100 * double(models + instances) / embree_all);
  std::printf("%-26s %12s %12s %12llu %10.1f %%\n\n", "asset, as a file", "", "",
              (unsigned long long)asset.bytes_of_file(), 100 * double(asset.bytes_of_file()) / embree_all);

  const std::unique_ptr<Tracer> single = embree.single(), packets = embree.packets();
  std::vector<Entrant> entrants{
      {"Embree, single rays", single.get()}, {"Embree, packets of 16", packets.get()}, {"asset", &asset}};
  const uint32_t height = std::max(1u, options.width * 9 / 16);
  for (uint32_t round = 0; round < options.rounds; ++round)
    for (Entrant& entrant : entrants)
      entrant.rounds.push_back(draw(*entrant.tracer, trees, options.width, height, options.samples));
  print_times(entrants);
  const Entrant& fastest = entrants[0].seconds() < entrants[1].seconds() ? entrants[0] : entrants[1];
  const Picture &truth = entrants[0].rounds[0].picture, &answer = entrants[2].rounds[0].picture;
  std::printf("\nThe asset is %.2f times as fast as %s. The pictures differ by %.1f dB.\n",
              fastest.seconds() / entrants[2].seconds(), fastest.name, psnr(truth, answer));
  if (options.pictures.empty()) return;
  write_png(truth, options.pictures + "-embree.png");
  write_png(answer, options.pictures + "-asset.png");
  write_png(beside(truth, answer), options.pictures + "-both.png");
}

}  // namespace

int main(int argc, char** argv) {
  try {
    if (argc == 2 && (std::strcmp(argv[1], "--help") == 0 || std::strcmp(argv[1], "-h") == 0)) {
      std::fputs(kHelp, stdout);
      return 0;
    }
    run(read_options(argc, argv));
    return 0;
  } catch (const Usage& usage) {
    std::fprintf(stderr, "grove: %s\n", usage.sentence.c_str());
    return 2;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "grove: %s\n", error.what());
    return 1;
  }
}
