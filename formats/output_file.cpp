// Temporary, flush, close, rename; each of these can fail (a full disk shows at the flush or the close).
#include "formats/output_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>

#include "formats/status.hpp"

namespace nif {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void not_writable(const std::string& path, const std::string& why) {
  throw Error(Status::output_not_writable, path + ": cannot be written: " + why);
}

/// Where the bytes really go: a link is followed, so that it stays a link. Throws where there is no folder.
fs::path resolve(const std::string& path) {
  std::error_code error;
  fs::path target = fs::weakly_canonical(fs::path(path), error);
  if (error) target = path;
  if (path.empty() || !target.has_filename() || path.back() == '/') not_writable(path, "it names no file");
  const fs::path folder = target.has_parent_path() ? target.parent_path() : fs::path(".");
  const fs::file_status status = fs::status(folder, error);
  if (status.type() == fs::file_type::not_found)
    throw Error(Status::output_folder_missing, path + ": the folder " + folder.string() + " does not exist");
  if (status.type() != fs::file_type::directory) not_writable(path, folder.string() + " is no folder");
  return target;
}

/// Is there something at the target that is written to as it stands, because it is no file?
bool is_stream(const fs::path& target, const std::string& path) {
  struct stat about;
  if (::stat(target.c_str(), &about) != 0) return false;
  if (S_ISDIR(about.st_mode)) not_writable(path, "it is a folder");
  if (::access(target.c_str(), W_OK) != 0) not_writable(path, std::strerror(errno));
  return !S_ISREG(about.st_mode);
}

/// A file being written; removed at the end of the scope unless it was moved into place.
class Temporary {
 public:
  Temporary(const fs::path& target, const std::string& path) : path_(path) {
    for (int attempt = 0; fd_ < 0; ++attempt) {
      name_ = target.string() + ".tmp-" + std::to_string(::getpid()) + "-" + std::to_string(attempt);
      fd_ = ::open(name_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
      if (fd_ < 0 && (errno != EEXIST || attempt == 1000)) {
        const int reason = errno;
        name_.clear();
        not_writable(path, std::strerror(reason));
      }
    }
  }
  Temporary(const Temporary&) = delete;
  Temporary& operator=(const Temporary&) = delete;
  ~Temporary() {
    if (fd_ >= 0) ::close(fd_);
    if (!name_.empty()) ::unlink(name_.c_str());
  }

  int descriptor() const { return fd_; }

  void move_to(const fs::path& target) {
    if (::fsync(fd_) != 0) not_writable(path_, std::strerror(errno));
    if (::close(std::exchange(fd_, -1)) != 0) not_writable(path_, std::strerror(errno));
    if (::rename(name_.c_str(), target.c_str()) != 0) not_writable(path_, std::strerror(errno));
    name_.clear();
  }

 private:
  std::string path_, name_;
  int fd_ = -1;
};

void write_all(int fd, std::span<const std::byte> bytes, const std::string& path) {
  while (!bytes.empty()) {
    const ssize_t done = ::write(fd, bytes.data(), bytes.size());
    if (done < 0 && errno == EINTR) continue;
    if (done < 0) not_writable(path, std::strerror(errno));
    bytes = bytes.subspan(size_t(done));
  }
}

}  // namespace

void check_output(const std::string& path) {
  const fs::path target = resolve(path);
  if (!is_stream(target, path)) Temporary{target, path};
}

void write_output(const std::string& path, std::span<const std::byte> bytes) {
  const fs::path target = resolve(path);
  if (is_stream(target, path)) {
    const int fd = ::open(target.c_str(), O_WRONLY | O_CLOEXEC);
    if (fd < 0) not_writable(path, std::strerror(errno));
    try {
      write_all(fd, bytes, path);
    } catch (...) {
      ::close(fd);
      throw;
    }
    if (::close(fd) != 0) not_writable(path, std::strerror(errno));
    return;
  }
  Temporary temporary(target, path);
  write_all(temporary.descriptor(), bytes, path);
  temporary.move_to(target);
}

}  // namespace nif
