// write_random_asset SEED FILE: a small asset for tests that need one as a file.
#include <cstdio>
#include <cstdlib>

#include "formats/nif/writer.hpp"
#include "formats/output_file.hpp"
#include "formats/status.hpp"
#include "tests/support/random_asset.hpp"

int main(int argc, char** argv) {
  if (argc != 3) {
    std::fprintf(stderr, "usage: write_random_asset SEED FILE\n");
    return int(nif::Status::usage);
  }
  try {
    nif::write_output(argv[2],
                      nif::format::encode(nif::test::random_asset(std::strtoull(argv[1], nullptr, 10))));
  } catch (const nif::Error& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return int(error.status());
  }
}
