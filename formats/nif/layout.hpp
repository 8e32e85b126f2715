// The bytes of a .nif file that are the same for every encoding, version 2. docs/format.md explains them; the
// two must agree. Records of a part are in its folder (formats/nif/network/part.hpp and so on).
//
// Little-endian; the structures below are stored as they are (all members are naturally aligned, no padding).
#pragma once

#include <cstdint>

namespace nif::format {

/// As in PNG and KTX2: a byte over 127 exposes a 7-bit transfer, CR LF and LF expose text-mode conversion,
/// and Ctrl-Z stops a careless `type`. It also differs from NetImmerse/Gamebryo files, which start with plain
/// text.
inline constexpr uint8_t kIdentifier[12] = {0xAB, 'N', 'I', 'F', ' ', '1', '0', 0xBB, '\r', '\n', 0x1A, '\n'};
/// Version 2 is experimental: it changes without a new number until docs/format.md declares it frozen.
inline constexpr uint32_t kVersion = 2;
inline constexpr uint64_t kAlignment = 64;  ///< of every section and of every payload within a section
inline constexpr uint32_t kMaxSections = 64;

struct Header {  // 64 bytes, at offset 0; the section table follows at once
  uint8_t identifier[12];
  uint32_t version;
  uint64_t file_bytes;
  uint32_t section_count;
  uint32_t table_crc;    ///< CRC-32C of the section table
  uint32_t header_crc;   ///< CRC-32C of this header with header_crc as 0
  uint32_t flags;        ///< HeaderFlags
  uint32_t reserved[6];  ///< 0
};
static_assert(sizeof(Header) == 64);

enum HeaderFlags : uint32_t {
  kPlacesNothing = 1  ///< no object is placed; without it, a file without instances places each once
};

constexpr uint32_t fourcc(const char (&text)[5]) {
  return uint32_t(uint8_t(text[0])) | uint32_t(uint8_t(text[1])) << 8 | uint32_t(uint8_t(text[2])) << 16 |
         uint32_t(uint8_t(text[3])) << 24;
}

/// Sections of every file. The others belong to a part, and exist exactly if an object has that part.
enum SectionType : uint32_t {
  kMetadata = fourcc("META"),   ///< JSON, UTF-8; optional
  kObjects = fourcc("OBJS"),    ///< ObjectRecord[]
  kInstances = fourcc("INST"),  ///< InstanceRecord[]
  kNames = fourcc("NAME"),      ///< names in UTF-8, of all objects, then of all instances, each ended by a 0
  kTranslations = fourcc("TRAN"),  ///< Translation[], one for each instance; optional
};

enum SectionFlags : uint32_t {
  kRequired = 1
};  ///< a reader that does not know a required section must refuse

struct SectionEntry {  // 32 bytes, sorted by offset
  uint32_t type;
  uint32_t flags;
  uint64_t offset;    ///< from the start of the file, a multiple of kAlignment
  uint64_t bytes;     ///< without the zeros up to the next section
  uint32_t crc;       ///< CRC-32C of those bytes
  uint32_t reserved;  ///< 0
};
static_assert(sizeof(SectionEntry) == 32);

/// A payload within a section. Payloads are in the order of their records, each at the next multiple of
/// kAlignment.
struct Payload {
  uint64_t offset;  ///< from the start of the section
  uint64_t bytes;
};

struct Name {
  uint32_t offset, bytes;  ///< in kNames; bytes without the 0 that follows
};

/// Index of a part that an object does not have.
inline constexpr uint32_t kNoPart = 0xffffffff;

struct ObjectRecord {  // 64 bytes
  /// Its parts. Each is an index into the records of that part, which is the number of earlier objects with
  /// such a part; or kNoPart.
  uint32_t planes, triangles, network, spherical;
  Name name;
  float aabb_min[3], aabb_max[3];
  float bias;               ///< distance from the surface at which shadow rays start, object units
  uint32_t triangle_count;  ///< of the source mesh, after cleaning (saturated at 2^32 - 1)
  uint32_t reserved[2];     ///< 0
};
static_assert(sizeof(ObjectRecord) == 64);

struct InstanceRecord {  // 64 bytes
  float transform[12];   ///< object to world, row-major 3x4
  uint32_t object;
  Name name;
  uint32_t reserved;  ///< 0
};
static_assert(sizeof(InstanceRecord) == 64);

/// An instance's translation before rounding: the sum of the float in its transform and of a second float,
/// the remainder.
struct Translation {  // 24 bytes
  double along[3];
};
static_assert(sizeof(Translation) == 24);

}  // namespace nif::format
