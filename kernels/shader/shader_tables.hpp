// The tables of one object as shaders read them: one array of 32-bit words (docs/shaders.md has it word by
// word). kernels/shader/nif.glsl is what reads them.
#pragma once

#include <cstdint>
#include <memory_resource>
#include <vector>

#include "kernels/reference/encodings/reference_exact.hpp"
#include "kernels/reference/hit_details.hpp"
#include "kernels/reference/network/network_field.hpp"
#include "kernels/reference/planes/planes_field.hpp"
#include "kernels/reference/triangles/source_triangles.hpp"

namespace nif::kernels::shader {

/// The first word: "NIFS" in memory. Read in the other byte order it is another number.
inline constexpr uint32_t kMagic = 0x5346494e;
/// Counts up whenever a shader made for the tables before would read them wrongly.
inline constexpr uint32_t kVersion = 2;
inline constexpr uint32_t kHeaderWords = 64;

/// Bits of the header's word kFlags.
enum HeaderFlags : uint32_t {
  kHasNetwork = 1,
  kProves = 2,  ///< answers may be certain
  kHasTriangles = 4,
  kHasPlanes = 8
};

/// Words of the header. Tables are given as their first word, counted from the header's.
enum HeaderWord : uint32_t {
  kMagicWord = 0,
  kVersionWord = 1,
  kWordCount = 2,  ///< of the header and all tables
  kFlags = 3,
  kOrigin = 4,         ///< [3] float
  kCellsPerUnit = 7,   ///< float
  kVoxelsPerCell = 8,  ///< float
  kLevels = 9,
  kVoxels = 10,        ///< [3]
  kVoxelWords = 13,    ///< table
  kChildren = 14,      ///< table
  kCornerTable = 15,   ///< table
  kCornerBricks = 16,  ///< table
  kPairs = 17,         ///< table: two pairs of features a word
  kSamples = 18,
  kLengthScale = 19,  ///< float
  kLayerCount = 20,
  kNetworkWords = 21,  ///< what a shader's NIF_NETWORK_WORDS must be at least
  kLogitScale = 22,    ///< float
  kThreshold = 23,     ///< int
  kLayers = 24,        ///< [4][4]: table, words of inputs, outputs, shift
  kBounds = 40,        ///< [6] float: lowest, then highest corner of the mesh
  kBias = 46,          ///< float
  kReachUnits = 47,    ///< float: finest cells per unit, or of triangles 64 to the extent, whichever are more
  kTree = 48,          ///< table
  kTreeEnd = 49,       ///< the word behind it, counted as tables are
  kVertices = 50,      ///< table: three floats each
  kSourceNumbers = 51,  ///< table of numbers of triangles in the source mesh
  kSourceBits = 52,     ///< of each such number; 0: there are none
  kExtent = 53,         ///< float: no coordinate of a triangle is larger
  kTreeCorner = 54,     ///< [3] float
  kTreeStep = 57,       ///< [3] float
  kColorBricks = 60,    ///< table: two entries of PlanesField::brick_table a word
  kColorRecords = 61,   ///< table: of each mixed brick its voxel_base, and which of its voxels have colours
  kColors = 62          ///< table: two VoxelColors::values a word; 0: there are none
};

/// The first word of a scene: "NIFC" in memory.
inline constexpr uint32_t kSceneMagic = 0x4346494e;
inline constexpr uint32_t kSceneWords = 16, kInstanceWords = 24;
/// Words of a scene's header. Instances follow, then the tree over them, then the tables of objects.
enum SceneWord : uint32_t {
  kSceneMagicWord = 0,
  kSceneVersionWord = 1,
  kSceneWordCount = 2,
  kSceneFlags = 3,  ///< kProves
  kInstanceCount = 4,
  kSceneBounds = 5,  ///< [6] float
  kTopLevel = 11,    ///< first word of the tree
  kObjects = 12      ///< the word behind it
};
/// Words of an instance.
enum InstanceWord : uint32_t {
  kInverse = 0,      ///< [9] float
  kTranslation = 9,  ///< [3] float
  kRemainder = 12,   ///< [3] float
  kWorldBox = 15,    ///< [6] float: lowest, then highest corner
  kObjectWord = 21,  ///< first word of its object's header, from the scene's; and InstanceBits
  kMask = 22,
  kNumber = 23  ///< of the instance in the scene
};
enum InstanceBits : uint32_t {
  kIdentityBit = 0x20000000u,
  kWellConditionedBit = 0x40000000u,
  kUnprovenBit = 0x80000000u
};

/// Of the object, for the header.
struct About {
  bool proves;
  float bounds[6];
  float bias;
};

/// Why an object's network cannot be given to shaders, as the end of a sentence about it: "has ...". Null if
/// it can.
const char* unfit(const SegmentField& field, std::pmr::memory_resource* memory);

std::pmr::vector<uint32_t> make_tables(const PlanesField& field, const About& about,
                                       std::pmr::memory_resource* memory);
/// Requires that it is not unfit().
std::pmr::vector<uint32_t> make_tables(const SegmentField& field, const About& about,
                                       std::pmr::memory_resource* memory);

/// How many words the tables of an object have, without making them.
uint64_t count_words(const PlanesField& field);
uint64_t count_words(const TrianglesField& field, const SourceTriangles& source);
uint64_t count_words(const ExactField& field, const HitDetails& details);

/// `source`, `details`: as the object has them, or empty.
std::pmr::vector<uint32_t> make_tables(const TrianglesField& field, const SourceTriangles& source,
                                       const About& about, std::pmr::memory_resource* memory);
std::pmr::vector<uint32_t> make_tables(const ExactField& field, const HitDetails& details, const About& about,
                                       std::pmr::memory_resource* memory);

}  // namespace nif::kernels::shader
