// Keeps a TBB global_control in a static variable, because the limit ends with the object.
#include "tools/common/threads.hpp"

#include <tbb/global_control.h>

#include <memory>

namespace nif::tools {

void limit_threads(uint32_t threads) {
  static std::unique_ptr<tbb::global_control> control;
  if (threads != 0)
    control = std::make_unique<tbb::global_control>(tbb::global_control::max_allowed_parallelism, threads);
}

}  // namespace nif::tools
