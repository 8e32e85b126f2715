// Uses plain system calls, so that rays from a pipe are answered as they arrive: read() returns what is
// available. peek() looks ahead to tell formats apart without losing bytes.
#include "tools/query/input_stream.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>

#include "formats/base/status.hpp"

namespace nif::tools {
namespace {

[[noreturn]] void unreadable(const std::string& name, int error) {
  if (error == ENOENT || error == ENOTDIR)
    throw Error(Status::file_not_found, name + ": there is no such file");
  throw Error(Status::file_unreadable,
              name + ": cannot be read: " + (error == EISDIR ? "it is a folder" : std::strerror(error)));
}

/// Calls read() or pread() until `to` is full or the end is reached.
template <class Read>
size_t fill(std::span<std::byte> to, const std::string& name, Read read) {
  size_t done = 0;
  while (done < to.size()) {
    const ssize_t count = read(to.data() + done, to.size() - done, done);
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) unreadable(name, errno);
    if (count == 0) break;
    done += size_t(count);
  }
  return done;
}

}  // namespace

TemporaryFile::TemporaryFile() {
  std::error_code error;
  const std::filesystem::path folder = std::filesystem::temp_directory_path(error);
  folder_ = error ? "/tmp" : folder.string();
  std::string path = folder_ + "/nif-query-XXXXXX";
  fd_ = ::mkostemp(path.data(), O_CLOEXEC);
  if (fd_ < 0)
    throw Error(Status::output_not_writable,
                folder_ + ": no temporary file can be made there: " + std::strerror(errno));
  ::unlink(path.c_str());
}

TemporaryFile::~TemporaryFile() { ::close(fd_); }

void TemporaryFile::write(std::span<const std::byte> bytes) {
  size_ += bytes.size();
  while (!bytes.empty()) {
    const ssize_t done = ::write(fd_, bytes.data(), bytes.size());
    if (done < 0 && errno == EINTR) continue;
    if (done <= 0)
      throw Error(Status::output_not_writable,
                  folder_ + ": a temporary file cannot be written there: " + std::strerror(errno));
    bytes = bytes.subspan(size_t(done));
  }
}

void TemporaryFile::read_at(uint64_t offset, std::span<std::byte> to) const {
  const size_t done = fill(to, folder_, [&](std::byte* at, size_t count, size_t done) {
    return ::pread(fd_, at, count, off_t(offset + done));
  });
  if (done != to.size()) unreadable(folder_, EIO);
}

InputStream::InputStream(const std::string& path)
    : name_(path == "-" ? "standard input" : path),
      fd_(path == "-" ? ::dup(STDIN_FILENO) : ::open(path.c_str(), O_RDONLY | O_CLOEXEC)) {
  struct stat about {};
  if (fd_ < 0 || ::fstat(fd_, &about) != 0) unreadable(name_, errno);
  regular_ = S_ISREG(about.st_mode);
  if (!regular_) return;
  size_ = uint64_t(about.st_size);
  // standard input may already be partly read
  start_ = uint64_t(std::max<off_t>(::lseek(fd_, 0, SEEK_CUR), 0));
}

InputStream::~InputStream() { ::close(fd_); }

std::span<const std::byte> InputStream::peek(size_t count) {
  if (peeked_.size() < count) {
    const size_t before = peeked_.size();
    peeked_.resize(count);
    peeked_.resize(before + fill(std::span(peeked_).subspan(before), name_,
                                 [&](std::byte* at, size_t n, size_t) { return ::read(fd_, at, n); }));
  }
  return std::span(peeked_).first(std::min(count, peeked_.size()));
}

size_t InputStream::read(std::span<std::byte> to) {
  size_t done = std::min(to.size(), peeked_.size());
  std::copy_n(peeked_.begin(), done, to.begin());
  peeked_.erase(peeked_.begin(), peeked_.begin() + ptrdiff_t(done));
  while (done == 0 && !to.empty()) {
    const ssize_t count = ::read(fd_, to.data(), to.size());
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) unreadable(name_, errno);
    if (count == 0) return 0;
    done = size_t(count);
  }
  position_ += done;
  return done;
}

size_t InputStream::read_fully(std::span<std::byte> to) {
  size_t done = 0;
  while (done < to.size()) {
    const size_t count = read(to.subspan(done));
    if (count == 0) break;
    done += count;
  }
  return done;
}

bool InputStream::ready() const {
  if (!peeked_.empty()) return true;
  pollfd asked{fd_, POLLIN, 0};
  return ::poll(&asked, 1, 0) == 1;
}

std::optional<uint64_t> InputStream::rest() const {
  if (!regular_) return std::nullopt;
  const uint64_t at = start_ + position_;
  return size_ > at ? size_ - at : 0;
}

size_t InputStream::read_at(uint64_t offset, std::span<std::byte> to) const {
  return fill(to, name_, [&](std::byte* at, size_t count, size_t done) {
    return ::pread(fd_, at, count, off_t(start_ + position_ + offset + done));
  });
}

}  // namespace nif::tools
