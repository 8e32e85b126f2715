// Animations of a file, which move its nodes and deform its meshes.
#pragma once

#include <cstdint>
#include <string>

namespace nif::mesh {

/// When to read a file whose parts move.
struct Moment {
  std::string clip;  ///< the name of an animation, or its number from 0 on
  double time =
      0;  ///< in seconds; before the first key of a channel its value is the first, after the last the last
};

/// An animation.
struct Clip {
  std::string name;           ///< UTF-8; may be empty
  double begin = 0, end = 0;  ///< in seconds, of the first and the last key
  uint64_t channels = 0;      ///< that move or deform something
  size_t number = 0;          ///< in the file, from 0 on
};

}  // namespace nif::mesh
