// Queries an asset ray by ray, through the runtime.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "nif/nif.h"
#include "tools/common/runtime_handles.hpp"

namespace nif::tools {

/// Entry i is for ray i; the values are those of NifAnswers and NifHits.
struct Answers {
  std::vector<uint8_t> visible, certain;
  std::vector<float> probability;
  // Only with first hits.
  std::vector<float> t, normal;
  std::vector<uint32_t> instance, object, triangle;

  size_t size() const { return visible.size(); }
};

class Asker {
 public:
  /// `configuration` is that of the runtime's device. Queries all instances of the file; with `object`, only
  /// that object, in its own space. Throws nif::Error; usage if the machine lacks what is requested.
  Asker(const std::string& asset, const std::string& configuration, const uint32_t* object, bool hits);

  /// Replaces the previous answers.
  void ask(std::span<const NifRay> rays, Answers& answers) const;

 private:
  Device device_;
  Scene scene_;
  bool hits_;
};

}  // namespace nif::tools
