// First finds what the format will lose, and reports it in notes. Then passes the scene to the writer of the
// format. All checks come before the file is started.
#include "formats/mesh/write.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <limits>

#include "formats/base/file_name.hpp"
#include "formats/mesh/draco_writer.hpp"
#include "formats/mesh/flat_scene.hpp"
#include "formats/mesh/gltf/gltf_writer.hpp"
#include "formats/mesh/ply_writer.hpp"
#include "formats/mesh/stream.hpp"
#include "formats/mesh/text_writers.hpp"
#include "formats/mesh/transform.hpp"

namespace nif::mesh {
namespace {

using detail::Stream;
namespace fs = std::filesystem;

/// Whether the instance is translated, but neither scaled nor rotated, like far meshes that readers move.
bool only_moved(const Instance& instance) {
  Transform rest = instance.transform;
  rest[3] = rest[7] = rest[11] = 0;
  return rest == kIdentity;
}

/// One note for each thing that a format cannot represent in a scene.
std::vector<std::string> losses(const std::string& path, FileKind kind, const Scene& scene,
                                const FlatScene& flat, const WriteOptions& options) {
  std::vector<std::string> notes;
  const auto note = [&](const std::string& text) { notes.push_back(path + ": " + text); };
  const bool objects = kind == FileKind::obj || (kind == FileKind::stl && options.text);
  const std::vector<Instance>& instances = scene.instances;
  if (instances.size() > 1 && !objects)
    note(fmt::format("the format holds one mesh: {} objects became one, and their names were left out",
                     instances.size()));
  if (instances.size() == 1 && !objects && kind != FileKind::drc &&
      instances[0].name != fs::path(path).stem())
    note(fmt::format("the format has no names: '{}' was left out", instances[0].name));
  if (objects) {
    const bool differ = std::ranges::any_of(
        instances, [&](const Instance& i) { return i.name != scene.meshes[i.mesh].name; });
    if (differ)
      note("the format has one name per object: names of nodes were kept, names of meshes were left out");
    const auto lost = uint64_t(std::ranges::count_if(instances, [&](const Instance& i) {
      return i.name.empty() || (kind == FileKind::obj && detail::ends_in_backslash(i.name));
    }));
    if (lost != 0)
      note(fmt::format("{} names are empty or end in a backslash, which the format cannot hold", lost));
  }
  const bool only_floats = kind == FileKind::drc || (kind == FileKind::stl && !options.text);
  bool placed = false, in_doubles = false;
  for (size_t i = 0; i < instances.size(); ++i) {
    const bool written_wide = flat.far(i) && !only_floats;
    (written_wide ? in_doubles : placed) |=
        !unplaced(instances[i]) && !(written_wide && only_moved(instances[i]));
  }
  if (placed || in_doubles)
    note(fmt::format("the format has no transforms: objects were written at their positions{}",
                     placed ? ", rounded to floats" : ""));
  const double rounded = only_floats ? flat.rounding() : 0;
  if (rounded > 0)
    note(
        fmt::format("the format has floats only: positions were rounded by up to {:.3g}, which is much for "
                    "the size of their objects; .obj, .ply and .glb keep them",
                    rounded));
  if (instances.size() > scene.meshes.size())
    note(fmt::format("the format has no instances: {} meshes were written {} times in total",
                     scene.meshes.size(), instances.size()));
  if (!scene.cameras.empty() || !scene.lights.empty())
    note(fmt::format("the format has no cameras or lights: {} and {} were left out", scene.cameras.size(),
                     scene.lights.size()));
  if (kind == FileKind::stl)
    note(
        "STL has no shared vertices: each triangle was written with its own three; nif merges equal ones "
        "when it reads the file");
  return notes;
}

std::string rounding(const std::string& path, uint32_t bits) {
  return fmt::format(
      "{}: Draco rounded positions to {} bits along the longest side of each mesh, and reordered vertices "
      "and triangles; with 0 bits it keeps both",
      path, bits);
}

Mesh only_mesh(const Scene& scene) {
  const bool as_it_is = scene.instances.size() == 1 && unplaced(scene.instances[0]);
  if (!as_it_is) return flatten(scene, scene.instances.size() == 1 ? scene.instances[0].name : "");
  Mesh mesh = scene.meshes[scene.instances[0].mesh];
  mesh.name = scene.instances[0].name;
  return mesh;
}

uint64_t write_stream(const std::string& path, FileKind kind, const Scene& scene, const FlatScene& flat,
                      const WriteOptions& options, const std::function<void(double)>& progress,
                      const std::atomic<bool>& cancel) {
  if (kind == FileKind::ply) return write_ply(path, flat, "nifkit", progress, cancel).bytes;
  if (kind == FileKind::stl && flat.triangle_count() > std::numeric_limits<uint32_t>::max())
    throw Error(Status::too_large, fmt::format("{}: {} triangles are more than an STL file can hold", path,
                                               flat.triangle_count()));
  const uint64_t vertices = kind == FileKind::stl ? 0 : flat.vertex_count();
  Stream out(path, vertices + flat.triangle_count(), progress, cancel);
  if (kind == FileKind::obj) detail::write_obj(out, scene, flat);
  if (kind == FileKind::off) detail::write_off(out, flat);
  if (kind == FileKind::stl && options.text) detail::write_stl_text(out, scene, flat);
  if (kind == FileKind::stl && !options.text) detail::write_stl(out, flat);
  return out.commit();
}

}  // namespace

std::optional<FileKind> known_file_kind(const std::string& path) {
  const std::string ending = ending_of(path);
  constexpr std::array<std::pair<const char*, FileKind>, 6> kKinds{{{".obj", FileKind::obj},
                                                                    {".ply", FileKind::ply},
                                                                    {".stl", FileKind::stl},
                                                                    {".off", FileKind::off},
                                                                    {".glb", FileKind::glb},
                                                                    {".drc", FileKind::drc}}};
  for (const auto& [name, kind] : kKinds)
    if (ending == name) return kind;
  return std::nullopt;
}

FileKind file_kind(const std::string& path) {
  if (const std::optional<FileKind> kind = known_file_kind(path)) return *kind;
  throw Error(
      Status::usage,
      fmt::format("{}: is not the name of a mesh file; it must end in .obj, .ply, .stl, .off, .glb or .drc{}",
                  path, ending_of(path) == ".vdb" ? "; nif mesh voxelize writes .vdb" : ""));
}

void check_options(FileKind kind, const WriteOptions& options) {
  if (options.text && kind != FileKind::stl)
    throw Error(Status::usage, "--text is only for .stl: the other formats are always text or always binary");
  if (options.draco && kind != FileKind::glb) throw Error(Status::usage, "--draco is for .glb");
  if (options.paint != nullptr && (kind != FileKind::glb || options.draco))
    throw Error(Status::usage, "only .glb without Draco can have materials");
  if (options.draco_bits && kind != FileKind::drc && !options.draco)
    throw Error(Status::usage, "--draco-bits is for .drc, and for .glb with --draco");
}

Written write(const std::string& path, const Scene& scene, const WriteOptions& options,
              const std::function<void(double)>& progress, const std::atomic<bool>& cancel) {
  const FileKind kind = file_kind(path);
  check_options(kind, options);
  if (scene.instances.empty())
    throw Error(Status::no_triangles, "places nothing, so there is nothing to write");
  Written written;
  std::optional<FlatScene> flat;
  if (kind != FileKind::glb) {
    flat.emplace(scene).find_far();
    written.notes = losses(path, kind, scene, *flat, options);
  }
  const uint32_t bits = options.draco_bits.value_or(kDracoBits);
  if ((kind == FileKind::drc || options.draco) && bits != 0) written.notes.push_back(rounding(path, bits));
  if (kind != FileKind::glb && kind != FileKind::drc) {
    written.bytes = write_stream(path, kind, scene, *flat, options, progress, cancel);
    return written;
  }
  // All checks come before the file is started.
  std::optional<OutputFile> file;
  const auto sink = [&](std::span<const std::byte> piece) {
    if (cancel) throw Error(Status::interrupted, path + ": the writing was cancelled");
    if (!file) file.emplace(path);
    file->write(piece);
    written.bytes += piece.size();
  };
  if (kind == FileKind::drc) {
    const Mesh mesh = only_mesh(scene);
    sink(encode_draco(mesh, bits, mesh.name).bytes);
  } else {
    write_glb(scene, options.draco ? std::optional(bits) : std::nullopt, sink, options.paint);
  }
  file->commit();
  return written;
}

}  // namespace nif::mesh
