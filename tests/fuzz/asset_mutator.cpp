// How fuzzers change assets. Most mutations keep offsets and checksums right: without that nothing behind
// them would ever be reached.
#include <algorithm>
#include <cstring>

#include "tests/fuzz/mutate.hpp"

extern "C" size_t LLVMFuzzerMutate(uint8_t* data, size_t size, size_t max_size);

extern "C" size_t LLVMFuzzerCustomMutator(uint8_t* data, size_t size, size_t max_size, unsigned seed) {
  nif::test::Random random(seed);
  const uint32_t kind = random.below(8);
  nif::test::Bytes bytes(size);
  if (size > 0) std::memcpy(bytes.data(), data, size);
  if (kind > 2) {
    bytes = nif::test::mutate_structure(bytes, random, LLVMFuzzerMutate);
    if (bytes.size() > max_size) return size;
  } else {
    size = LLVMFuzzerMutate(data, size, max_size);
    if (kind == 0) return size;
    bytes.resize(size);
    std::memcpy(bytes.data(), data, size);
    if (kind == 1 && size >= sizeof(nif::format::Header)) {
      auto header = nif::test::load<nif::format::Header>(bytes, 0);
      header.file_bytes = size;
      nif::test::store(bytes, 0, header);
    }
    nif::test::fix_checksums(bytes);
  }
  std::memcpy(data, bytes.data(), bytes.size());
  return bytes.size();
}

extern "C" size_t LLVMFuzzerCustomCrossOver(const uint8_t* one, size_t one_size, const uint8_t* other,
                                            size_t other_size, uint8_t* out, size_t max_size, unsigned) {
  const auto bytes_of = [](const uint8_t* data, size_t size) {
    const auto* bytes = reinterpret_cast<const std::byte*>(data);
    return nif::test::Bytes(bytes, bytes + size);
  };
  const nif::test::Bytes joined =
      nif::test::join_assets(bytes_of(one, one_size), bytes_of(other, other_size));
  constexpr size_t kEnough = 24 << 10;  // otherwise inputs keep growing and get slower
  if (joined.size() > std::min(max_size, kEnough)) return 0;
  if (!joined.empty()) std::memcpy(out, joined.data(), joined.size());
  return joined.size();
}
