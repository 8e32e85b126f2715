// Answers a batch of rays in a scene of several instances, in streams: the box of an instance is tested against
// all undecided rays, and the object's kernel gets those that may meet it, at once. Boxes of inner nodes of the
// hierarchy narrow streams before. Large boxes come first, because they decide the most rays.
#pragma once

#include "query/rounds.hpp"

namespace nif::runtime {

using kernels::cpu::RayStream;

/// Scenes with more nodes in their hierarchy, which have some 8,000 instances, go in rounds: few rays of a batch
/// meet the same box.
inline constexpr size_t kMostNodesForStreams = 4096;

/// So do fewer rays than fill a vector.
inline constexpr uint32_t kFewForStreams = 8;

inline bool goes_in_streams(const NifSceneObject& scene, uint32_t rays) {
  return scene.device->streams && rays >= kFewForStreams &&
         scene.hierarchy.nodes().size() <= kMostNodesForStreams;
}

/// Starts the stream. Calls begin(ray, certain) for every ray, as start_rays() does.
template <class Begin>
void start_stream(const NifSceneObject& scene, bool masked, WorkArea& area, const Begin& begin) {
  RayStream& stream = area.streams[0];
  scene.device->streams->start(area.rays, masked ? area.mask : nullptr, stream);
  for (uint32_t i = 0, k = 0; i < area.rays.count; ++i) {
    const bool askable = k < stream.count && stream.ray[k] == i;
    k += askable;
    begin(i, (askable || area.rays.tmin[i] > area.rays.tmax[i]) && !scene.unproven);
  }
}

/// Takes streams of rays through the hierarchy.
///
/// - ask(pairs, count, stream): pair k is that of stream entry area.entries[k], which is area.object_rays[k] in
///   object space;
/// - update(stream, entry): something was asked for the entry's ray: drops the entry, or shortens it.
template <class Ask, class Update>
class StreamTraversal {
 public:
  StreamTraversal(const NifSceneObject& scene, WorkArea& area, const Ask& ask, const Update& update)
      : scene_(scene),
        functions_(*scene.device->streams),
        nodes_(scene.hierarchy.nodes().data()),
        area_(area),
        ask_(ask),
        update_(update) {}

  void run() {
    if (!scene_.hierarchy.nodes().empty()) visit(0, 0);
  }

 private:
  /// Recursion is at most kMaxLevels deep.
  void visit(uint32_t number, uint32_t level) {
    const Node& node = nodes_[number];
    RayStream& stream = area_.streams[level];
    for (uint32_t lane = 0; lane < kWidth && stream.count != 0; ++lane) {
      if (!(node.lanes >> lane & 1)) continue;
      const kernels::WorldBox box = kernels::box_of_child(node, lane);
      const uint32_t child = node.child[lane];
      if (child & kLeaf)
        meet(child & ~kLeaf, box, level);
      else if (level + 1 == kStreamLevels || !has_inner_children(nodes_[child]))
        visit(child, level);
      else
        narrow(child, box, level);
    }
  }

  static bool has_inner_children(const Node& node) {
    for (uint32_t lane = 0; lane < kWidth; ++lane)
      if (node.lanes >> lane & 1 && !(node.child[lane] & kLeaf)) return true;
    return false;
  }

  void narrow(uint32_t child, const kernels::WorldBox& box, uint32_t level) {
    RayStream &stream = area_.streams[level], &narrowed = area_.streams[level + 1];
    functions_.narrow(stream, box, narrowed, area_.narrowed[level + 1]);
    const uint32_t count = narrowed.count;
    if (count == 0) return;
    visit(child, level + 1);
    update(stream, area_.narrowed[level + 1], count);
  }

  void meet(uint32_t number, const kernels::WorldBox& box, uint32_t level) {
    RayStream& stream = area_.streams[level];
    const Instance& instance = scene_.instances[number];
    functions_.meet(
        stream,
        {.box = box, .to_object = instance.identity ? nullptr : &instance.to_object, .mask = instance.mask},
        area_.object_rays, area_.entries);
    const uint32_t count = area_.object_rays.count;
    if (count == 0) return;
    for (uint32_t k = 0; k < count; ++k)
      area_.pairs[0][k] = {instance.object, number, stream.ray[area_.entries[k]]};
    ask_(area_.pairs[0], count, stream);
    update(stream, area_.entries, count);
  }

  /// Updates entries, and packs the stream if enough of them are dropped.
  void update(RayStream& stream, const uint32_t* entries, uint32_t count) {
    for (uint32_t k = 0; k < count; ++k) update_(stream, entries[k]);
    if (8 * stream.dropped >= stream.count) functions_.pack(stream);
  }

  const NifSceneObject& scene_;
  const kernels::cpu::StreamFunctions& functions_;
  const Node* nodes_;
  WorkArea& area_;
  const Ask& ask_;
  const Update& update_;
};

template <class Ask, class Update>
void go_in_streams(const NifSceneObject& scene, WorkArea& area, const Ask& ask, const Update& update) {
  StreamTraversal(scene, area, ask, update).run();
}

}  // namespace nif::runtime
