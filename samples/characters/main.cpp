// Characters walk in a circle through a place. Each frame poses them from the joints of a clip, and commits the scene; some
// frames are drawn under sun and sky. All rays are answered by assets. Prints times and bytes of a frame.
#include <algorithm>
#include <atomic>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <string>

#include "crowd.hpp"
#include "draw.hpp"

namespace {

constexpr char kHelp[] =
    "characters CHARACTER.nif CHARACTER.glb PLACE.nif [options]: characters that walk, lit by assets only.\n"
    "\n"
    "CHARACTER.nif was baked from CHARACTER.glb (or .gltf) with --deforms --source-triangles; PLACE.nif with "
    "--colors.\n"
    "\n"
    "  -o NAME          writes NAME-000.png and so on, a picture of each drawn frame (default: draws "
    "nothing)\n"
    "  --clip NAME      what the joints do (default walk)\n"
    "  --hide NAME      an instance of the character that is not there, e.g. a sword; as often as needed\n"
    "  --count N        characters (default 12)\n"
    "  --circle X,Z,R   the middle and the radius of the circle, in metres (default 0,0,6)\n"
    "  --speed V        metres a second (default 1.45)\n"
    "  --frames N       frames of 1/60 s (default 120)\n"
    "  --every N        draws each N-th frame (default 30)\n"
    "  --eye X,Y,Z      where the camera is (default 1.5,3.6,15)\n"
    "  --target X,Y,Z   where it looks (default 0,1.2,0)\n"
    "  --width N        pixels of a row (default 640); the height is 9/16 of it\n"
    "  --samples N      camera rays of a pixel, each with a ray to the sun and one to the sky (default 16)\n"
    "  --help           this text\n";

struct Usage {
  std::string sentence;
};

struct Options {
  CrowdOptions crowd;
  View view;
  std::string pictures;
  uint32_t frames = 120, every = 30;
};

uint32_t read_number(const std::string& option, const char* text, uint32_t most) {
  uint32_t number = 0;
  const char* end = text + std::strlen(text);
  const auto [stop, error] = std::from_chars(text, end, number);
  if (error != std::errc() || stop != end || number < 1 || number > most)
    throw Usage{option + " takes a whole number, 1 to " + std::to_string(most)};
  return number;
}

template <size_t kCount>
std::array<float, kCount> read_floats(const std::string& option, const char* text) {
  std::array<float, kCount> numbers{};
  const char* end = text + std::strlen(text);
  for (size_t i = 0; i < kCount; ++i) {
    const auto [stop, error] = std::from_chars(text, end, numbers[i]);
    const bool last = i + 1 == kCount;
    if (error != std::errc() || !(std::abs(numbers[i]) < 1e6f) ||
        (last ? stop != end : stop == end || *stop != ','))
      throw Usage{option + " takes " + std::to_string(kCount) +
                  (kCount == 1 ? " number" : " numbers with commas between them")};
    text = stop + !last;
  }
  return numbers;
}

Options read_options(int argc, char** argv) {
  Options options;
  options.view.eye = {1.5f, 3.6f, 15}, options.view.target = {0, 1.2f, 0};
  options.crowd.clip = "walk";
  std::vector<std::string> files;
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    if (word.empty() || word[0] != '-') {
      files.push_back(word);
      continue;
    }
    static constexpr const char* kWithValue[] = {"-o",       "--clip",   "--hide",   "--count",
                                                 "--circle", "--speed",  "--frames", "--every",
                                                 "--eye",    "--target", "--width",  "--samples"};
    if (std::find(std::begin(kWithValue), std::end(kWithValue), word) == std::end(kWithValue))
      throw Usage{"unknown option '" + word + "'; see --help"};
    if (++i == argc) throw Usage{word + " needs a value; see --help"};
    const char* const value = argv[i];
    CrowdOptions& crowd = options.crowd;
    if (word == "-o") options.pictures = value;
    if (word == "--clip") crowd.clip = value;
    if (word == "--hide") crowd.hidden.push_back(value);
    if (word == "--count") crowd.count = read_number(word, value, 10'000);
    if (word == "--frames") options.frames = read_number(word, value, 1'000'000);
    if (word == "--every") options.every = read_number(word, value, 1'000'000);
    if (word == "--width") options.view.width = read_number(word, value, 4096);
    if (word == "--samples") options.view.samples = read_number(word, value, 64);
    if (word == "--speed") crowd.speed = read_floats<1>(word, value)[0];
    if (word == "--eye") options.view.eye = read_floats<3>(word, value);
    if (word == "--target") options.view.target = read_floats<3>(word, value);
    if (word == "--circle") {
      const auto [x, z, radius] = read_floats<3>(word, value);
      if (!(radius > 0)) throw Usage{"--circle needs a radius above 0"};
      crowd.x = x, crowd.z = z, crowd.radius = radius;
    }
  }
  if (files.size() != 3)
    throw Usage{"give a character's asset, its glTF and the asset of a place; see --help"};
  options.crowd.character = files[0], options.crowd.character_mesh = files[1], options.crowd.place = files[2];
  options.view.height = std::max(1u, options.view.width * 9 / 16);
  return options;
}

/// Counts what the device allocates, to show that frames do not.
struct Allocations {
  std::atomic<uint64_t> count{0};

