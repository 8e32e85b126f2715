// Loads an asset together with its source mesh, so that its answers can be measured.
#pragma once

#include <atomic>
#include <string>
#include <vector>

#include "bake/ground_truth/evaluate.hpp"
#include "bake/ground_truth/prepare.hpp"
#include "formats/mesh/mesh_scene.hpp"
#include "formats/mesh/read.hpp"
#include "nif/nif.h"
#include "tools/common/progress.hpp"
#include "tools/common/runtime_handles.hpp"

namespace nif::tools {

class MeasuredAsset {
 public:
  /// `configuration` is that of the runtime's device. Throws Error(usage) if the device lacks what it asks
  /// for, and Error(mesh_mismatch) if an object was baked from another mesh, as far as one can tell.
  /// `format`: ReadLimits::format.
  MeasuredAsset(const std::string& asset, const std::string& mesh, const std::string& configuration,
                Progress& progress, const std::string& format = "");

  const NifAssetInfo& info() const { return info_; }
  std::vector<NifPartInfo> parts() const { return parts_of(asset_.handle); }
  const NifDeviceInfo& device() const { return device_info_; }
  /// GPU memory that the asset takes; 0 until a scene with it was requested.
  uint64_t gpu_bytes() const;
  const std::vector<bake::Prepared>& objects() const { return prepared_.objects; }
  const bake::PreparedScene& prepared() const { return prepared_; }
  const std::string& mesh_file() const { return mesh_file_; }
  /// What the mesh file has, as it was read for the bake, and how.
  const mesh::Scene& scene() const { return scene_; }
  const mesh::ReadLimits& limits() const { return limits_; }
  /// The placements of the objects in the mesh file.
  std::vector<bake::Placed> instances() const;
  const std::string& path() const { return path_; }
  const std::string& name(size_t object) const { return names_[object]; }
  uint64_t triangles() const;
  /// NifObjectInfo::proves
  bool proves(size_t object) const { return proves_[object]; }
  /// Whether its hits report triangles of the source mesh.
  bool has_source_triangles(size_t object) const { return has_source_triangles_[object]; }
  /// Whether any object is `spherical`, which cannot tell where a segment ends.
  bool any_spherical() const { return any_spherical_; }
  /// A scene of one object, in its own space.
  Scene alone(size_t object) const;
  /// Such a scene for each object, on a device with `threads` threads.
  std::vector<Scene> each_alone(uint32_t threads) const;
  /// Such a scene, answered by the scalar reference.
  Scene alone_by_reference(size_t object) const;
  /// A scene of the whole asset; not committed.
  Scene whole() const;
  Scene whole_by_reference() const;

 private:
  std::string path_, mesh_file_, configuration_;
  Device device_, reference_device_;
  Asset asset_, reference_asset_;
  NifDeviceInfo device_info_{};
  NifAssetInfo info_{};
  mesh::ReadLimits limits_;
  mesh::Scene scene_;
  bake::PreparedScene prepared_;
  std::vector<std::string> names_;
  std::vector<uint32_t> numbers_;  ///< of the objects of level 0 in the asset
  std::vector<bool> proves_, has_source_triangles_;
  bool any_spherical_ = false;
};

/// Answers through the runtime. The scene must outlive the answerer.
bake::Answerer runtime_answerer(NifScene scene);

/// The same, and counts the rays for which `reference` answers differently in any bit that is promised to be
/// the same.
bake::Answerer comparing_answerer(NifScene scene, NifScene reference, std::atomic<uint64_t>& different);

}  // namespace nif::tools
