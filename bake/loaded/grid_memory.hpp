// The memory that planes take once an asset is loaded.
#pragma once

#include <cstddef>

#include "kernels/reference/planes/planes_field.hpp"

namespace nif::bake {

/// Bytes that the fast kernels add to what is in the file: their own layout of the occupancy and the cells.
size_t loaded_bytes(const kernels::PlanesField& field);

}  // namespace nif::bake
