// Progress of a bake of several objects, and its end when it is cancelled.
#pragma once

#include <span>
#include <vector>

#include "bake/bake.hpp"
#include "bake/ground_truth/prepare.hpp"

namespace nif::bake {

/// Combines the progress of all objects into one number. An object's training is assumed to take time in
/// proportion to its triangles, within bounds.
class BakeClock {
 public:
  BakeClock(std::span<const Prepared> objects, const BakeCallback& callback);
  /// `share` of the object at `index` is done.
  void report(BakeProgress::Stage stage, std::string_view name, size_t index, double share, double loss = 0,
              double error = 0) const;

 private:
  const BakeCallback& callback_;
  std::vector<double> starts_;  ///< [objects + 1]: the weight of all objects before each
};

/// Throws Error(interrupted) once `cancel` is set.
void stop_if(const std::atomic<bool>& cancel);

}  // namespace nif::bake
