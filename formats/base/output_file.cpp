// Writes a temporary, flushes, closes and renames it; each step can fail (a full disk shows at the flush or
// the close).
#include "formats/base/output_file.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/random.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <utility>

#include "formats/base/folder.hpp"
#include "formats/base/status.hpp"
#include "formats/base/temporaries.hpp"

namespace nif {
namespace {

namespace fs = std::filesystem;

/// The name of a temporary file is the target's name, this, and eight hexadecimal digits.
constexpr std::string_view kTemporary = ".tmp-";
constexpr size_t kDigits = 8;

[[noreturn]] void not_writable(const std::string& path, const std::string& why) {
  throw Error(Status::output_not_writable, path + ": cannot be written: " + why);
}

/// Whether the path is not a regular file and is therefore written in place.
bool is_stream(const std::string& path) {
  struct stat about;
  if (::stat(path.c_str(), &about) != 0 || S_ISREG(about.st_mode) || S_ISDIR(about.st_mode)) return false;
  if (::access(path.c_str(), W_OK) != 0) not_writable(path, std::strerror(errno));
  return true;
}

/// The file that is really written: links are followed, so that they stay links. Throws if there is no such
/// folder.
fs::path resolve(const std::string& path) {
  std::error_code error;
  fs::path target = fs::weakly_canonical(fs::path(path), error);
  if (error) target = path;
  if (path.empty() || !target.has_filename() || path.back() == '/')
    not_writable(path, "it is not a file name");
  const fs::path folder = target.has_parent_path() ? target.parent_path() : fs::path(".");
  const fs::file_status status = fs::status(folder, error);
  if (status.type() == fs::file_type::not_found)
    throw Error(Status::output_folder_missing, path + ": the folder " + folder.string() + " does not exist");
  if (status.type() != fs::file_type::directory) not_writable(path, folder.string() + " is not a folder");
  if (fs::is_directory(target, error)) not_writable(path, "it is a folder");
  if (fs::exists(target, error) && ::access(target.c_str(), W_OK) != 0)
    not_writable(path, std::strerror(errno));
  return target;
}

class Descriptor {
 public:
  explicit Descriptor(int fd) : fd_(fd) {}
  ~Descriptor() {
    if (fd_ >= 0) ::close(fd_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  int get() const { return fd_; }

 private:
  int fd_;
};

/// Random, so that another machine that shares the folder does not use the name of a file that was just
/// removed.
std::string temporary_name(const std::string& target) {
  uint32_t number = 0;
  if (::getrandom(&number, sizeof(number), 0) != ssize_t(sizeof(number))) number = uint32_t(::getpid());
  char digits[kDigits + 1];
  std::snprintf(digits, sizeof(digits), "%08x", number);
  return target + std::string(kTemporary) + digits;
}

/// The target of a temporary file; empty if the name is not that of a temporary.
std::string target_of(const std::string& name) {
  constexpr size_t kEnding = kTemporary.size() + kDigits;
  if (name.size() <= kEnding) return {};
  const std::string_view ending = std::string_view(name).substr(name.size() - kEnding);
  const bool digits =
      ending.find_first_not_of("0123456789abcdef", kTemporary.size()) == std::string_view::npos;
  return digits && ending.starts_with(kTemporary) ? name.substr(0, name.size() - kEnding) : "";
}

/// Removes a temporary file whose writer has died. Living writers hold a lock on theirs, which ends with
/// them. If the file system has no locks, nothing is removed.
void remove_if_abandoned(const fs::path& file) {
  const Descriptor opened(::open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK));
  struct stat about;
  if (opened.get() < 0 || ::fstat(opened.get(), &about) != 0 || !S_ISREG(about.st_mode)) return;
  if (::flock(opened.get(), LOCK_EX | LOCK_NB) == 0) ::unlink(file.c_str());
}

/// So that the rename survives a loss of power. Errors are ignored, because some file systems cannot do it.
void flush_folder(const std::string& file) {
  const fs::path folder = fs::path(file).parent_path();
  const Descriptor opened(::open(folder.empty() ? "." : folder.c_str(), O_RDONLY | O_CLOEXEC | O_DIRECTORY));
  if (opened.get() >= 0) ::fsync(opened.get());
}

}  // namespace

void remove_abandoned(const std::string& folder, const std::function<bool(const std::string&)>& which) {
  for_each_name(folder, [&](const std::string& name) {
    if (const std::string target = target_of(name); !target.empty() && which(target))
      remove_if_abandoned(fs::path(folder) / name);
  });
}

bool is_written_in_place(const std::string& path) { return is_stream(path); }

OutputFile::OutputFile(const std::string& path) : path_(path) {
  if (is_stream(path)) {  // by the given name: what /dev/stdout leads to may have no name
    fd_ = ::open(path.c_str(), O_WRONLY | O_CLOEXEC);
    if (fd_ < 0) not_writable(path, std::strerror(errno));
    return;
  }
  target_ = resolve(path).string();
  remove_abandoned(fs::path(target_).parent_path(), [name = fs::path(target_).filename().string()](
                                                        const std::string& other) { return other == name; });
  // A file keeps its permissions when it is replaced, and its temporary has them already while it is written.
  struct stat replaced;
  const bool replaces = ::stat(target_.c_str(), &replaced) == 0;
  const mode_t mode = replaces ? replaced.st_mode & 0777 : 0666;
  for (int attempt = 0; fd_ < 0; ++attempt) {
    temporary_ = temporary_name(target_);
    const int number = temporaries::add(temporary_.c_str());
    fd_ = ::open(temporary_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, mode);
    if (fd_ < 0) {
      temporaries::remove(number);
      if (errno != EEXIST || attempt == 1000) not_writable(path, std::strerror(errno));
      continue;
    }
    number_ = number;
    // A process that looks for abandoned files may have seen this one before it was locked.
    struct stat about;
    const bool locked = ::flock(fd_, LOCK_EX | LOCK_NB) == 0 || errno != EWOULDBLOCK;
    if (!locked || ::fstat(fd_, &about) != 0 || about.st_nlink == 0)
      discard();
    else if (replaces && (about.st_mode & 0777) != mode &&
             ::fchmod(fd_, mode) != 0)  // less the umask until now
      not_writable(path, std::strerror(errno));
  }
}

OutputFile::~OutputFile() { discard(); }

void OutputFile::discard() {
  if (!temporary_.empty() && number_) ::unlink(temporary_.c_str());
  if (number_) temporaries::remove(*std::exchange(number_, std::nullopt));
  if (fd_ >= 0) ::close(std::exchange(fd_, -1));
}

void OutputFile::write(std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const ssize_t done = ::write(fd_, bytes.data(), bytes.size());
    if (done < 0 && errno == EINTR) continue;
    if (done <= 0) not_writable(path_, std::strerror(done < 0 ? errno : EIO));
    bytes = bytes.subspan(size_t(done));
  }
}

void OutputFile::commit() {
  if (temporary_.empty()) {
    if (::close(std::exchange(fd_, -1)) != 0) not_writable(path_, std::strerror(errno));
    return;
  }
  if (::fsync(fd_) != 0) not_writable(path_, std::strerror(errno));
  // The lock is kept until the file has its name.
  const Descriptor locked(::fcntl(fd_, F_DUPFD_CLOEXEC, 0));
  if (::close(std::exchange(fd_, -1)) != 0) not_writable(path_, std::strerror(errno));
  if (::rename(temporary_.c_str(), target_.c_str()) != 0) not_writable(path_, std::strerror(errno));
  temporary_.clear();
  discard();
  flush_folder(target_);
}

void refuse_overwriting(const std::string& input, const std::string& output) {
  std::error_code ignored;
  if (fs::equivalent(input, output, ignored))
    throw Error(Status::usage, output + ": the output would overwrite the input");
}

void check_output(const std::string& path) {
  if (!is_stream(path)) OutputFile{path};
}

void write_output(const std::string& path, std::span<const std::byte> bytes) {
  OutputFile file(path);
  file.write(bytes);
  file.commit();
}

}  // namespace nif
