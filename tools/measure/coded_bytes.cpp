// A study, not a test: how many bytes payloads take when they are coded. docs/results/coding.sh compiles this
// in copies of the sources, in each of which one choice of the coder is different.
//
// coded_bytes FILE...
//
// Prints for each asset, which must be uncoded, the bytes of occupancy, planes and features in a coded file.
#include <cstdio>
#include <string_view>

#include "formats/base/status.hpp"
#include "formats/nif/file_memory.hpp"
#include "formats/nif/writer.hpp"

int main(int argc, char** argv) {
  using namespace nif;
  try {
    for (int i = 1; i < argc; ++i) {
      const format::FileMemory memory = format::FileMemory::load(argv[i], format::FileMemory::Mode::read);
      format::Asset asset = format::to_asset(format::read_asset(memory.bytes(), argv[i]));
      for (format::Object& object : asset.objects) {
        if (object.planes) object.planes->coded = format::kCodedPlanes;
        if (object.network) object.network->coded = format::kNetworkForms;
      }
      const std::vector<std::byte> coded = format::encode(asset);
      uint64_t bytes[3] = {};
      for (const format::PartBytes& part : format::bytes_by_part(format::read_asset(coded, argv[i]))) {
        const std::string_view name = part.name;
        for (const auto& [n, wanted] : {std::pair(0, "occupancy"), {1, "planes"}, {2, "features"}})
          if (name == wanted) bytes[n] = part.bytes;
      }
      std::printf("%llu %llu %llu\n", static_cast<unsigned long long>(bytes[0]),
                  static_cast<unsigned long long>(bytes[1]), static_cast<unsigned long long>(bytes[2]));
    }
  } catch (const Error& error) {
    std::fprintf(stderr, "coded_bytes: %s\n", error.what());
    return int(error.status());
  }
}
