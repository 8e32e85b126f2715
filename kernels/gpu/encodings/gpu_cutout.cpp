// Uploads `cutout` objects to a GPU.
#include "kernels/gpu/encodings/gpu_cutout.hpp"

#include "kernels/gpu/holes/upload_holes.hpp"
#include "kernels/gpu/triangles/upload_triangles.hpp"
#include "kernels/gpu/upload.hpp"

namespace nif::kernels::gpu {
namespace {

class CutoutUpload final : public FieldUpload {
 public:
  explicit CutoutUpload(const CutoutField& field) : field_(field) {}

  ObjectPlan plan(bool) const override {
    ObjectPlan plan;
    plan.object.kind = kKindBit<BvhEncoding, BvhEncoding::kHoles>;
    plan.row_words = plan.traversal_words = bvh_stack_words(bvh_levels(field_.triangles));
    return plan;
  }

  const void* add_to(Arena& arena) const override {
    DeviceBvhField field{field_.triangles};
    move_bvh(field, arena);
    HolesField holes = field_.holes;
    move_holes(holes, arena);
    field.holes = arena.add_structure(holes);
    return arena.add_structure(field);
  }

 private:
  CutoutField field_;
};

}  // namespace

FieldUpload* CutoutEncoding::upload(const CutoutField& field) { return new CutoutUpload(field); }

}  // namespace nif::kernels::gpu
