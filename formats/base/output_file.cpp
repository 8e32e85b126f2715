// Temporary, flush, close, rename; each of these can fail (a full disk shows at the flush or the close).
#include "formats/base/output_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <utility>

#include "formats/base/status.hpp"

namespace nif {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void not_writable(const std::string& path, const std::string& why) {
  throw Error(Status::output_not_writable, path + ": cannot be written: " + why);
}

/// Is there something at the path that is written to as it stands, because it is no file?
bool is_stream(const std::string& path) {
  struct stat about;
  if (::stat(path.c_str(), &about) != 0 || S_ISREG(about.st_mode) || S_ISDIR(about.st_mode)) return false;
  if (::access(path.c_str(), W_OK) != 0) not_writable(path, std::strerror(errno));
  return true;
}

/// Where the bytes of a file really go: a link is followed, so that it stays a link. Throws where there is no
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

}  // namespace

OutputFile::OutputFile(const std::string& path) : path_(path) {
  if (is_stream(path)) {  // by the name given: what /dev/stdout leads to may have none of its own
    fd_ = ::open(path.c_str(), O_WRONLY | O_CLOEXEC);
    if (fd_ < 0) not_writable(path, std::strerror(errno));
    return;
  }
  target_ = resolve(path).string();
  for (int attempt = 0; fd_ < 0; ++attempt) {
    temporary_ = target_ + ".tmp-" + std::to_string(::getpid()) + "-" + std::to_string(attempt);
    fd_ = ::open(temporary_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (fd_ < 0 && (errno != EEXIST || attempt == 1000)) not_writable(path, std::strerror(errno));
  }
}

OutputFile::~OutputFile() {
  if (fd_ >= 0) ::close(fd_);
  if (!temporary_.empty()) ::unlink(temporary_.c_str());
}

void OutputFile::write(std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const ssize_t done = ::write(fd_, bytes.data(), bytes.size());
    if (done < 0 && errno == EINTR) continue;
    if (done < 0) not_writable(path_, std::strerror(errno));
    bytes = bytes.subspan(size_t(done));
  }
}

void OutputFile::commit() {
  if (!temporary_.empty() && ::fsync(fd_) != 0) not_writable(path_, std::strerror(errno));
  if (::close(std::exchange(fd_, -1)) != 0) not_writable(path_, std::strerror(errno));
  if (temporary_.empty()) return;
  if (::rename(temporary_.c_str(), target_.c_str()) != 0) not_writable(path_, std::strerror(errno));
  temporary_.clear();
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
