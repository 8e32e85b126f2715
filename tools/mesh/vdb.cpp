// Both sides of a small protocol. A hidden verb reads the file with OpenVDB, under a memory limit, and prints
// meshes as raw bytes. The caller reads these, and turns a crash into an error.
#include "tools/mesh/vdb.hpp"

#include <fmt/format.h>
#include <sys/resource.h>

#include <chrono>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <memory>
#include <new>
#include <thread>
#include <type_traits>

#include "formats/base/memory.hpp"
#include "formats/base/status.hpp"
#include "formats/mesh/read.hpp"
#include "mesh/volume/volume.hpp"
#include "tools/common/child.hpp"
#include "tools/common/interruption.hpp"
#include "tools/common/options.hpp"

namespace nif::tools {
namespace {

constexpr const char* kVerb = "read-vdb";

// The format of the pipe: the number of meshes; the name, positions and triangles of each, preceded by their
// counts; and the notes likewise.

template <class T>
void say(const std::vector<T>& values) {
  const uint64_t count = values.size();
  std::fwrite(&count, sizeof(count), 1, stdout);
  std::fwrite(values.data(), sizeof(T), values.size(), stdout);
}
void say(const std::string& text) { say(std::vector<char>(text.begin(), text.end())); }
void say(uint64_t number) { std::fwrite(&number, sizeof(number), 1, stdout); }

class Listener {
 public:
  Listener(std::string_view bytes, const std::string& file) : bytes_(bytes), file_(file) {}

  uint64_t number() {
    uint64_t value = 0;
    take(&value, sizeof(value));
    return value;
  }
  template <class T>
  std::vector<T> list() {
    static_assert(std::is_trivially_copyable_v<T>);
    const uint64_t count = number();
    if (count > bytes_.size() / sizeof(T)) fail();
    std::vector<T> values(count);
    take(values.data(), count * sizeof(T));
    return values;
  }
  std::string text() {
    const std::vector<char> letters = list<char>();
    return {letters.begin(), letters.end()};
  }

 private:
  [[noreturn]] void fail() const {
    throw Error(Status::malformed_mesh, file_ + ": OpenVDB did not read the whole file");
  }
  void take(void* to, size_t count) {
    if (count > bytes_.size()) fail();
    if (count) std::memcpy(to, bytes_.data(), count);
    bytes_.remove_prefix(count);
  }

  std::string_view bytes_;
  const std::string& file_;
};

/// Above the limit, allocations fail. Without it, the machine would run out of memory.
void limit_memory() {
#ifndef NIF_SANITIZED  // the sanitizers' own maps are larger
  rlimit limit{};
  const uint64_t bytes = available_memory();
  if (getrlimit(RLIMIT_AS, &limit) != 0 || bytes >= limit.rlim_cur) return;
  limit.rlim_cur = bytes;
  setrlimit(RLIMIT_AS, &limit);
#endif
}

void read_for_another(const std::string& file) {
  limit_memory();
  const volume::LevelSets found = [&] {
    try {
      return volume::read_vdb(file);
    } catch (const std::bad_alloc&) {
      throw Error(Status::too_large, file + ": needs more memory than there is");
    }
  }();
  say(found.meshes.size());
  for (const mesh::Mesh& mesh : found.meshes) say(mesh.name), say(mesh.positions), say(mesh.triangles);
  say(found.notes.size());
  for (const std::string& note : found.notes) say(note);
}

/// The error message of the other process, without the program's name.
std::string sentence_of(const std::string& error) {
  constexpr std::string_view kProgram = "nif: ";
  std::string sentence = error.substr(0, error.find('\n'));
  return sentence.starts_with(kProgram) ? sentence.substr(kProgram.size()) : sentence;
}

}  // namespace

bool is_vdb(const std::string& file) {
  std::string start(mesh::kVdbMagic.size(), 0);
  std::error_code unknown;
  return std::filesystem::is_regular_file(file, unknown) &&
         std::ifstream(file, std::ios::binary).read(start.data(), std::streamsize(start.size())) &&
         start == mesh::kVdbMagic;
}

mesh::Scene read_vdb(const std::string& file) {
  Child child({"mesh", kVerb, file});
  const std::atomic<bool>& cancel = interruption();
  std::optional<int> code;
  while (!(code = child.ended())) {
    if (cancel) throw Error(Status::interrupted, "interrupted; nothing was written");
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  if (*code > 128)
    throw Error(Status::malformed_mesh,
                fmt::format("{}: OpenVDB cannot read it (it crashed with signal {})", file, *code - 128));
  if (*code != 0) throw Error(Status(*code), sentence_of(child.err()));

  const std::string told = child.out();
  Listener listener(told, file);
  mesh::Scene scene;
  for (uint64_t meshes = listener.number(); meshes > 0; --meshes) {
    mesh::Mesh mesh{listener.text(), listener.list<mesh::Float3>(), listener.list<mesh::Triangle>()};
    if (mesh.triangles.empty()) continue;
    if (mesh.name.empty()) mesh.name = std::filesystem::path(file).stem().string();
    scene.instances.push_back({mesh.name, uint32_t(scene.meshes.size()), mesh::kIdentity});
    scene.meshes.push_back(std::move(mesh));
  }
  for (uint64_t notes = listener.number(); notes > 0; --notes)
    scene.notes.push_back({mesh::NoteKind::volumes, listener.text()});
  scene.files.push_back(file);
  mesh::check(file, scene);
  return scene;
}

void add_mesh_read_vdb(Command mesh) {
  const Command command = mesh.add_subcommand(kVerb, "For internal use");
  command.hide();
  const auto file = std::make_shared<std::string>();
  command.add_option("FILE", *file).required();
  command.callback([file] { read_for_another(*file); });
}

}  // namespace nif::tools
