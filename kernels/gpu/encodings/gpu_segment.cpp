// Uploads `segment` objects to a GPU: words for empty-space skipping and corner bricks replace an asset's own
// arrays.
#include "kernels/gpu/upload.hpp"
#include "kernels/packed/feature_grid.hpp"
#include "kernels/packed/traversal_grid.hpp"

namespace nif::kernels::gpu {
namespace {

using cpu::FeatureGrid;
using cpu::TraversalGrid;

class SegmentUpload final : public FieldUpload {
 public:
  explicit SegmentUpload(const SegmentField& field)
      : grid_(field, std::pmr::new_delete_resource()),
        corners_(field, std::pmr::new_delete_resource()),
        next_pairs_(corners_.next_pairs()),
        field_{field, grid_.view(), corners_.complete ? corners_.view() : CornerBricks(),
               next_pairs_.data()} {}

  ObjectPlan plan(bool) const override {
    const SegmentLayout layout = make_layout(field_);
    const bool pairs = field_.corner_bricks.table != nullptr;
    ObjectPlan plan;
    plan.object.kind = pairs ? kKindBit<SegmentEncoding, SegmentEncoding::kPairs>
                             : kKindBit<SegmentEncoding, SegmentEncoding::kOthers>;
    plan.object.widest = layout.widest;
    plan.row_words = kKeptWords + (field_.network.layers[0].inputs + 2 * layout.widest) / 4;
    plan.traversal_words = kKeptWords;
    plan.stages[0] = !layout.tiled ? kAlone : pairs ? kPairNetworks : kAnyNetworks;
    plan.stages[1] = kAlone;
    plan.stage_bytes = layout.bytes;
    plan.set_layout(layout);
    return plan;
  }

  const void* add_to(Arena& arena) const override {
    DeviceSegmentField field = field_;
    arena.move(field.words.voxels, grid_.voxels.size());
    arena.move(field.words.children, grid_.children.size());
    field.brick_states = nullptr;  // the traversal's words replace them
    field.voxel_base = nullptr;
    field.voxel_records = nullptr;
    field.children = nullptr;
    CornerBricks& corners = field.corner_bricks;
    if (corners.table) {
      size_t words = 1;
      for (const uint32_t voxels : field.voxels) words *= bricks_of(voxels);
      arena.move(corners.table, (words + 15) / 16);
      arena.move(corners.bricks, corners.brick_count);
      arena.move(field.next_pairs, corners.pair_count);
      corners.pairs = nullptr;
      field.brick_table = nullptr;
      field.brick_corners = nullptr;
      field.corner_base = nullptr;
      field.features = nullptr;
    } else {
      field.next_pairs = nullptr;
      arena.move(field.brick_table, size_t(field.bricks[0]) * field.bricks[1] * field.bricks[2]);
      arena.move(field.brick_corners, field.mixed_bricks);
      arena.move(field.corner_base, field.mixed_bricks);
      arena.move(field.features, size_t(field.corners) * field.features_per_corner);
    }
    for (uint32_t l = 0; l < field.network.layer_count; ++l) {
      Network::Layer& layer = field.network.layers[l];
      arena.move(layer.weights, size_t(layer.inputs) * layer.outputs);
      arena.move(layer.biases, layer.outputs);
    }
    return arena.add_structure(field);
  }

 private:
  TraversalGrid grid_;
  FeatureGrid corners_;
  std::vector<uint32_t> next_pairs_;
  DeviceSegmentField field_;
};

}  // namespace

FieldUpload* SegmentEncoding::upload(const SegmentField& field) { return new SegmentUpload(field); }

}  // namespace nif::kernels::gpu
