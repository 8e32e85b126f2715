// The one source that holds the implementation of tinygltf. The packaged library is not used: it is built
// with other options. What is left out here is never reached: buffers, images and Draco are our own affair.
#include <fstream>  // which the header forgets to include without its file system
#include <nlohmann/json.hpp>

#define TINYGLTF_IMPLEMENTATION
#include <tiny_gltf.h>
