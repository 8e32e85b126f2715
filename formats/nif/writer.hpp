// Writes an asset as the bytes of a .nif file.
#pragma once

#include <cstddef>
#include <map>
#include <mutex>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "formats/nif/asset.hpp"
#include "formats/nif/reader.hpp"

namespace nif::format {

/// The bytes of the file. The same asset always gives the same bytes. They are read back before they are
/// returned: an asset that the reader would refuse throws nif::Error (Status::internal) with the reader's
/// sentence, so no such file is ever made.
std::vector<std::byte> encode(const Asset& asset);
/// The same, with the view from reading them back.
struct EncodedAsset {
  std::vector<std::byte> bytes;
  AssetView view;  ///< into `bytes`; stays valid when both are moved
};
EncodedAsset encode_and_view(const Asset& asset);

/// The number of bytes that encode() would make, without making them.
uint64_t encoded_bytes(const Asset& asset);

/// What a part of an asset adds to a file: bytes by type of section, with each payload padded up to the next
/// one.
using SectionBytes = std::vector<std::pair<uint32_t, uint64_t>>;
SectionBytes section_bytes(const Asset& part);
/// The size of a file while its parts still change, each in constant time. Thread-safe.
class FileSize {
 public:
  /// Replaces what a part adds to the file, at first nothing. Parts have numbers that callers choose.
  void set(size_t part, const SectionBytes& bytes);
  /// The encoded_bytes() of all parts together, or up to kAlignment - 1 bytes more.
  uint64_t bytes() const;

 private:
  struct Sum {
    uint64_t parts = 0, bytes = 0;
  };
  mutable std::mutex changing_;
  std::vector<SectionBytes> parts_;
  std::map<uint32_t, Sum> sections_;  ///< by type
};

/// A copy that owns its memory. Of a file that encode() made, it makes the same bytes again; of the file of
/// another writer, a file of the same asset. It leaves out what this build does not know: sections without
/// kKeep, flags that a reader may ignore, further bytes of records, what lies between payloads. Throws
/// nif::Error (Status::unsupported_nif) if an object is not supported.
Asset to_asset(const AssetView& view);

/// The text, with everything that a name in an asset may not contain (bytes that are not UTF-8, zeros)
/// replaced by U+FFFD.
std::string clean_name(std::string_view text);

}  // namespace nif::format
