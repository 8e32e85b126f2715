// Uploads `exact` objects to a GPU: words for empty-space skipping replace the grid's own arrays.
#include "kernels/gpu/triangles/upload.hpp"
#include "kernels/packed/walk_grid.hpp"

namespace nif::kernels::gpu {
namespace {

class ExactUpload final : public FieldUpload {
 public:
  explicit ExactUpload(const ExactField& field)
      : walk_(field.planes, std::pmr::new_delete_resource()), field_{field, walk_.view()} {}

  ObjectPlan plan(bool) const override {
    ObjectPlan plan;
    plan.object.kind = kKindBit<ExactEncoding, ExactEncoding::kProvenFirst>;
    plan.row_words = plan.walk_words = bvh_stack_words(bvh_levels(field_.triangles));
    return plan;
  }

  const void* add_to(Arena& arena) const override {
    DeviceExactField field = field_;
    arena.move(field.walk.voxels, walk_.voxels.size());
    arena.move(field.walk.parts, walk_.parts.size());
    leave_arrays(field.planes);
    move_bvh(field.triangles, arena);
    return arena.add_structure(field);
  }

 private:
  cpu::WalkGrid walk_;
  DeviceExactField field_;
};

}  // namespace

FieldUpload* ExactEncoding::upload(const ExactField& field) { return new ExactUpload(field); }

}  // namespace nif::kernels::gpu
