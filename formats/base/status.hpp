// Everything that can go wrong with a file or a request: one enum, also the exit codes of every program.
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
  internal = 1,  ///< a bug in nifkit
  usage = 2,     ///< unknown, missing or conflicting options

  // Reading an input file.
  file_not_found = 10,
  file_unreadable = 11,  ///< no permission, a folder, or an I/O error
  file_empty = 12,
  file_truncated = 13,  ///< shorter than its header says
  not_a_mesh = 14,      ///< not in a mesh format that we read
  malformed_mesh = 15,  ///< in a mesh format, but its content is inconsistent
  no_triangles = 16,
  non_finite_vertex = 17,
  index_out_of_range = 18,
  all_degenerate = 19,         ///< it has triangles, but none has an area
  missing_buffer = 20,         ///< a glTF that refers to a file that does not exist
  unsupported_extension = 21,  ///< requires an extension that we do not support, e.g. KHR_meshopt_compression
  too_large = 22,              ///< beyond a limit of nifkit, or this machine's memory
  malformed_scene = 23,        ///< not a valid scene file
  not_an_image = 24,           ///< an environment map that is not a picture, or has no light
  malformed_manifest = 25,     ///< not a valid manifest
  needs_repair = 26,           ///< with --strict: a mesh that needs repair, or was not read whole
  malformed_rays = 27,         ///< not a valid file of rays
  malformed_results = 28,      ///< not valid results of another program for nif bench --compare

  // Reading an asset.
  not_a_nif = 30,
  foreign_nif = 31,      ///< a NetImmerse/Gamebryo model: same extension, different format
  damaged_nif = 32,      ///< wrong checksum or structure
  unsupported_nif = 33,  ///< needs a newer build
  mesh_mismatch = 34,    ///< the asset was not baked from the given mesh
  doubtful_nif = 35,     ///< with nif validate --strict: an asset with warnings

  // Writing.
  output_folder_missing = 40,
  output_not_writable = 41,

  // Baking.
  target_not_met = 50,   ///< --max-bytes or --max-error cannot be reached
  training_failed = 51,  ///< the loss stayed non-finite, or there are no rays to learn from
  out_of_memory = 52,

  farm_failed = 53,         ///< there is no scheduler, it refused the jobs, or tasks were lost
  checkpoint_refused = 54,  ///< --resume: the checkpoint is damaged, or of another bake

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
