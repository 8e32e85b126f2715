// Locks one byte of the file for each asset, at a hash of its name. These are open file description
// locks, so two Claims exclude each other within one process, too.
#include "tools/batch/claims.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>

#define XXH_INLINE_ALL
#include <xxhash.h>

namespace nif::tools {

Claims::Claims(const Manifest& manifest)
    : fd_(::open((std::filesystem::path(manifest.state) / "lock").c_str(), O_RDWR | O_CREAT | O_CLOEXEC,
                 0666)) {}

Claims::~Claims() {
  if (fd_ >= 0) ::close(fd_);
}

/// One byte of the file stands for each asset; the file need not be that long.
bool Claims::set(const BatchAsset& asset, short type) const {
  if (fd_ < 0) return true;
  struct flock lock {};
  lock.l_type = type;
  lock.l_whence = SEEK_SET;
  lock.l_start = off_t(XXH3_64bits(asset.name.data(), asset.name.size()) >> 2);
  lock.l_len = 1;
  return ::fcntl(fd_, F_OFD_SETLK, &lock) == 0 || (errno != EAGAIN && errno != EACCES);
}

bool Claims::claim(const BatchAsset& asset) { return set(asset, F_WRLCK); }
void Claims::release(const BatchAsset& asset) { set(asset, F_UNLCK); }

}  // namespace nif::tools
