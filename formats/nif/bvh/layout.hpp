// The sections of `bvh` objects in a .nif file, and what objects with a BVH of any encoding may have.
#pragma once

#include "formats/nif/layout.hpp"

namespace nif::format {

enum BvhSection : uint32_t {
  kBvhRecords = fourcc("BVHR"),  ///< BvhRecord[]
  kBvhs = fourcc("BVHS"),        ///< each object's payload
};

struct BvhRecord {  // 32 bytes: the members of kernels::BvhField
  uint32_t nodes, vertices, triangles;
  uint32_t reserved;  ///< 0
  Payload tree;       ///< nodes, vertices, triangles, in that order, without gaps
};
static_assert(sizeof(BvhRecord) == 32);

/// Optional, both or none.
enum SourceSection : uint32_t {
  kSourceRecords = fourcc("SRCT"),  ///< SourceRecord[]
  kSourceNumbers = fourcc("SNUM"),  ///< each record's payload
};

/// Which triangles of the source mesh the triangles of an object with a BVH are.
struct SourceRecord {    // 32 bytes
  uint32_t object;       ///< index into kObjects; records lie in the order of their objects
  uint32_t triangles;    ///< of the source mesh, before cleaning
  uint32_t reserved[2];  ///< 0
  Payload numbers;       ///< of each triangle, packed: kernels::SourceTriangles
};
static_assert(sizeof(SourceRecord) == 32);

}  // namespace nif::format
