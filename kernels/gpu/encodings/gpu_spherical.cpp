// Uploads `spherical` objects to a GPU.
#include "kernels/gpu/upload.hpp"

namespace nif::kernels::gpu {
namespace {

void add_values(Arena& arena, SphericalValues& values, size_t count) {
  values.data = arena.add(values.data, count * (values.half ? sizeof(uint16_t) : sizeof(float)));
}

class SphericalUpload final : public FieldUpload {
 public:
  explicit SphericalUpload(const SphericalField& field) : field_(field) {}

  ObjectPlan plan(bool half) const override {
    ObjectPlan plan;
    plan.object.kind = kKindsOf<SphericalEncoding>;
    for (const uint32_t width :
         {field_.outer.inputs, field_.outer.width, field_.inner.inputs, field_.inner.width})
      if (width > plan.object.widest) plan.object.widest = width;
    plan.row_words = 2 * plan.object.widest;
    plan.traversal_words = kItemCoordinates;
    plan.stages[0] = plan.stages[1] = kAlone;
    if (!half) return plan;
    const SphericalHalfLayout layout = make_half_layout(field_);
    plan.set_layout(layout);
    plan.stage_bytes = layout.bytes;
    if (!layout.fits) return plan;
    const bool narrow = layout.tiles == kHalfTiles;
    plan.stages[0] = narrow ? kNarrowOuter : kWideOuter;
    plan.stages[1] = narrow ? kNarrowInner : kWideInner;
    return plan;
  }

  const void* add_to(Arena& arena) const override {
    SphericalField field = field_;
    for (SphericalGrid* grid :
         {&field.outer_position, &field.outer_direction, &field.inner_position, &field.inner_direction})
      add_values(arena, grid->values, size_t(grid->resolution) * grid->resolution * grid->features);
    add_values(arena, field.distance.values, size_t(field.distance.resolution) * field.distance.features);
    for (SphericalNetwork* network : {&field.outer, &field.inner})
      add_values(arena, network->weights, spherical_weights(*network));
    return arena.add_structure(field);
  }

 private:
  SphericalField field_;
};

}  // namespace

FieldUpload* SphericalEncoding::upload(const SphericalField& field) { return new SphericalUpload(field); }

}  // namespace nif::kernels::gpu
