// Answers a batch of rays in a scene of several instances, in streams: the box of an instance is tested against
// all undecided rays, and the object's kernel gets those that may meet it, at once. Boxes of inner nodes of the
// hierarchy narrow streams before. Large boxes come first, because they decide the most rays.
#pragma once

#include "query/rounds.hpp"

namespace nif::runtime {

using kernels::cpu::RayStream;

/// How a batch goes through the scene.
struct BatchStart {
  bool in_streams;
  uint32_t active;  ///< otherwise: rays of the first round, in area.active
};
/// Chooses, and starts the batch's rays. Sets area.misses.
BatchStart start_batch(const NifSceneObject& scene, bool masked, WorkArea& area);

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
