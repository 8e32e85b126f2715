// Asks the code that makes this layout when an asset is loaded.
#include "bake/loaded/grid_memory.hpp"

#include "kernels/packed/traversal_grid.hpp"

namespace nif::bake {

size_t loaded_bytes(const kernels::PlanesField& field) { return kernels::cpu::traversal_bytes(field); }

}  // namespace nif::bake
