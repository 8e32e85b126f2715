// The sections of `bvh` objects in a .nif file.
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

}  // namespace nif::format
