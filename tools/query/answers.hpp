// What an asset answers, ray by ray.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "nif/nif.h"
#include "tools/common/runtime_handles.hpp"

namespace nif::tools {

/// Entry i is about ray i; the values are those of NifAnswers and NifHits.
struct Answers {
  std::vector<uint8_t> visible, certain;
  std::vector<float> probability;
  // With first hits only.
  std::vector<float> t, normal;
  std::vector<uint32_t> instance, object, triangle;

  size_t size() const { return visible.size(); }
};

class Asker {
 public:
  /// `configuration` is the runtime's, of a device. All instances of the file are asked; with `object`, that
  /// one alone, in its own space. Throws nif::Error, usage where the machine lacks what is asked for.
  Asker(const std::string& asset, const std::string& configuration, const uint32_t* object, bool hits);

  /// Replaces the answers.
  void ask(std::span<const NifRay> rays, Answers& answers) const;

 private:
  Device device_;
  Scene scene_;
  bool hits_;
};

}  // namespace nif::tools
