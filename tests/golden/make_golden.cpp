// make_golden SEED NAME [BVHS [SPHERICALS [CODED [EXACTS [PROOFS [SOURCES [COLORS]]]]]]]: writes
// NAME.nif, with so many `bvh`, `spherical`, `exact` and `proof` objects after the others, coded what the
// bits of CODED say (test::kCodedAll), so many of all with source triangles, and so many with colours; and
// NAME.answers. For what the format newly holds only: files that are in this folder are never made anew.
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "formats/base/output_file.hpp"
#include "formats/base/status.hpp"
#include "formats/nif/writer.hpp"
#include "tests/golden/golden.hpp"
#include "tests/support/query_object.hpp"

namespace {

void make(uint64_t seed, const std::string& name, uint32_t bvhs, uint32_t sphericals, uint32_t coded,
          uint32_t exacts, uint32_t proofs, uint32_t sources, uint32_t colors) {
  using namespace nif;
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
  format::Asset asset = test::random_asset(seed, options);
  if (options.instances == 0) asset.metadata.clear();
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
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3 || argc > 10) {
    std::fprintf(
        stderr,
        "usage: make_golden SEED NAME [BVHS [SPHERICALS [CODED [EXACTS [PROOFS [SOURCES [COLORS]]]]]]]\n");
    return int(nif::Status::usage);
  }
  try {
    const auto count = [&](int i) { return i < argc ? uint32_t(std::strtoul(argv[i], nullptr, 10)) : 0; };
    make(std::strtoull(argv[1], nullptr, 10), argv[2], count(3), count(4), count(5), count(6), count(7),
         count(8), count(9));
  } catch (const nif::Error& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return int(error.status());
  }
}
