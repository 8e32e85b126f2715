// `bvh` objects on their way to a GPU.
#include "kernels/gpu/upload.hpp"

namespace nif::kernels::gpu {
namespace {

/// Levels of a tree, the root's among them.
uint32_t bvh_levels(const BvhField& field) {
  // Nodes on the way down, and those beside them that are still to be seen; each with its level.
  std::vector<std::pair<uint32_t, uint32_t>> pending{{0, 1}};
  uint32_t deepest = 1;
  while (!pending.empty()) {
    const auto [number, level] = pending.back();
    pending.pop_back();
    if (level > deepest) deepest = level;
    const BvhNode& node = field.nodes[number];
    for (const uint8_t slot : node.slots)
      if (slot != 0 && slot_kind(slot) == kInnerSlot)
        pending.emplace_back(node.first_node + slot_rank(slot), level + 1);
  }
  return deepest;
}

class BvhUpload final : public FieldUpload {
 public:
  explicit BvhUpload(const BvhField& field) : field_(field) {}

  ObjectPlan plan(bool) const override {
    ObjectPlan plan;
    plan.object.kind = kKindBit<BvhEncoding, BvhEncoding::kExact>;
    plan.row_words = plan.walk_words = bvh_stack_words(bvh_levels(field_));
    return plan;
  }

  const void* add_to(Arena& arena) const override {
    BvhField field = field_;
    arena.move(field.nodes, field.node_count);
    arena.move(field.vertices, field.vertex_count);
    arena.move(field.triangles, field.triangle_count);
    return arena.add_structure(field);
  }

 private:
  BvhField field_;
};

}  // namespace

FieldUpload* BvhEncoding::upload(const BvhField& field) { return new BvhUpload(field); }

}  // namespace nif::kernels::gpu
