// Writes an asset as the bytes of a .nif file.
#pragma once

#include <cstddef>
#include <map>
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
/// The size of a file as parts come and go, each in constant time: the encoded_bytes() of all of them
/// together, or up to kAlignment - 1 bytes more.
class FileSize {
 public:
  void add(const SectionBytes& part);
  /// Removes a part that was added.
  void remove(const SectionBytes& part);
  uint64_t bytes() const;

 private:
  struct Sum {
    uint64_t parts = 0, bytes = 0;
  };
  std::map<uint32_t, Sum> sections_;
};

/// A copy that owns its memory. Of a file that encode() made, it makes the same bytes again; of the file of
/// another writer, a file of the same asset (without sections that this build does not know).
Asset to_asset(const AssetView& view);

/// The text, with everything that a name in an asset may not contain (bytes that are not UTF-8, zeros)
/// replaced by U+FFFD.
std::string clean_name(std::string_view text);

}  // namespace nif::format
