// Writes a BVH: of any encoding that has one.
#pragma once

#include "formats/nif/bvh/encoding.hpp"

namespace nif::format {

/// Adds a tree to its section, and what a record says of it.
template <class Record>
void add_bvh(const Bvh& bvh, Section& trees, Record& record) {
  record.nodes = uint32_t(bvh.nodes.size());
  record.vertices = uint32_t(bvh.vertices.size());
  record.triangles = uint32_t(bvh.triangles.size());
  record.tree = trees.begin_payload();
  trees.append(bvh.nodes);
  trees.append(bvh.vertices);
  trees.append(bvh.triangles);
  trees.end_payload(record.tree);
}

/// A tree that owns its memory.
Bvh bvh_data(const kernels::BvhField& field);

}  // namespace nif::format
