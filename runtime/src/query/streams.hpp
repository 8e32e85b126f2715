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

/// Starts the batch's stream. Sets area.misses.
void start_stream(const NifSceneObject& scene, bool masked, WorkArea& area);

/// Takes the batch's stream through the hierarchy.
class StreamTraversal {
 public:
  StreamTraversal(const NifSceneObject& scene, WorkArea& area) : scene_(scene), area_(area) {}
  void run();

 protected:
  ~StreamTraversal() = default;
  /// Queries the object of some pairs. Pair k is that of entry area_.entries[k] of the stream, which is
  /// area_.object_rays[k] in object space.
  virtual void ask(const Pair* pairs, uint32_t count, const RayStream& stream) = 0;
  /// Something was asked for the rays of these entries: drops those that are decided, or shortens them.
  virtual void update(RayStream& stream, const uint32_t* entries, uint32_t count) = 0;

  const NifSceneObject& scene_;
  WorkArea& area_;

 private:
  void visit(uint32_t node, uint32_t level);
  void narrow(uint32_t node, const kernels::WorldBox& box, uint32_t level);
  void meet(uint32_t instance, const kernels::WorldBox& box, uint32_t level);
  void update_and_pack(RayStream& stream, const uint32_t* entries, uint32_t count);
};

}  // namespace nif::runtime
