// Keeps names, help texts and default values in one place, so that `nif eval` and `nif bench` cannot drift
// apart.
#include "tools/common/measure_options.hpp"

#include "tools/common/ray_set_option.hpp"

namespace nif::tools {

void add_measure_options(Command command, MeasureArguments& arguments, const std::string& sets) {
  add_set_option(command, arguments.sets, sets);
  command.add_option("--rays", arguments.rays, "Rays per ray set, divided among the objects")
      .positive()
      .capture_default_str();
  add_seed_option(command, arguments.seed);
  add_runtime_options(command, arguments);
  command
      .add_option(
          "--fallback", arguments.fallback,
          "embree: proofs answer first, and a BVH of Embree the rays that they leave open (nifQueryOpen)")
      .one_of({"embree"});
}

}  // namespace nif::tools
