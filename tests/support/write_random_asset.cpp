// write_random_asset SEED FILE [VOXELS]: a small asset for tests that need one as a file. With VOXELS, its
// grids have at most so many along an axis, and an odd seed gives it a `bvh` object, every third one two
// `spherical` ones, every fourth one fields for primary rays. Two of three have their payloads coded.
#include <cstdio>
#include <cstdlib>
#include <fstream>

#include "formats/base/status.hpp"
#include "formats/nif/writer.hpp"
#include "tests/support/random_asset.hpp"

int main(int argc, char** argv) {
  if (argc != 3 && argc != 4) {
    std::fprintf(stderr, "usage: write_random_asset SEED FILE [VOXELS]\n");
    return int(nif::Status::usage);
  }
  const uint64_t seed = std::strtoull(argv[1], nullptr, 10);
  nif::test::RandomAssetOptions options;
  if (argc == 4) {
    options.max_voxels = uint32_t(std::max(1, std::atoi(argv[3])));
    options.objects = 1 + uint32_t(seed % 3);
    options.instances = uint32_t(seed % 4);
    options.bvhs = uint32_t(seed % 2);
    options.sphericals = seed % 3 == 0 ? 2 : 0;
    options.exacts = seed % 2;
    options.proofs = seed / 2 % 2;
    options.primaries = seed % 4 == 0 ? 2 : 0;
    options.sources = uint32_t(seed / 2 % 2);
    options.colors = uint32_t(seed / 4 % 2);
    options.coded = seed % 3 == 0 ? 0u : uint32_t{nif::test::kCodedAll};
    options.odd_corners = seed % 5 == 0;
  }
  // Not an OutputFile, which Windows lacks.
  const auto bytes = nif::format::encode(nif::test::random_asset(seed, options));
  std::ofstream file(argv[2], std::ios::binary);
  file.write(reinterpret_cast<const char*>(bytes.data()), std::streamsize(bytes.size()));
  file.close();
  if (!file) {
    std::fprintf(stderr, "%s: cannot be written\n", argv[2]);
    return int(nif::Status::output_not_writable);
  }
}
