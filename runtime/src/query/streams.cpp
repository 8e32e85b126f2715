// Goes down the hierarchy depth first, with streams that narrow on the way.
#include "query/streams.hpp"

#include <algorithm>

namespace nif::runtime {
namespace {

/// Scenes with more nodes in their hierarchy, which have some 3,000 instances, go in rounds: few rays of a
/// batch meet the same box (docs/results/cpu-kernels.md, "Cities").
constexpr size_t kMostNodesForStreams = 1024;
/// So do fewer rays than fill a vector.
constexpr uint32_t kFewForStreams = 8;

/// A node with leaves alone is not worth a stream of its own.
bool has_inner_children(const Node& node) {
  for (uint32_t lane = 0; lane < kWidth; ++lane)
    if (node.lanes >> lane & 1 && !(node.child[lane] & kLeaf)) return true;
  return false;
}

}  // namespace

void start_stream(const NifSceneObject& scene, bool masked, WorkArea& area) {
  RayStream& stream = area.streams[0];
  scene.device->streams->start(area.rays, masked ? area.mask : nullptr, stream);
  std::fill_n(area.misses, area.rays.count, uint8_t(!scene.unproven));
  if (stream.count == area.rays.count) return;
  for (uint32_t i = 0; i < area.rays.count; ++i)
    area.misses[i] &= uint8_t(area.rays.tmin[i] > area.rays.tmax[i]);
  for (uint32_t k = 0; k < stream.count; ++k) area.misses[stream.ray[k]] = !scene.unproven;
}

bool start_in_streams(const NifSceneObject& scene, bool masked, WorkArea& area) {
  if (!scene.device->streams || area.rays.count < kFewForStreams ||
      scene.hierarchy.nodes().size() > kMostNodesForStreams)
    return false;
  start_stream(scene, masked, area);
  return true;
}

void StreamTraversal::run() {
  if (!scene_.hierarchy.nodes().empty()) visit(0, 0);
}

/// Recursion is at most kMaxLevels deep.
void StreamTraversal::visit(uint32_t number, uint32_t level) {
  const std::span<const Node> nodes = scene_.hierarchy.nodes();
  const Node& node = nodes[number];
  const RayStream& stream = area_.streams[level];
  for (uint32_t lane = 0; lane < kWidth && stream.count != 0; ++lane) {
    if (!(node.lanes >> lane & 1)) continue;
    const kernels::WorldBox box = kernels::box_of_child(node, lane);
    const uint32_t child = node.child[lane];
    if (child & kLeaf)
      meet(child & ~kLeaf, box, level);
    else if (level + 1 == kStreamLevels || !has_inner_children(nodes[child]))
      visit(child, level);
    else
      narrow(child, box, level);
  }
}

void StreamTraversal::narrow(uint32_t node, const kernels::WorldBox& box, uint32_t level) {
  RayStream &stream = area_.streams[level], &narrowed = area_.streams[level + 1];
  uint32_t* entries = area_.narrowed[level + 1];
  scene_.device->streams->narrow(stream, box, narrowed, entries);
  const uint32_t count = narrowed.count;
  if (count == 0) return;
  visit(node, level + 1);
  update(stream, entries, count);
  pack(stream);
}

void StreamTraversal::meet(uint32_t number, const kernels::WorldBox& box, uint32_t level) {
  RayStream& stream = area_.streams[level];
  const Instance& instance = scene_.instances[number];
  scene_.device->streams->meet(
      stream,
      {.box = box, .to_object = instance.identity ? nullptr : &instance.to_object, .mask = instance.mask},
      area_.object_rays, area_.entries);
  if (area_.object_rays.count == 0) return;
  ask(number, stream);
  pack(stream);
}

/// Packs the stream once enough of it is dropped.
void StreamTraversal::pack(RayStream& stream) const {
  if (8 * stream.dropped >= stream.count) scene_.device->streams->pack(stream);
}

}  // namespace nif::runtime
