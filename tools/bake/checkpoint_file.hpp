// The checkpoint of a long bake: a file beside the asset that lets a killed bake continue.
#pragma once

#include <functional>
#include <string>

#include "bake/checkpoint.hpp"

namespace nif::tools {

enum class Resume {
  never,
  if_possible,  ///< if there is no usable checkpoint, starts from the beginning, with a note that says why
  /// An existing checkpoint must be usable; if there is none, starts from the beginning, with a note.
  required
};

class CheckpointFile {
 public:
  /// The checkpoint of the asset at this path. `note` gets one sentence for each thing that went wrong.
  CheckpointFile(const std::string& asset, bake::BakeKey key, std::function<void(const std::string&)> note);

  /// "ASSET.checkpoint"; empty if the asset is written to a device.
  const std::string& path() const { return path_; }
  /// Returns the trainings that the checkpoint holds. Throws nif::Error: checkpoint_refused if a checkpoint
  /// is required and cannot be used; and the errors of reading a file.
  std::vector<bake::KeptTraining> load(Resume resume);
  /// Writes the file whole or not at all. A failure does not end the bake: one note reports it. A file of
  /// this name that is not a checkpoint may belong to somebody, so it is neither replaced nor removed.
  void save(std::span<const bake::KeptTraining> trainings);
  /// To be called once the asset is written.
  void remove() const;

 private:
  std::string path_;
  bake::BakeKey key_;
  std::function<void(const std::string&)> note_;
  bool failed_ = false;
};

}  // namespace nif::tools
