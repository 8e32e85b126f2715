// Reads what is made of latent vectors and floating-point networks: the pairs of networks and the grids of
// `spherical` objects, and the fields that answer primary rays.
//
// Each of these checks every number before it forms a pointer, and every value: what is returned can be
// queried. They throw nif::Error (Status::damaged_nif) with the place.
#pragma once

#include "formats/nif/reader.hpp"
#include "formats/nif/records.hpp"

namespace nif::format {

SphericalNetworksView read_spherical_networks(const SphericalNetworksRecord& record, Blocks& blocks,
                                              const Place& place);

/// The whole field of a `spherical` object whose network's index is in range. Returns the bytes of its grids.
uint64_t read_spherical_field(const ObjectRecord& record, const SphericalNetworksView& networks,
                              Blocks& blocks, const Place& place, kernels::SphericalField& field);

/// The field of the object that the record names, which is in range.
PrimaryView read_primary(const PrimaryRecord& record, const ObjectView& object, Blocks& blocks,
                         const Place& place);

}  // namespace nif::format
