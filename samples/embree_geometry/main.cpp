// Renders copies of a model on a floor with the shadows of its triangles, and again with those of the asset
// baked from it: as an Embree geometry, alone, and as proofs in front of the triangles, which then answer the
// rays that are not proven. Prints how often each agrees with the triangles, ray by ray, and how fast they
// are; and how far the asset's first hits are from those of the triangles.
#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <exception>
#include <memory>
#include <string>

#include "render.hpp"

namespace {

constexpr char kHelp[] =
    "embree_geometry ASSET.nif MESH.obj [options]: shadow rays answered by an asset in an Embree scene.\n"
    "\n"
    "MESH.obj is the mesh that the asset was baked from. The picture shows, from the left: shadows of the "
    "triangles,\n"
    "shadows of the asset, and the difference (red: the asset lets light through; blue: it blocks light).\n"
    "\n"
    "  -o FILE.png   the picture (default: no picture)\n"
    "  --width N     pixels of each of its three parts (default 480)\n"
    "  --soft N      the sun's radius in degrees, 0 to 20 (default 0: hard shadows)\n"
    "  --help        this text\n";

struct Options {
  std::string asset, mesh, picture;
  int width = 480, soft = 0;
};

struct Usage {
  std::string sentence;
};

int read_number(const std::string& option, const char* text, int least, int most) {
  int number = 0;
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
      if (!options.mesh.empty()) throw Usage{"give only one asset and one mesh, not also '" + word + "'"};
      (options.asset.empty() ? options.asset : options.mesh) = word;
      continue;
    }
    if (word != "-o" && word != "--width" && word != "--soft")
      throw Usage{"unknown option '" + word + "'; see --help"};
    if (++i == argc) throw Usage{word + " needs a value; see --help"};
    if (word == "-o") options.picture = argv[i];
    if (word == "--width") options.width = read_number(word, argv[i], 16, 4096);
    if (word == "--soft") options.soft = read_number(word, argv[i], 0, 20);
  }
  if (options.mesh.empty()) throw Usage{"give an asset and its mesh; see --help"};
  return options;
}

struct ReleaseDevice {
  void operator()(RTCDevice device) const { rtcReleaseDevice(device); }
};

/// Red where the asset lets more light through, blue where less.
void draw_difference(Picture& picture, uint32_t width) {
  for (uint32_t y = 0; y < picture.height; ++y) {
    for (uint32_t x = 0; x < width; ++x) {
      const int exact = picture.at(x, y)[0], learned = picture.at(width + x, y)[0];
      const int dim = exact / 6;
      uint8_t* colour = picture.at(2 * width + x, y);
      colour[0] = uint8_t(std::clamp(dim + 3 * (learned - exact), dim, 255));
      colour[1] = uint8_t(dim);
      colour[2] = uint8_t(std::clamp(dim + 3 * (exact - learned), dim, 255));
    }
  }
}

void print_row(const char* what, const Asked& asked, const Answers& expected) {
  const auto total = double(std::max<size_t>(1, expected.size()));
  size_t dark = 0, same = 0;
  for (size_t i = 0; i < expected.size(); ++i) {
    dark += !asked.visible[i];
    same += asked.visible[i] == expected[i];
  }
  std::printf("%-34s %8.2f %% %8.2f %% %9.1f\n", what, 100 * double(dark) / total, 100 * double(same) / total,
              1e3 * asked.seconds);
}

/// First hits of blocked shadow rays, in the triangles and in the asset.
void print_hits(const FirstHits& expected, const FirstHits& found, float size) {
  size_t same = 0;
  std::vector<float> off;
  for (size_t i = 0; i < expected.t.size(); ++i) {
    const bool there = std::isfinite(expected.t[i]), here = std::isfinite(found.t[i]);
    same += there == here;
    if (there && here) off.push_back(std::abs(found.t[i] - expected.t[i]) / size);
  }
  if (off.empty()) return;
  const auto share = [&](double part) {
    const auto at = off.begin() + std::ptrdiff_t(part * double(off.size() - 1));
    std::nth_element(off.begin(), at, off.end());
    return 100 * double(*at);
  };
  const double median = share(0.5), most = share(0.95);
  std::printf(
      "\nFirst hits, rtcIntersect16: %.2f %% agree on whether there is one. The asset's lie %.4f %% of the\n"
      "model's size from the triangles' in the median, and %.3f %% or less for 95 %% (%.1f ms; triangles "
      "%.1f ms).\n",
      100 * double(same) / double(expected.t.size()), median, most, 1e3 * found.seconds,
      1e3 * expected.seconds);
}

void run(const Options& options) {
  // One thread each, so that the times below can be compared.
  const std::unique_ptr<RTCDeviceTy, ReleaseDevice> embree(rtcNewDevice("threads=1"));
  if (!embree) throw std::runtime_error("Embree created no device");
  const nifkit::Device device;
  const nifkit::Asset asset = nifkit::Asset::load(device, options.asset);
  const Mesh mesh = read_obj(options.mesh);
  const World world(embree.get(), device, asset, mesh);

  const auto width = uint32_t(options.width), height = width * 3 / 4;
  const Shading shading = shade(world, width, height, 0.01745f * float(options.soft));
  const Asked triangles = ask_embree(world.own(), shading.rays);
  const Asked learned = ask_embree(world.shadow(), shading.rays);
  const Asked direct = ask_directly(world.direct(), shading.rays);
  size_t open = 0;
  const Asked proven = ask_proofs_first(world.direct(), world.own(), shading.rays, open);
  world.throw_where_a_query_failed();
  if (const RTCError error = rtcGetDeviceError(embree.get()); error != RTC_ERROR_NONE)
    throw std::runtime_error("Embree: error " + std::to_string(int(error)));

  std::printf("%zu triangles, %zu shadow rays\n\n", mesh.triangles.size(), shading.rays.size());
  std::printf("%-34s %10s %10s %9s\n", "", "in shadow", "agree", "ms");
  print_row("triangles, rtcOccluded16", triangles, triangles.visible);
  print_row("asset as geometry, rtcOccluded16", learned, triangles.visible);
  print_row("asset alone, nifQuery", direct, triangles.visible);
  print_row("proofs first, then triangles", proven, triangles.visible);
  std::printf("\nProofs leave %.2f %% of the rays to the triangles, which so answer %.1f times as fast.\n",
              100 * double(open) / double(std::max<size_t>(1, shading.rays.size())),
              triangles.seconds / proven.seconds);
  print_hits(find_hits(world.own(), shading.rays), find_hits(world.shadow(), shading.rays), world.size());
  world.throw_where_a_query_failed();
  if (options.picture.empty()) return;
  Picture picture(3 * width, height);
  draw(shading, triangles.visible, picture, 0);
  draw(shading, learned.visible, picture, width);
  draw_difference(picture, width);
  write_png(picture, options.picture);
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
    std::fprintf(stderr, "embree_geometry: %s\n", usage.sentence.c_str());
    return 2;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "embree_geometry: %s\n", error.what());
    return 1;
  }
}
