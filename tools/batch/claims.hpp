// Lets several processes work on one manifest at the same time: a process claims each asset before it bakes
// it.
#pragma once

#include "tools/batch/manifest.hpp"

namespace nif::tools {

/// Locks on single assets, in the file `lock` of the state folder. They end with the process, however it
/// ends. If the file system has no locks, every claim succeeds; then two processes may bake an asset twice,
/// to the same bytes. Not thread-safe.
class Claims {
 public:
  /// The state folder must exist.
  explicit Claims(const Manifest& manifest);
  ~Claims();
  Claims(const Claims&) = delete;
  Claims& operator=(const Claims&) = delete;

  /// Returns false if another process holds the claim.
  bool claim(const BatchAsset& asset);
  void release(const BatchAsset& asset);

 private:
  bool set(const BatchAsset& asset, short type) const;

  int fd_;
};

}  // namespace nif::tools
