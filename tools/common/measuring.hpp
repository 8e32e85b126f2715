// What `nif eval` and `nif bench` share: an asset in the runtime together with its source mesh.
#pragma once

#include <atomic>
#include <string>
#include <utility>
#include <vector>

#include "bake/oracle/evaluate.hpp"
#include "bake/oracle/prepare.hpp"
#include "nif/nif.h"
#include "tools/common/progress.hpp"

namespace nif::tools {

/// Turns a failed call of the runtime into an exception; its codes for files are our exit codes.
void check(NifError error);

template <class Handle, void (*kRelease)(Handle)>
struct Released {
  Handle handle = nullptr;
  Released() = default;
  Released(Released&& other) noexcept : handle(std::exchange(other.handle, nullptr)) {}
  Released& operator=(Released&& other) noexcept {
    std::swap(handle, other.handle);
    return *this;
  }
  ~Released() { kRelease(handle); }
};
using Device = Released<NifDevice, nifReleaseDevice>;
using Asset = Released<NifAsset, nifReleaseAsset>;
using Scene = Released<NifScene, nifReleaseScene>;

/// What the runtime keeps in memory for an asset, with the best instruction set of this machine.
uint64_t resident_bytes(std::span<const std::byte> file);

class MeasuredAsset {
 public:
  /// `configuration` is the runtime's, of a device. Throws Error(usage) where it has not what that asks for,
  /// Error(mesh_mismatch) where an object was baked from another mesh, as far as one can tell.
  MeasuredAsset(const std::string& asset, const std::string& mesh, const std::string& configuration,
                Progress& progress);

  const NifAssetInfo& info() const { return info_; }
  const NifDeviceInfo& device() const { return device_info_; }
  /// What the asset takes of a GPU's memory; 0 until a scene of it was asked for.
  uint64_t gpu_bytes() const;
  const std::vector<bake::Prepared>& objects() const { return prepared_.objects; }
  const std::string& name(size_t object) const { return names_[object]; }
  uint64_t triangles() const;
  /// Some objects are `spherical`, which cannot tell where a segment ends.
  bool any_spherical() const { return any_spherical_; }
  /// One object, where it lies in its own space.
  Scene alone(size_t object) const;
  /// Each object so, on a device of so many threads.
  std::vector<Scene> each_alone(uint32_t threads) const;
  /// One, answered by the scalar reference.
  Scene alone_by_reference(size_t object) const;

 private:
  std::string path_, configuration_;
  Device device_, reference_device_;
  Asset asset_, reference_asset_;
  NifDeviceInfo device_info_{};
  NifAssetInfo info_{};
  mesh::Scene scene_;
  bake::PreparedScene prepared_;
  std::vector<std::string> names_;
  bool any_spherical_ = false;
};

/// Answers through the runtime. The scene must outlive the answerer.
bake::Answerer runtime_answerer(NifScene scene);

/// The same, and counts the rays that `reference` answers differently in any bit that is promised to be the
/// same.
bake::Answerer comparing_answerer(NifScene scene, NifScene reference, std::atomic<uint64_t>& different);

/// The sets that --set names. Throws Error(usage).
std::vector<bake::RaySet> parse_sets(const std::vector<std::string>& names);

}  // namespace nif::tools
