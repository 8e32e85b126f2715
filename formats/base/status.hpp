// What can go wrong with a file or a request, as one enum that is also the exit code of every program.
//
// Part of the dependency-free core: the runtime compiles it too and maps these to the codes of nif.h.
#pragma once

#include <stdexcept>
#include <string>
#include <utility>

namespace nif {

/// Outcome of a program or of a failed call. The numbers are the exit codes of `nif` and never change.
enum class Status : int {
  ok = 0,
  internal = 1,  ///< a defect of nifkit itself
  usage = 2,     ///< unknown, missing or contradictory options

  // Reading an input file.
  file_not_found = 10,
  file_unreadable = 11,  ///< permission, a directory, an I/O error
  file_empty = 12,
  file_truncated = 13,  ///< ends before its own header says it does
  not_a_mesh = 14,      ///< the content is of no mesh format that we read
  malformed_mesh = 15,  ///< of a mesh format, but its content contradicts itself
  no_triangles = 16,
  non_finite_vertex = 17,
  index_out_of_range = 18,
  all_degenerate = 19,         ///< triangles, but none of them has an area
  missing_buffer = 20,         ///< a glTF that names a buffer or image file which is not there
  unsupported_extension = 21,  ///< a required extension that we do not decode, e.g. KHR_meshopt_compression
  too_large = 22,              ///< beyond a stated limit of nifkit or of this machine's memory
  malformed_scene = 23,        ///< a scene file that is none, or whose fields contradict each other
  not_an_image = 24,           ///< an environment map that is no picture, or holds no light
  malformed_manifest = 25,     ///< a manifest that is none, or whose entries contradict each other
  needs_repair = 26,           ///< with --strict: a mesh that preparation would change

  // Reading an asset.
  not_a_nif = 30,
  foreign_nif = 31,      ///< a NetImmerse/Gamebryo model, which shares the extension
  damaged_nif = 32,      ///< wrong checksum or structure
  unsupported_nif = 33,  ///< a version or a required section newer than this build
  mesh_mismatch = 34,    ///< the mesh given beside an asset is not the one it was baked from

  // Writing.
  output_folder_missing = 40,
  output_not_writable = 41,

  // Baking.
  target_not_met = 50,   ///< --max-bytes or --max-error cannot be reached
  training_failed = 51,  ///< the loss stayed non-finite after every recovery, or no rays to learn from
  out_of_memory = 52,

  farm_failed = 53,  ///< no scheduler, or it refuses the jobs, or tasks were lost

  interrupted = 130,  ///< Ctrl-C or a cancelling callback
};

/// An error with one clear sentence that names the file and the place.
class Error : public std::runtime_error {
 public:
  Error(Status status, const std::string& sentence) : std::runtime_error(sentence), status_(status) {}
  Status status() const { return status_; }

 private:
  Status status_;
};

}  // namespace nif
