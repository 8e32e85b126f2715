// Finds what a file's name tells about its format. Case does not matter: ".PLY.GZ" is ".ply.gz".
#pragma once

#include <filesystem>
#include <string>

namespace nif {

/// ".ply" for "dragon.PLY", "" if there is no ending.
inline std::string ending_of(const std::filesystem::path& file) {
  std::string ending = file.extension().string();
  for (char& c : ending)
    if (c >= 'A' && c <= 'Z') c = char(c - 'A' + 'a');
  return ending;
}

/// The last part of a path, without an ending for compression: "dragon.ply" for "meshes/dragon.ply.gz".
inline std::filesystem::path unpacked_name(const std::filesystem::path& file) {
  const std::string packing = ending_of(file);
  return packing == ".gz" || packing == ".zst" ? file.stem() : file.filename();
}

}  // namespace nif