  NifDeviceCallbacks callbacks() {
    auto callbacks = nifkit::sized<NifDeviceCallbacks>();
    callbacks.user = this;
    callbacks.allocate = [](void* user, uint64_t bytes, uint64_t alignment) {
      ++static_cast<Allocations*>(user)->count;
      alignment = std::max<uint64_t>(alignment, sizeof(void*));
      return std::aligned_alloc(alignment, (bytes + alignment - 1) / alignment * alignment);
    };
    callbacks.deallocate = [](void*, void* memory, uint64_t, uint64_t) { std::free(memory); };
    return callbacks;
  }
};

double median(const std::vector<FrameTimes>& frames, double FrameTimes::*value) {
  std::vector<double> values;
  for (const FrameTimes& frame : frames) values.push_back(frame.*value);
  std::nth_element(values.begin(), values.begin() + ptrdiff_t(values.size() / 2), values.end());
  return values[values.size() / 2];
}

void print_bytes(const Crowd& crowd, uint32_t count) {
  const uint64_t scene = crowd.scene().info().resident_bytes, own = scene - crowd.scene_bytes_at_rest();
  std::printf("\n%-44s %12s\n", "memory", "bytes");
  std::printf("%-44s %12llu\n", "the character's asset, once", (unsigned long long)crowd.asset_bytes());
  std::printf("%-44s %12llu   %.0f a character\n", "poses of all characters", (unsigned long long)own,
              double(own) / count);
  std::printf("%-44s %12llu\n", "the scene without them", (unsigned long long)crowd.scene_bytes_at_rest());
  std::printf("%-44s %12llu\n", "the place's asset", (unsigned long long)crowd.place_bytes());
}

void run(const Options& options) {
  Allocations allocations;
  const NifDeviceCallbacks callbacks = allocations.callbacks();
  const nifkit::Device device("threads=1", &callbacks);
  Crowd crowd(device, options.crowd);
  std::printf("%u characters of %u triangles, of which %u bend with %zu joints. One thread, %s.\n",
              options.crowd.count, crowd.triangles(), crowd.bending_triangles(), crowd.joint_count(),
              device.info().isa);

  const FrameTimes first = crowd.move(0);  // gives each character a tree of its own
  const uint64_t allocated = allocations.count;
  std::vector<FrameTimes> frames;
  Drawn all;
  uint32_t pictures = 0;
  for (uint32_t frame = 0; frame < options.frames; ++frame) {
    frames.push_back(crowd.move(frame / 60.0));
    if (options.pictures.empty() || frame % options.every != 0) continue;
    const Drawn drawn = draw(crowd, options.view);
    char number[16];
    std::snprintf(number, sizeof(number), "-%03u.png", pictures++);
    write_png(drawn.colours, options.view, options.pictures + number);
    all.camera += drawn.camera, all.sun += drawn.sun, all.sky += drawn.sky;
    all.camera_rays += drawn.camera_rays, all.shadow_rays += drawn.shadow_rays;
  }

  std::printf("\n%-44s %12s %12s\n", "a frame, milliseconds of the thread", "median", "first");
  const auto row = [&](const char* name, double FrameTimes::*value) {
    std::printf("%-44s %12.3f %12.3f\n", name, 1e3 * median(frames, value), 1e3 * (first.*value));
  };
  row("joints from the clip, the program's own work", &FrameTimes::animate);
  row("a ray down for each character", &FrameTimes::ground);
  row("poses and transforms to the scene", &FrameTimes::pose);
  row("commit", &FrameTimes::commit);
  const double work = median(frames, &FrameTimes::pose) + median(frames, &FrameTimes::commit);
  std::printf(
      "Poses and commit: %.1f microseconds a character, %.1f ns for each of its triangles that bend.\n",
      1e6 * work / options.crowd.count, 1e9 * work / options.crowd.count / crowd.bending_triangles());
  std::printf(
      "A frame passes %llu bytes to the scene: %llu a character. Allocations after the first frame: %llu.\n",
      (unsigned long long)crowd.bytes_of_a_frame(),
      (unsigned long long)crowd.bytes_of_a_frame() / options.crowd.count,
      (unsigned long long)(allocations.count - allocated));
  print_bytes(crowd, options.crowd.count);
  if (pictures == 0) return;
  std::printf("\n%u pictures; million rays a second: camera %.2f, sun %.2f, sky %.2f\n", pictures,
              1e-6 * double(all.camera_rays) / all.camera, 1e-6 * double(all.shadow_rays) / all.sun,
              1e-6 * double(all.shadow_rays) / all.sky);
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
    std::fprintf(stderr, "characters: %s\n", usage.sentence.c_str());
    return 2;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "characters: %s\n", error.what());
    return 1;
  }
}
