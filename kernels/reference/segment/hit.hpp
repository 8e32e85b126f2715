// The first hit of one `segment` object: planes, and where they leave it open, the network.
#pragma once

#include "kernels/reference/proof/hit.hpp"
#include "kernels/reference/segment/query.hpp"

namespace nif::kernels {

/// As intersect(), of a field in another form that has its own voxel_word() and interpolate_features().
template <class Field>
Hit intersect_as(const Field& field, const Segment& segment, float limit) {
  return hit_by_planes(field, segment, limit,
                       [&](const Segment& part) { return !query_as(field, part).visible; });
}
inline Hit intersect(const SegmentField& field, const Segment& segment, float limit = kNoHit) {
  return intersect_as(field, segment, limit);
}

}  // namespace nif::kernels
