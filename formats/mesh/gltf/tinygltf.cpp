// The only source with the implementation of tinygltf. The packaged library is not used, because it is built
// with other options. Parts that are excluded here are never reached: we read buffers, images and Draco
// ourselves.
#include <fstream>  // the header lacks this include if its file system is excluded
#include <nlohmann/json.hpp>

#define TINYGLTF_IMPLEMENTATION
#include <tiny_gltf.h>
