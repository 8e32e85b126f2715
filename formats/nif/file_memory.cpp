// Opening asset files, through POSIX calls: they tell why a file cannot be opened, which streams do not.
#include "formats/nif/file_memory.hpp"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "formats/nif/container.hpp"

namespace nif::format {
namespace {

/// An open file, closed at the end of the scope.
class Descriptor {
 public:
  explicit Descriptor(int fd) : fd_(fd) {}
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  ~Descriptor() {
    if (fd_ >= 0) ::close(fd_);
  }
  int get() const { return fd_; }

 private:
  int fd_;
};

[[noreturn]] void unreadable(const std::string& path, const std::string& why) {
  throw Error(Status::file_unreadable, path + ": cannot be read: " + why);
}

/// Reads up to `count` bytes at `offset`; fewer only at the end of the file.
size_t read_at(int fd, std::byte* to, size_t count, size_t offset, const std::string& path) {
  size_t done = 0;
  while (done < count) {
    const ssize_t got = ::pread(fd, to + done, count - done, off_t(offset + done));
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) unreadable(path, std::strerror(errno));
    if (got == 0) break;
    done += size_t(got);
  }
  return done;
}

}  // namespace

FileMemory FileMemory::load(const std::string& path, Mode mode, std::pmr::memory_resource* memory) {
  // Not blocking: opening a FIFO that nobody writes to would wait for ever.
  const Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  if (file.get() < 0) {
    if (errno == ENOENT || errno == ENOTDIR)
      throw Error(Status::file_not_found, path + ": there is no such file");
    unreadable(path, std::strerror(errno));
  }
  struct stat about;
  if (::fstat(file.get(), &about) != 0) unreadable(path, std::strerror(errno));
  if (S_ISDIR(about.st_mode)) unreadable(path, "it is a folder");
  if (!S_ISREG(about.st_mode)) unreadable(path, "it is not a regular file");

  const auto size = size_t(about.st_size);
  std::byte start[sizeof(Header)];
  const size_t started = read_at(file.get(), start, sizeof(start), 0, path);
  check_header({start, started}, size, path);

  if (mode == Mode::map) {
    void* at = ::mmap(nullptr, size, PROT_READ, MAP_PRIVATE, file.get(), 0);
    if (at == MAP_FAILED) unreadable(path, std::string("it cannot be mapped: ") + std::strerror(errno));
    return {Kind::mapped, {static_cast<const std::byte*>(at), size}, memory};
  }
  FileMemory result(Kind::owned, {static_cast<std::byte*>(memory->allocate(size, kAlignment)), size}, memory);
  auto* to = const_cast<std::byte*>(result.bytes_.data());
  if (read_at(file.get(), to, size, 0, path) != size) unreadable(path, "it shrank while it was read");
  return result;
}

FileMemory FileMemory::copy(std::span<const std::byte> bytes, std::pmr::memory_resource* memory) {
  if (bytes.empty()) return borrow(bytes);
  auto* to = static_cast<std::byte*>(memory->allocate(bytes.size(), kAlignment));
  std::memcpy(to, bytes.data(), bytes.size());
  return {Kind::owned, {to, bytes.size()}, memory};
}

FileMemory FileMemory::borrow(std::span<const std::byte> bytes) { return {Kind::borrowed, bytes, nullptr}; }

FileMemory::~FileMemory() {
  auto* at = const_cast<std::byte*>(bytes_.data());
  if (kind_ == Kind::owned) memory_->deallocate(at, bytes_.size(), kAlignment);
  if (kind_ == Kind::mapped) ::munmap(at, bytes_.size());
}

}  // namespace nif::format
