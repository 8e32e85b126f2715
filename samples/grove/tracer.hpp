// What the picture asks of whoever answers its rays: Embree or an asset.
#pragma once

#include <nif/nif.hpp>

#include <cstdint>
#include <ctime>
#include <span>
#include <vector>

#include "trees.hpp"

struct Hits {
  std::vector<float> t;  // infinite where nothing is hit
  std::vector<Float3> normal;
  std::vector<uint32_t> placed;  // index into Trees::placed

  void resize(size_t count) { t.resize(count), normal.resize(count), placed.resize(count); }
};

/// Seconds of processor time of this thread: what other programs take on a busy machine does not count.
inline double thread_seconds() {
  timespec time;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return double(time.tv_sec) + 1e-9 * double(time.tv_nsec);
}

/// Each call returns the seconds that the rays took on this thread, without the time for bringing them into the tracer's own form.
class Tracer {
 public:
  virtual ~Tracer() = default;
  virtual double find_hits(std::span<const NifRay> rays, Hits& hits) = 0;
  virtual double find_visible(std::span<const NifRay> rays, std::vector<uint8_t>& visible) = 0;
};
