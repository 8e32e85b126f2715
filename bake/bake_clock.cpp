// Weighs the progress of each object by its triangles.
#include "bake/bake_clock.hpp"

#include <algorithm>

#include "formats/base/status.hpp"

namespace nif::bake {

BakeClock::BakeClock(std::span<const Prepared> objects, const BakeCallback& callback)
    : callback_(callback), starts_{0} {
  for (const Prepared& object : objects)
    starts_.push_back(starts_.back() +
                      std::clamp(double(object.surface.triangles.size()), 10e3, kFullTriangles));
}

void BakeClock::report(BakeProgress::Stage stage, std::string_view name, size_t index, double share,
                       double loss, double error) const {
  if (!callback_) return;
  const double done = starts_[index] + share * (starts_[index + 1] - starts_[index]);
  callback_({stage, name, index, starts_.size() - 1, done / starts_.back(), loss, error});
}

void stop_if(const std::atomic<bool>& cancel) {
  if (cancel) throw Error(Status::interrupted, "the bake was cancelled");
}

}  // namespace nif::bake
