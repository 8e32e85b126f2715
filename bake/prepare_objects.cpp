// The first step of a bake: prepares meshes, places their instances, and reserves bytes for the metadata,
// whose figures exist only once accuracy has been measured.
#include <algorithm>

#include "bake/report.hpp"
#include "bake/steps.hpp"

namespace nif::bake {
namespace {

constexpr uint64_t kMetadataBytes = 1024, kMetadataBytesPerObject = 2368;
/// And for the figures of an object with a decision threshold.
constexpr uint64_t kMetadataBytesOfThreshold = 768;

/// The instances of what was prepared, named and placed as in the scene.
std::vector<format::Instance> instances_of(const mesh::Scene& scene, const PreparedScene& prepared) {
  std::vector<format::Instance> instances;
  for (const uint32_t i : prepared.instances) {
    const mesh::Instance& instance = scene.instances[i];
    instances.push_back({format::clean_name(instance.name), prepared.object_of[instance.mesh],
                         instance.transform, to_float(instance.remainder)});
  }
  return instances;
}

}  // namespace

void prepare_objects(BakeRun& run) {
  if (run.callback)
    run.callback({BakeProgress::Stage::preparing, run.scene.meshes.front().name, 0, 1, 0, 0, 0});
  run.prepared = prepare(run.scene, run.options.strict, run.options.deforms);
  const std::vector<Prepared>& objects = run.prepared.objects;
  BakeResult& result = run.result;
  result.notes = std::move(run.prepared.notes);
  result.asset.instances = instances_of(run.scene, run.prepared);
  result.asset.places_nothing = result.asset.instances.empty();
  result.placed = run.prepared.instances;
  result.objects.resize(objects.size());
  run.size.set(objects.size(), format::section_bytes(result.asset));  // each object has its own number
  run.metadata_bytes =
      kMetadataBytes + kMetadataBytesPerObject * objects.size() + scene_bytes(run.scene, result);
  if (run.options.error_limit) run.metadata_bytes += kMetadataBytesOfThreshold * objects.size();
  run.clock.emplace(objects, run.callback);
  run.candidates.reserve(objects.size());
  for (size_t i = 0; i < objects.size(); ++i)
    run.candidates.emplace_back(i, objects[i], run, result.objects[i], run.size);
}

}  // namespace nif::bake
