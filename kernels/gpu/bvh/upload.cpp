// `bvh` objects on their way to a GPU.
#include "kernels/gpu/bvh/upload.hpp"
#include "kernels/gpu/upload.hpp"

namespace nif::kernels::gpu {
namespace {

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
    move_bvh(field, arena);
    return arena.add_structure(field);
  }

 private:
  BvhField field_;
};

}  // namespace

FieldUpload* BvhEncoding::upload(const BvhField& field) { return new BvhUpload(field); }

}  // namespace nif::kernels::gpu
