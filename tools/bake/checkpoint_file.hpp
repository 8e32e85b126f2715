// The checkpoint of a long bake: a file beside the asset, from which a bake that was killed goes on.
#pragma once

#include <functional>
#include <string>

#include "bake/checkpoint.hpp"

namespace nif::tools {

enum class Resume {
  never,
  if_possible,  ///< else from the start, with a note that says why
  required      ///< a checkpoint that is there must be usable; without one, from the start with a note
};

class CheckpointFile {
 public:
  /// Of the asset at this path. `note` is told what did not go as it should, a sentence at a time.
  CheckpointFile(const std::string& asset, bake::BakeKey key, std::function<void(const std::string&)> note);

  /// "ASSET.checkpoint"; empty where the asset is written to a device.
  const std::string& path() const { return path_; }
  /// What it has. Throws nif::Error: checkpoint_refused where it is required and cannot be used; what reading
  /// it says.
  std::vector<bake::KeptTraining> load(Resume resume);
  /// Whole or not at all. That it cannot be written ends no bake: a note says so, once. A file of this name
  /// that is no checkpoint may be somebody's own, and is neither replaced nor removed.
  void save(std::span<const bake::KeptTraining> trainings);
  /// Once the asset is written.
  void remove() const;

 private:
  std::string path_;
  bake::BakeKey key_;
  std::function<void(const std::string&)> note_;
  bool failed_ = false;
};

}  // namespace nif::tools
