// Checks first that there is memory for twice the file's bytes. Then another process reads a .vdb, and
// mesh::read() every other file.
#include "tools/mesh/verb_input.hpp"

#include <fmt/format.h>

#include <filesystem>

#include "formats/base/memory.hpp"
#include "formats/base/status.hpp"
#include "tools/common/naming.hpp"
#include "tools/mesh/vdb.hpp"

namespace nif::tools {

mesh::Scene read_mesh(const std::string& file, Progress& progress, const mesh::ReadLimits& limits) {
  std::error_code unknown;  // for a pipe or a missing file, the reader reports it
  const uint64_t bytes = std::filesystem::file_size(file, unknown);
  // The bytes of a file and the arrays made from them take about the same memory; compressed files need more.
  if (!unknown) require_memory(2 * bytes, file + ": reading it");
  progress.update(0, "reading " + shown_name(file));
  if (!limits.format.empty() || !is_vdb(file)) return mesh::read(file, limits);
  if (!limits.choice.empty()) throw Error(Status::usage, file + ": --only and --except are not for .vdb");
  if (limits.moment) throw Error(Status::usage, file + ": --clip is not for .vdb");
  return read_vdb(file);
}

uint64_t triangles_of(const mesh::Scene& scene) {
  uint64_t triangles = 0;
  for (const mesh::Mesh& mesh : scene.meshes) triangles += mesh.triangles.size();
  return triangles;
}

}  // namespace nif::tools
