// InputFile with POSIX calls. Beware: opening a FIFO would wait for a writer, signals interrupt reads, and a
// folder opens like a file.
#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "formats/base/status.hpp"
#include "formats/nif/input_file.hpp"

namespace nif::format {
namespace {

[[noreturn]] void unreadable(const std::string& path, const std::string& why) {
  throw Error(Status::file_unreadable, path + ": cannot be read: " + why);
}

/// Its size. Throws if it is not a file.
uint64_t size_of(int fd, const std::string& path) {
  struct stat about;
  if (::fstat(fd, &about) != 0) unreadable(path, std::strerror(errno));
  if (S_ISDIR(about.st_mode)) unreadable(path, "it is a folder");
  if (!S_ISREG(about.st_mode)) unreadable(path, "it is not a regular file");
  return uint64_t(about.st_size);
}

}  // namespace

InputFile::InputFile(const std::string& path) : path_(path) {
  // Non-blocking: opening a FIFO that nobody writes to would wait forever.
  const int fd = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (fd < 0) {
    if (errno == ENOENT || errno == ENOTDIR)
      throw Error(Status::file_not_found, path + ": there is no such file");
    unreadable(path, std::strerror(errno));
  }
  handle_ = fd;
  try {
    size_ = size_of(fd, path);
  } catch (...) {
    ::close(fd);
    throw;
  }
}

InputFile::~InputFile() { ::close(int(handle_)); }

size_t InputFile::read_at(std::byte* to, size_t count, uint64_t offset) const {
  size_t done = 0;
  while (done < count) {
    const ssize_t got = ::pread(int(handle_), to + done, count - done, off_t(offset + done));
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) unreadable(path_, std::strerror(errno));
    if (got == 0) break;
    done += size_t(got);
  }
  return done;
}

std::span<const std::byte> InputFile::map() const {
  void* at = ::mmap(nullptr, size_t(size_), PROT_READ, MAP_PRIVATE, int(handle_), 0);
  if (at == MAP_FAILED) unreadable(path_, std::string("it cannot be mapped: ") + std::strerror(errno));
  return {static_cast<const std::byte*>(at), size_t(size_)};
}

void InputFile::unmap(std::span<const std::byte> bytes) {
  ::munmap(const_cast<std::byte*>(bytes.data()), bytes.size());
}

}  // namespace nif::format
