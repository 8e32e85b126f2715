// An outside C++ program: cpp_consumer ASSET asks one ray.
#include <cstdio>
#include <exception>
#include <nif/nif.hpp>

static_assert(PACKAGE_VERSION == NIF_VERSION, "the package and its header are of different versions");

int main(int argc, char** argv) try {
  if (argc != 2) return 2;
  nifkit::Device device;
  nifkit::Scene scene(device);
  scene.add_asset(nifkit::Asset::load(device, argv[1]));
  scene.commit();
  const NifSceneInfo info = scene.info();
  const NifRay away{
      {info.bounds_max[0] + 1, info.bounds_max[1] + 1, info.bounds_max[2] + 1}, 0, {1, 1, 1}, 1};
  std::puts(scene.query(away) ? "visible" : "occluded");
  return scene.query(away) ? 0 : 1;
} catch (const std::exception& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
