// Uploads `exact` objects to a GPU: words for empty-space skipping replace the grid's own arrays.
#include "kernels/gpu/triangles/upload_triangles.hpp"
#include "kernels/packed/traversal_grid.hpp"

namespace nif::kernels::gpu {
namespace {

class ExactUpload final : public FieldUpload {
 public:
  explicit ExactUpload(const ExactField& field)
      : grid_(field.planes, std::pmr::new_delete_resource()), field_{field, grid_.view()} {}

  ObjectPlan plan(bool) const override {
    ObjectPlan plan;
    plan.object.kind = kKindBit<ExactEncoding, ExactEncoding::kProvenFirst>;
    plan.row_words = plan.traversal_words = bvh_stack_words(bvh_levels(field_.triangles));
    return plan;
  }

  const void* add_to(Arena& arena) const override {
    DeviceExactField field = field_;
    arena.move(field.words.voxels, grid_.voxels.size());
    arena.move(field.words.children, grid_.children.size());
    leave_arrays(field.planes);
    move_bvh(field.triangles, arena);
    return arena.add_structure(field);
  }

 private:
  cpu::TraversalGrid grid_;
  DeviceExactField field_;
};

}  // namespace

FieldUpload* ExactEncoding::upload(const ExactField& field) { return new ExactUpload(field); }

}  // namespace nif::kernels::gpu
