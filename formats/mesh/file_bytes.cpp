// Reads a whole file, and clearly refuses everything that is not a readable file.
#include "formats/mesh/file_bytes.hpp"

#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <memory>
#include <new>
#include <system_error>

namespace nif::mesh::detail {
namespace fs = std::filesystem;

void ByteBuffer::reserve(size_t capacity) {
  if (capacity <= capacity_) return;
  void* grown = std::realloc(data_, capacity);
  if (grown == nullptr) throw std::bad_alloc();
  data_ = static_cast<char*>(grown);
  capacity_ = capacity;
}

void ByteBuffer::shrink() {
  if (size_ == 0 || size_ == capacity_) return;
  if (void* smaller = std::realloc(data_, size_)) {
    data_ = static_cast<char*>(smaller);
    capacity_ = size_;
  }
}

namespace {

/// Shows whether somebody writes to a file: its length, and the time of the last write.
struct Condition {
  off_t size = 0;
  timespec written{};

  explicit Condition(std::FILE* stream) {
    struct stat status {};
    if (fstat(fileno(stream), &status) == 0) size = status.st_size, written = status.st_mtim;
  }
  bool operator==(const Condition& other) const {
    return size == other.size && written.tv_sec == other.written.tv_sec &&
           written.tv_nsec == other.written.tv_nsec;
  }
};

/// Reads to the end. `size`: the expected size; with `exact`, also the maximum.
ByteBuffer drain(std::FILE* stream, const std::string& name, uint64_t size, bool exact, uint64_t max_bytes) {
  ByteBuffer bytes;
  bytes.reserve(size + 1);  // one more, so that the end of the file is detected without growing
  for (;;) {
    if (bytes.size() == bytes.capacity()) bytes.reserve(std::max<size_t>(1 << 16, bytes.capacity() * 2));
    const size_t got = std::fread(bytes.data() + bytes.size(), 1, bytes.capacity() - bytes.size(), stream);
    bytes.set_size(bytes.size() + got);
    if (exact && bytes.size() > size)
      throw Error(Status::file_unreadable,
                  fmt::format("{}: has more than its length of {} bytes", name, size));
    if (bytes.size() > max_bytes) {
      throw Error(Status::too_large, fmt::format("{}: has more than the limit of {} bytes", name, max_bytes));
    }
    if (got == 0) break;
  }
  if (std::ferror(stream)) {
    throw Error(Status::file_unreadable, name + ": cannot be read: " + std::strerror(errno));
  }
  return bytes;
}

ByteBuffer load_whole(const fs::path& file, uint64_t max_bytes, bool named) {
  const std::string name = file.string();
  std::error_code error;
  const fs::file_status status = fs::status(file, error);
  if (status.type() == fs::file_type::not_found) {
    throw Error(Status::file_not_found, name + ": there is no such file");
  }
  if (status.type() == fs::file_type::directory) {
    throw Error(Status::file_unreadable, name + ": is a folder, not a file");
  }
  // A device such as /dev/zero never ends; a pipe does.
  if (status.type() != fs::file_type::regular && (named || status.type() != fs::file_type::fifo)) {
    const std::string why = error   ? error.message()
                            : named ? "is not a file"
                                    : "is neither a file nor a pipe";
    throw Error(Status::file_unreadable, name + ": " + why);
  }

  std::unique_ptr<std::FILE, int (*)(std::FILE*)> stream(std::fopen(name.c_str(), "rb"), &std::fclose);
  if (!stream && errno == ENOMEM) throw std::bad_alloc();
  if (!stream) throw Error(Status::file_unreadable, name + ": cannot be opened: " + std::strerror(errno));

  const Condition before(stream.get());
  const uint64_t size = status.type() == fs::file_type::regular ? fs::file_size(file, error) : 0;
  if (!error && size > max_bytes) {
    throw Error(Status::too_large,
                fmt::format("{}: has {} bytes, more than the limit of {}", name, size, max_bytes));
  }
  ByteBuffer bytes = drain(stream.get(), name, size, named, max_bytes);
  if (status.type() == fs::file_type::regular && Condition(stream.get()) != before)
    throw Error(Status::file_unreadable, name + ": changed while it was read; try again once it is complete");
  return bytes;
}

}  // namespace

ByteBuffer load_file(const fs::path& file, uint64_t max_bytes) { return load_whole(file, max_bytes, false); }
ByteBuffer load_named_file(const fs::path& file, uint64_t max_bytes) {
  return load_whole(file, max_bytes, true);
}

ByteBuffer load_standard_input(uint64_t max_bytes) {
  if (isatty(STDIN_FILENO))
    throw Error(Status::file_unreadable,
                std::string(kStandardInputName) + ": is a terminal; pipe a file into it");
  return drain(stdin, kStandardInputName, 0, false, max_bytes);
}

}  // namespace nif::mesh::detail
