// Another file may have the name of the checkpoint. So the first bytes of a file are checked before it is
// replaced or removed. Failing to write a checkpoint causes a note and never ends a bake.
#include "tools/bake/checkpoint_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <string>
#include <utility>

#include "formats/base/output_file.hpp"
#include "formats/mesh/file_bytes.hpp"

namespace nif::tools {
namespace {

constexpr uint64_t kMostCheckpointBytes = uint64_t{16} << 30;

bool is_checkpoint(const std::string& path) {
  std::error_code unknown;
  if (!std::filesystem::is_regular_file(path, unknown)) return false;
  std::string start(bake::kCheckpointMagic.size(), 0);
  return std::ifstream(path, std::ios::binary).read(start.data(), std::streamsize(start.size())) &&
         std::ranges::equal(start, bake::kCheckpointMagic);
}

}  // namespace

CheckpointFile::CheckpointFile(const std::string& asset, bake::BakeKey key,
                               std::function<void(const std::string&)> note)
    : path_(is_written_in_place(asset) ? "" : asset + ".checkpoint"),
      key_(std::move(key)),
      note_(std::move(note)) {}

std::vector<bake::KeptTraining> CheckpointFile::load(Resume resume) {
  std::error_code unknown;
  if (path_.empty()) return {};
  if (!std::filesystem::exists(path_, unknown)) {
    if (resume == Resume::required)
      note_(path_ + ": there is no such checkpoint, so the bake starts from the beginning");
    return {};
  }
  if (resume == Resume::never) {
    note_(path_ + ": an unfinished bake left this checkpoint, which is not used; --resume continues from it");
    return {};
  }
  try {
    const mesh::detail::ByteBuffer file = mesh::detail::load_named_file(path_, kMostCheckpointBytes);
    return bake::decode_checkpoint(std::as_bytes(std::span(file.view())), key_);
  } catch (const Error& error) {
    const std::string sentence = error.status() == Status::checkpoint_refused
                                     ? fmt::format("{}: {}", path_, error.what())
                                     : error.what();
    if (resume == Resume::required)
      throw Error(Status::checkpoint_refused,
                  sentence + "; without --resume, the bake starts from the beginning");
    note_(sentence + ", so the bake starts from the beginning");
    return {};
  }
}

void CheckpointFile::save(std::span<const bake::KeptTraining> trainings) {
  try {
    std::error_code unknown;
    if (std::filesystem::exists(path_, unknown) && !is_checkpoint(path_))
      throw Error(Status::output_not_writable, path_ + ": is not a checkpoint, so it is not replaced");
    write_output(path_, bake::encode_checkpoint(key_, trainings));
  } catch (const Error& error) {
    if (!std::exchange(failed_, true))
      note_(fmt::format("{}; the bake continues, but cannot be resumed from here", error.what()));
  }
}

void CheckpointFile::remove() const {
  std::error_code ignored;
  if (!path_.empty() && is_checkpoint(path_)) std::filesystem::remove(path_, ignored);
}

}  // namespace nif::tools
