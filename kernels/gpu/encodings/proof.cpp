// Uploads `proof` objects to a GPU: words for empty-space skipping replace the grid's own arrays.
#include "kernels/gpu/upload.hpp"
#include "kernels/packed/walk_grid.hpp"

namespace nif::kernels::gpu {
namespace {

class ProofUpload final : public FieldUpload {
 public:
  explicit ProofUpload(const PlanesField& field)
      : walk_(field, std::pmr::new_delete_resource()), field_{field, walk_.view()} {}

  ObjectPlan plan(bool) const override {
    ObjectPlan plan;
    plan.object.kind = kKindBit<ProofEncoding, ProofEncoding::kProven>;
    return plan;
  }

  const void* add_to(Arena& arena) const override {
    DevicePlanesField field = field_;
    arena.move(field.walk.voxels, walk_.voxels.size());
    arena.move(field.walk.parts, walk_.parts.size());
    leave_arrays(field);
    return arena.add_structure(field);
  }

 private:
  cpu::WalkGrid walk_;
  DevicePlanesField field_;
};

}  // namespace

FieldUpload* ProofEncoding::upload(const PlanesField& field) { return new ProofUpload(field); }

}  // namespace nif::kernels::gpu
