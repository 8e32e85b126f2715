// Answers a batch of rays in a scene of several instances, in streams: the box of an instance is tested against
// all undecided rays, and the object's kernel gets those that may meet it, at once. Boxes of inner nodes of the
// hierarchy narrow streams before. Large boxes come first, because they decide the most rays.
#pragma once

#include "query/rounds.hpp"

namespace nif::runtime {

using kernels::cpu::RayStream;

/// Starts the batch's stream, and sets area.misses. Requires a device with streams.
void start_stream(const NifSceneObject& scene, bool masked, WorkArea& area);
/// The same, unless the batch should go in rounds: returns false.
bool start_in_streams(const NifSceneObject& scene, bool masked, WorkArea& area);

/// Takes the batch's stream through the hierarchy.
class StreamTraversal {
 public:
  StreamTraversal(const NifSceneObject& scene, WorkArea& area) : scene_(scene), area_(area) {}
  void run();

 protected:
  ~StreamTraversal() = default;
  /// Queries the object of an instance with area_.object_rays, of which ray k is entry area_.entries[k] of the
  /// stream. Drops the entries that are decided, or shortens them.
  virtual void ask(uint32_t instance, RayStream& stream) = 0;
  /// The rays of these entries were asked in a narrower stream: does the same with what came of it.
  virtual void update(RayStream& stream, const uint32_t* entries, uint32_t count) = 0;

  const NifSceneObject& scene_;
  WorkArea& area_;

 private:
  void visit(uint32_t node, uint32_t level);
  void narrow(uint32_t node, const kernels::WorldBox& box, uint32_t level);
  void meet(uint32_t instance, const kernels::WorldBox& box, uint32_t level);
  void pack(RayStream& stream) const;
};

}  // namespace nif::runtime
