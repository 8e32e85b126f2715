// The forest as a .nif asset: no filter function, because the asset knows where leaves are.
#pragma once

#include <memory>
#include <string>

#include "tracer.hpp"

class AssetTrees : public Tracer {
 public:
  /// `config` is that of the device. Throws nifkit::Error, and std::runtime_error if the asset was not baked from these trees.
  AssetTrees(const Trees& trees, const std::string& path, const std::string& config);

  double find_hits(std::span<const NifRay> rays, Hits& hits) override;
  double find_visible(std::span<const NifRay> rays, std::vector<uint8_t>& visible) override;

  uint64_t bytes_of_file() const { return bytes_of_file_; }
  uint64_t bytes_of_models() const { return asset_.info().resident_bytes; }
  uint64_t bytes_of_instances() const { return scene_.info().resident_bytes; }
  std::string isa() const { return device_.info().isa; }

 private:
  uint64_t bytes_of_file_;
  nifkit::Device device_;
  nifkit::Asset asset_;
  nifkit::Scene scene_;
  uint32_t instances_;  // of the scene for each of Trees::placed
};
