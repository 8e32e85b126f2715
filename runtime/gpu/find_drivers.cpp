// Lists the drivers, which decides how GPUs are numbered: NVIDIA's come first, then AMD's.
#include "library_driver.hpp"

namespace nif::gpu {

Drivers find_drivers() {
  Drivers drivers;
  std::string no_cuda, no_hip;
  if (auto cuda = find_cuda(no_cuda)) drivers.found.push_back(std::move(cuda));
  if (auto hip = find_hip(no_hip)) drivers.found.push_back(std::move(hip));
  if (drivers.found.empty()) drivers.why_none = no_cuda + ", and " + no_hip;
  return drivers;
}

}  // namespace nif::gpu
