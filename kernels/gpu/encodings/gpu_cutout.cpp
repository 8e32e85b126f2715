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
    plan.object.kind = kKindBit<CutoutEncoding, CutoutEncoding::kExact>;
    plan.row_words = plan.traversal_words = bvh_stack_words(bvh_levels(field_.triangles));
    return plan;
  }

  const void* add_to(Arena& arena) const override {
    CutoutField field = field_;
    move_bvh(field.triangles, arena);
    move_holes(field.holes, arena);
    return arena.add_structure(field);
  }

 private:
  CutoutField field_;
};

}  // namespace

FieldUpload* CutoutEncoding::upload(const CutoutField& field) { return new CutoutUpload(field); }

}  // namespace nif::kernels::gpu
