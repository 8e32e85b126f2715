// The steps for every file: load, unpack, recognise the format, read, check, hash.
#include "formats/mesh/read.hpp"

#include <fmt/format.h>

#define XXH_INLINE_ALL
#include <xxhash.h>

#include <algorithm>
#include <array>
#include <memory>

#include "formats/mesh/decompress.hpp"
#include "formats/mesh/gltf/attach.hpp"
#include "formats/mesh/readers.hpp"
#include "formats/mesh/text_cursor.hpp"
#include "formats/mesh/whole_file.hpp"

namespace nif::mesh {
namespace {

using namespace detail;

/// Refuses files that are unmistakably something else than a mesh.
void refuse_strangers(const Input& input) {
  if (input.bytes.empty()) input.fail(Status::file_empty, "is empty");
  if (input.bytes.starts_with("\xAB"
                              "NIF")) {
    input.fail(Status::not_a_mesh, "is a baked nifkit asset, not the mesh that it was baked from");
  }
  if (input.bytes.starts_with("NetImmerse File Format") || input.bytes.starts_with("Gamebryo File Format")) {
    input.fail(Status::foreign_nif,
               "is a NetImmerse/Gamebryo model, which only shares the extension .nif; convert it to PLY, "
               "OBJ, STL, OFF, glTF or Draco first");
  }
  if (input.bytes.starts_with(kVdbMagic))
    input.fail(Status::not_a_mesh, "is an OpenVDB volume; convert it to a mesh with nif mesh convert");
}

bool is_off_keyword(std::string_view word) {
  static constexpr std::array kKeywords{"OFF",   "COFF",   "NOFF",   "CNOFF",
                                        "STOFF", "STCOFF", "STNOFF", "STCNOFF"};
  return std::ranges::find(kKeywords, word) != kKeywords.end();
}

bool looks_like_gltf(std::string_view bytes) {
  return bytes.starts_with("glTF") || TextCursor(bytes.substr(0, 64)).word().starts_with('{');
}

Scene read_as(const std::string& format, const Input& input, std::vector<ExternalFile>& external) {
  if (format == "gltf" || format == "glb") return read_gltf(input, external);
  if (format == "drc") return read_draco(input);
  if (format == "ply") return read_ply(input);
  if (format == "off") return read_off(input);
  if (format == "obj") return read_obj(input);
  if (format == "stl") return read_stl(input);
  throw Error(Status::usage, fmt::format("there is no mesh format '{}'", format));
}

Scene read_format(const Input& input, std::vector<ExternalFile>& external) {
  if (!input.limits.format.empty()) return read_as(input.limits.format, input, external);
  const std::string_view bytes = input.bytes;
  if (looks_like_gltf(bytes)) return read_gltf(input, external);
  const std::string_view first_word = TextCursor(bytes.substr(0, 64)).word();
  if (bytes.starts_with("DRACO")) return read_draco(input);
  if (first_word == "ply" || first_word == "PLY") return read_ply(input);
  if (is_off_keyword(first_word)) return read_off(input);
  if (input.extension == ".obj") return read_obj(input);
  if (looks_like_stl(bytes)) return read_stl(input);

  if (input.extension == ".ply") return read_ply(input);
  if (input.extension == ".off") return read_off(input);
  if (input.extension == ".stl") return read_stl(input);
  if (input.extension == ".gltf" || input.extension == ".glb" || input.extension == ".drc") {
    input.fail(Status::not_a_mesh,
               fmt::format("is named {}, but its content is in another format", input.extension));
  }
  if (input.file == kStandardInputName)
    input.fail(Status::not_a_mesh,
               "does not reveal its format by its content; name it with --format (OBJ always needs that)");
  input.fail(Status::not_a_mesh,
             "is not in a known mesh format; nif reads PLY, OBJ, STL, OFF, glTF, GLB and Draco, also as .gz "
             "or .zst");
}

Scene read_checked(const std::filesystem::path& file, std::string_view bytes, const ReadLimits& limits) {
  Input input = describe(file, bytes, limits);
  refuse_strangers(input);
  skip_byte_order_mark(input);
  std::vector<ExternalFile> external;
  Scene scene = read_format(input, external);
  if (limits.moment && !looks_like_gltf(input.bytes))
    input.fail(Status::usage, "has no clips: only glTF has animations");
  check(input, scene);
  scene.source_hash = source_hash(input, bytes, external);
  scene.choice = limits.choice;
  scene.alpha = limits.alpha;
  std::vector<std::string> files;
  if (file != kStandardInput) files.push_back(file.string());
  for (const ExternalFile& buffer : external) files.push_back(buffer.path.string());
  scene.files.insert(scene.files.begin(), files.begin(), files.end());  // before pictures
  return scene;
}

}  // namespace

namespace detail {

ByteBuffer load_unpacked(const std::filesystem::path& file, const ReadLimits& limits) {
  const bool standard = file == kStandardInput;
  const std::filesystem::path name = standard ? kStandardInputName : file;
  ByteBuffer bytes = standard ? load_standard_input(limits.max_decompressed_bytes)
                              : load_file(file, limits.max_decompressed_bytes);
  return decompress(std::move(bytes), name, limits);
}

Input describe(const std::filesystem::path& file, std::string_view bytes, const ReadLimits& limits) {
  if (file == kStandardInput) return {kStandardInputName, "stdin", "", bytes, limits};
  const std::filesystem::path name = unpacked_name(file);
  return {file, name.stem().string(), ending_of(name), bytes, limits};
}

void skip_byte_order_mark(Input& input) {
  if (input.bytes.starts_with("\xEF\xBB\xBF")) input.bytes.remove_prefix(3);
}

bool is_gltf(const Input& input) {
  const std::string& format = input.limits.format;
  return format.empty() ? looks_like_gltf(input.bytes) : format == "gltf" || format == "glb";
}

uint64_t source_hash(const Input& input, std::string_view bytes, const std::vector<ExternalFile>& external) {
  FilePieces main;
  if (looks_like_gltf(input.bytes))
    main = without_attachment(input.file, bytes);
  else
    main.refer(bytes);
  const std::unique_ptr<XXH3_state_t, XXH_errorcode (*)(XXH3_state_t*)> state(XXH3_createState(),
                                                                              &XXH3_freeState);
  if (!state) throw std::bad_alloc();
  XXH3_64bits_reset(state.get());
  for (const std::string_view piece : main.pieces())
    XXH3_64bits_update(state.get(), piece.data(), piece.size());
  for (const ExternalFile& file : external)
    XXH3_64bits_update(state.get(), file.bytes.data(), file.bytes.size());
  return XXH3_64bits_digest(state.get());
}

}  // namespace detail

Scene read(const std::filesystem::path& file, const ReadLimits& limits) {
  return promised(file, [&] {
    const ByteBuffer bytes = load_unpacked(file, limits);
    return read_checked(file, bytes.view(), limits);
  });
}

Scene read(const std::filesystem::path& file, std::string_view bytes, const ReadLimits& limits) {
  return promised(file, [&] { return read_checked(file, bytes, limits); });
}

void check(const std::filesystem::path& file, Scene& scene, const ReadLimits& limits) {
  detail::check(Input{file, {}, {}, {}, limits}, scene);
}

}  // namespace nif::mesh
