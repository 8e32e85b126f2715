// Uploads `bvh` objects to a GPU.
#include "kernels/gpu/triangles/upload_triangles.hpp"
#include "kernels/gpu/upload.hpp"

namespace nif::kernels::gpu {
namespace {

class BvhUpload final : public FieldUpload {
 public:
  explicit BvhUpload(const TrianglesField& field) : field_(field) {}

  ObjectPlan plan(bool) const override {
    ObjectPlan plan;
    plan.object.kind = kKindBit<BvhEncoding, BvhEncoding::kExact>;
    plan.row_words = plan.traversal_words = bvh_stack_words(bvh_levels(field_));
    return plan;
  }

  const void* add_to(Arena& arena) const override {
    DeviceBvhField field{field_};
    move_bvh(field, arena);
    return arena.add_structure(field);
  }

 private:
  TrianglesField field_;
};

}  // namespace

FieldUpload* BvhEncoding::upload(const TrianglesField& field) { return new BvhUpload(field); }

}  // namespace nif::kernels::gpu
