// The bytes of a .nif file that are the same for every encoding, version 2. docs/format.md explains them; the
// two must agree. Records of a part are in its folder (formats/nif/network/network_part.hpp and so on).
//
// Little-endian; the structures below are stored as they are (all members are naturally aligned, no padding).
#pragma once

#include <cstddef>
#include <cstdint>

namespace nif::format {

/// As in PNG and KTX2: a byte over 127 exposes a 7-bit transfer, CR LF and LF expose text-mode conversion,
/// and Ctrl-Z stops a careless `type`. It also differs from NetImmerse/Gamebryo files, which start with plain
/// text. The digits say the version.
inline constexpr uint8_t kIdentifier[12] = {0xAB, 'N', 'I', 'F', ' ', '2', '0', 0xBB, '\r', '\n', 0x1A, '\n'};
inline constexpr uint32_t kVersion = 2;
/// The latest revision of docs/answers.md that this build knows; it answers files of earlier ones as they were
/// meant.
inline constexpr uint32_t kArithmetic = 1;
/// The revision of what proves states, planes and walls in this build; 0: a file proves nothing.
inline constexpr uint32_t kProver = 1;
/// Revisions that turned out to prove what is not true. None so far; 0 stands for files that prove nothing.
inline constexpr uint32_t kDefectiveProvers[] = {0};
/// Whether answers of files with this revision may be certain, also if it is later than this build's.
constexpr bool proves(uint32_t prover) {
  for (const uint32_t defective : kDefectiveProvers)
    if (prover == defective) return false;
  return true;
}
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
  uint32_t arithmetic;   ///< the revision of docs/answers.md by which the file is to be answered
  uint32_t prover;       ///< the revision of what proved its states, planes and walls; 0: nothing is proven
  uint32_t reserved[4];  ///< 0
};
static_assert(sizeof(Header) == 64);

/// In each word of flags: a reader refuses those of these bits that it does not know, and ignores the others.
inline constexpr uint32_t kMustKnow = 0xffff;
/// Those that a reader that knows `known` does not know, and must.
constexpr uint32_t unknown_flags(uint32_t flags, uint32_t known) { return flags & kMustKnow & ~known; }

enum HeaderFlags : uint32_t {
  kPlacesNothing = 1  ///< no object is placed; without it, a file without instances places each once
};

constexpr uint32_t fourcc(const char (&text)[5]) {
  return uint32_t(uint8_t(text[0])) | uint32_t(uint8_t(text[1])) << 8 | uint32_t(uint8_t(text[2])) << 16 |
         uint32_t(uint8_t(text[3])) << 24;
}

/// Sections of every file, and metadata. Those of parts are in their folders, and exist exactly if an object
/// has the part. Types that begin with a lower-case letter are free for anybody, and never ours.
enum SectionType : uint32_t {
  kMetadata = fourcc("META"),   ///< JSON, UTF-8; optional
  kObjects = fourcc("OBJS"),    ///< ObjectRecord[]
  kInstances = fourcc("INST"),  ///< InstanceRecord[]
  kNames = fourcc("NAME"),      ///< names in UTF-8, of all objects, then of all instances, each ended by a 0
  kData = fourcc("DATA"),       ///< payloads of what objects share, then of each object, part by part
};

enum SectionFlags : uint32_t {
  kRequired = 1,  ///< a reader that does not know the section must refuse the file
  kPayloads = 2,  ///< the section holds payloads, which have checksums of their own
  kKeep = 4,      ///< who changes a file keeps the section even without knowing it
  kSectionFlags = 7
};

struct SectionEntry {  // 32 bytes, sorted by offset
  uint32_t type;
  uint32_t flags;
  uint64_t offset;       ///< from the start of the file, a multiple of kAlignment
  uint64_t bytes;        ///< without the zeros up to the next section
  uint32_t crc;          ///< CRC-32C of those bytes; 0 with kPayloads
  uint32_t record_size;  ///< of a section of records, a multiple of 8; otherwise 0
};
static_assert(sizeof(SectionEntry) == 32);

/// A payload within a section. Payloads are in the order of their records, each at a multiple of kAlignment.
/// What lies between them belongs to later versions.
struct Payload {    // 24 bytes
  uint64_t offset;  ///< from the start of the section
  uint64_t bytes;
  uint32_t crc;       ///< CRC-32C of those bytes
  uint32_t reserved;  ///< 0
};
static_assert(sizeof(Payload) == 24);

struct Name {
  uint32_t offset, bytes;  ///< in kNames; bytes without the 0 that follows
};

/// Index of a part that an object does not have.
inline constexpr uint32_t kNoPart = 0xffffffff;

/// An object with a flag that a build does not know is not answered by it.
enum ObjectFlags : uint32_t {
  kCutOuts = 1,  ///< triangles have holes
  kDeforms =
      2  ///< for a later version; what bends by skin_section.hpp needs none; 4 and on are free: each part that comes later has one of its own
};

inline constexpr uint32_t kMaxLevel = 15;

struct ObjectRecord {
  /// Of the records of files in which no object has a part that came later.
  static constexpr uint32_t kFirstBytes = 80;
  uint32_t flags;  ///< ObjectFlags
  /// Its parts. Each is an index into the records of that part, which is the number of earlier objects with
  /// such a part; or kNoPart.
  uint32_t planes, triangles, network, spherical;
  uint32_t level;  ///< 0: the finest; k: a coarser stand-in for the next object, which has level k - 1
  Name name;
  float aabb_min[3], aabb_max[3];
  float bias;               ///< distance from the surface at which shadow rays start, object units
  uint32_t triangle_count;  ///< of the source mesh, after cleaning (saturated at 2^32 - 1)
  float error;              ///< most distance from the source's surface, object units; 0 if unknown or none
  uint32_t reserved[3];     ///< 0
  // Parts that came later, two at a time, because the size is a multiple of 8. Their initial values are those of
  // objects in records that end before.
  uint32_t holes = kNoPart, spare = kNoPart;
};
static_assert(offsetof(ObjectRecord, reserved) + 12 == ObjectRecord::kFirstBytes);
static_assert(sizeof(ObjectRecord) % 8 == 0);

enum InstanceFlags : uint32_t {
  kDisabled = 1  ///< no ray meets it
};

inline constexpr uint32_t kNoParent = 0xffffffff;

struct InstanceRecord {   // 96 bytes
  double translation[3];  ///< each the sum of two floats
  float linear[9];        ///< rows of the rest of the transform from object to world
  uint32_t object;        ///< of level 0
  Name name;
  uint64_t user;      ///< for the user; answers do not depend on it
  uint32_t mask;      ///< a ray meets the instance only if their masks have a bit in common
  uint32_t flags;     ///< InstanceFlags
  uint32_t parent;    ///< an instance before it that takes it along when it moves; kNoParent: none
  uint32_t reserved;  ///< 0
};
static_assert(sizeof(InstanceRecord) == 96);

}  // namespace nif::format
