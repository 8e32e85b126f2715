// Uploads `proof` objects to a GPU: words for empty-space skipping replace the grid's own arrays.
#include "kernels/gpu/upload.hpp"
#include "kernels/packed/traversal_grid.hpp"

namespace nif::kernels::gpu {
namespace {

class ProofUpload final : public FieldUpload {
 public:
  explicit ProofUpload(const PlanesField& field)
      : grid_(field, std::pmr::new_delete_resource()), field_{field, grid_.view()} {}

  ObjectPlan plan(bool) const override {
    ObjectPlan plan;
    plan.object.kind = kKindBit<ProofEncoding, ProofEncoding::kProven>;
    return plan;
  }

  const void* add_to(Arena& arena) const override {
    DevicePlanesField field = field_;
    arena.move(field.words.voxels, grid_.voxels.size());
    arena.move(field.words.children, grid_.children.size());
    leave_arrays(field);
    return arena.add_structure(field);
  }

 private:
  cpu::TraversalGrid grid_;
  DevicePlanesField field_;
};

}  // namespace

FieldUpload* ProofEncoding::upload(const PlanesField& field) { return new ProofUpload(field); }

}  // namespace nif::kernels::gpu
