// answer_rays write|compare FILE ASSET ISA RAYS
// answer_rays speed         -    ASSET ISA RAYS
//
// Queries the asset's first object on one thread, so that one system's answers and speed can be compared with
// another's (docs/results/platforms.sh). FILE gets each ray's logit, whether it is certain and, bit for bit,
// its first hit; `compare` counts the rays that differ. Prints, tab-separated: ISA, million rays per second
// of the fastest query for `visible`, the rays, and how many differ. Ends with 1 if any does. `speed` queries
// the same 2,000 rays again and again: so short a query is unlikely to be disturbed by other work of the
// machine.
#include <nif/nif.hpp>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <fstream>
#include <string>
#include <vector>

#include "tests/support/box_rays.hpp"

namespace {

constexpr size_t kPiece = 250'000, kShortPiece = 2'000;  ///< rays at a time; for `speed`

struct Answer {
  int32_t logit;
  uint32_t certain;
  float t;
};

void run(const std::string& mode, const char* file, const char* path, const std::string& isa, size_t count) {
  const bool compare = mode == "compare", speed = mode == "speed";
  const nifkit::Device device("threads=1,isa=" + isa);
  const nifkit::Asset asset = nifkit::Asset::load(device, path);
  auto object = nifkit::sized<NifObjectInfo>();
  nifkit::check(nifGetObjectInfo(asset.get(), 0, &object));
  nifkit::Scene scene(device);
  nifkit::check(nifAddInstance(scene.get(), asset.get(), 0, nullptr, nullptr));
  scene.commit();

  std::fstream stream;
  if (!speed) stream.open(file, std::ios::binary | (compare ? std::ios::in : std::ios::out));
  std::vector<uint8_t> visible(kPiece), certain(kPiece);
  std::vector<int32_t> logit(kPiece);
  std::vector<float> t(kPiece);
  std::vector<Answer> answers(kPiece), others(kPiece);
  double fastest = 0;
  size_t different = 0;
  const size_t most = speed ? kShortPiece : kPiece;
  std::vector<NifRay> piece;
  for (size_t done = 0; done < count; done += most) {
    const size_t rays = std::min(most, count - done);
    if (!speed || done == 0) piece = nif::test::make_box_rays(object, rays, uint32_t(done / most + 1));
    NifRays query = nifMakeRays(piece.data(), rays);
    auto outputs = nifkit::sized<NifAnswers>();
    outputs.visible = visible.data();
    const auto start = std::chrono::steady_clock::now();
    nifkit::check(nifQuery(scene.get(), &query, &outputs));
    const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
    fastest = std::max(fastest, 1e-6 * double(rays) / seconds.count());
    if (speed) continue;

    outputs.visible = nullptr;
    outputs.logit = logit.data();
    outputs.certain = certain.data();
    nifkit::check(nifQuery(scene.get(), &query, &outputs));
    query = nifMakeRays(piece.data(), rays);
    auto hits = nifkit::sized<NifHits>();
    hits.t = t.data();
    nifkit::check(nifIntersect(scene.get(), &query, &hits));
    for (size_t i = 0; i < rays; ++i) {
      if ((logit[i] >= 0) != (visible[i] != 0)) throw std::runtime_error("a logit is not what is visible");
      answers[i] = {logit[i], certain[i], t[i]};
    }
    if (compare) {
      stream.read(reinterpret_cast<char*>(others.data()), std::streamsize(rays * sizeof(Answer)));
      for (size_t i = 0; i < rays; ++i)
        different += std::memcmp(&answers[i], &others[i], sizeof(Answer)) != 0;
    } else {
      stream.write(reinterpret_cast<const char*>(answers.data()), std::streamsize(rays * sizeof(Answer)));
    }
  }
  stream.flush();
  if (!speed && !stream) throw std::runtime_error(std::string(file) + ": cannot be read or written");
  std::printf("%s\t%.3f\t%zu\t%zu\n", isa.c_str(), fastest, count, different);
  if (different) throw std::runtime_error("the answers differ");
}

}  // namespace

int main(int argc, char** argv) try {
  const std::string mode = argc == 6 ? argv[1] : "";
  if (mode != "write" && mode != "compare" && mode != "speed") {
    std::fputs("usage: answer_rays write|compare|speed FILE ASSET ISA RAYS\n", stderr);
    return 2;
  }
  run(mode, argv[2], argv[3], argv[4], std::strtoull(argv[5], nullptr, 10));
  return 0;
} catch (const std::exception& error) {
  std::fprintf(stderr, "answer_rays: %s\n", error.what());
  return 1;
}
