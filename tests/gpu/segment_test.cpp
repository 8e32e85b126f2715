// The `segment` kernels give the reference's answers, to the bit, for any instructions, size of waves, and
// order of blocks, waves and lanes.
#include "tests/gpu/loaded.hpp"

#include "kernels/gpu/network/network_kernels.hpp"

namespace nif::test {
namespace {

namespace gpu = kernels::gpu;

/// How many rays the traversal leaves open, and how many of those have more intervals than fit into items.
struct OpenRays {
  uint32_t open = 0, hard = 0;

  void add(const kernels::SegmentField& field, const std::vector<kernels::Segment>& segments) {
    for (const kernels::Segment& segment : segments) {
      kernels::FullTraversal traversal;
      kernels::traverse_segment(field, segment, traversal);
      if (traversal.verdict != kernels::Verdict::open) continue;
      ++open;
      hard += traversal.interval_count > gpu::kKeptIntervals;
    }
  }
};

class GpuSegmentTest : public GpuWayTest {};
INSTANTIATE_TEST_SUITE_P(Each, GpuSegmentTest, testing::ValuesIn(all_ways()), name_of_way);

TEST_P(GpuSegmentTest, AnswersAsTheReference) {
  OpenRays rays;
  for (uint64_t seed = 0; seed < 12; ++seed) {
    const Loaded asset(seed, {.objects = 2,
                              .instances = 0,
                              .max_voxels = seed % 2 ? 14u : 40u,
                              .features = seed % 3 == 0 ? 0u : 2u,
                              .odd_corners = seed % 4 == 1});
    for (const format::ObjectView& object : asset.view.objects) {
      const auto segments = random_segments(object, seed, 1000 + 37 * uint32_t(seed));
      expect_reference(object, segments, GetParam());
      rays.add(object.as<kernels::SegmentField>(), segments);
    }
  }
  EXPECT_GT(rays.open, 500u);
}

TEST_P(GpuSegmentTest, AnswersRaysOfManyIntervals) {
  const Loaded asset(2, {.objects = 2, .instances = 0, .max_voxels = 60, .features = 2});
  OpenRays rays;
  for (const format::ObjectView& object : asset.view.objects) {
    const auto segments = random_segments(object, 2, 3000);
    expect_reference(object, segments, GetParam());
    rays.add(object.as<kernels::SegmentField>(), segments);
  }
  EXPECT_GT(rays.open, 100u);
  EXPECT_GT(rays.hard, 100u);
}

TEST_P(GpuSegmentTest, AnswersInvalidRays) {
  const Loaded asset(5, {.objects = 1, .instances = 0, .max_voxels = 14, .features = 2});
  auto segments = random_segments(asset.view.objects[0], 5, 6000);
  spoil(segments, 6);
  expect_reference(asset.view.objects[0], segments, GetParam());
}

/// The order of items in the lists is random; the answers are not.
TEST_P(GpuSegmentTest, AnswersDoNotDependOnTheOrder) {
  const Loaded asset(3, {.objects = 1, .instances = 0, .max_voxels = 40, .features = 2});
  const auto segments = random_segments(asset.view.objects[0], 3, 3000);
  for (const uint64_t order : {1u, 2u, 12345u}) {
    machine().order = order;
    machine().processors = 1 + uint32_t(order % 7);
    expect_reference(asset.view.objects[0], segments, GetParam());
  }
}

TEST_P(GpuSegmentTest, AnswersBatchesOfAnySize) {
  const Loaded asset(7, {.objects = 1, .instances = 0, .max_voxels = 30, .features = 2});
  const ObjectOnGpu gpu(format::field_of(asset.view.objects[0]), GetParam());
  for (const uint32_t count :
       {0u, 1u, 2u, 15u, 16u, 17u, 31u, 32u, 33u, 63u, 64u, 65u, 127u, 128u, 129u, 500u}) {
    const auto segments = random_segments(asset.view.objects[0], 7, count);
    expect_reference(asset.view.objects[0], segments, gpu.ask(segments));
  }
}

/// A network with hidden layers of the given widths, instead of the asset's own.
struct OtherNetwork {
  format::Mlp network;
  kernels::SegmentField field;

  OtherNetwork(const kernels::SegmentField& of, const std::vector<uint32_t>& widths) : field(of) {
    Random random(widths.size());
    uint32_t inputs = of.network.layers[0].inputs;
    for (size_t l = 0; l <= widths.size(); ++l) {
      format::Layer layer;
      layer.inputs = inputs;
      layer.outputs = l < widths.size() ? widths[l] : 1;
      layer.shift = l < widths.size() ? 7 : 0;
      for (uint32_t i = 0; i < layer.outputs; ++i) layer.biases.push_back(random.between(-3000, 3000));
      for (uint32_t i = 0; i < layer.outputs * inputs; ++i)
        layer.weights.push_back(int8_t(random.between(-127, 127)));
      inputs = layer.outputs;
      network.layers.push_back(std::move(layer));
    }
    field.network.layer_count = uint32_t(network.layers.size());
    for (size_t l = 0; l < network.layers.size(); ++l) {
      const format::Layer& layer = network.layers[l];
      field.network.layers[l] = {layer.inputs, layer.outputs, layer.shift, layer.weights.data(),
                                 layer.biases.data()};
    }
  }
};

TEST_P(GpuSegmentTest, AnswersByNetworksOfAnyShape) {
  const Loaded asset(9, {.objects = 1, .instances = 0, .max_voxels = 30, .features = 2});
  const std::vector<uint32_t> shapes[] = {{},       {4},        {32, 32},    {48, 48},     {20, 44, 36},
                                          {16, 48}, {128, 128}, {52, 4, 48}, {4, 128, 128}};
  for (const auto& widths : shapes) {
    const OtherNetwork other(asset.view.objects[0].as<kernels::SegmentField>(), widths);
    const gpu::SegmentLayout layout = gpu::make_layout(other.field);
    EXPECT_EQ(layout.tiled, widths.empty() || *std::max_element(widths.begin(), widths.end()) <= 48);
    format::ObjectView object = asset.view.objects[0];
    format::NetworkView network = *object.network;
    network.field = other.field;
    object.network = &network;
    expect_reference(object, random_segments(object, 9, 700), GetParam());
  }
}

/// Rows of weights are in different banks, and the tiles fit.
TEST(GpuSegment, LayoutsFit) {
  const Loaded asset(9, {.objects = 1, .instances = 0, .max_voxels = 8, .features = 2});
  OtherNetwork other(asset.view.objects[0].as<kernels::SegmentField>(), {48, 48});
  for (uint32_t inputs = 8; inputs <= kernels::kMaxInputs; inputs += 4) {
    other.field.network.layers[0].inputs = inputs;
    const gpu::SegmentLayout layout = gpu::make_layout(other.field);
    EXPECT_EQ(layout.stride / 4 % 8, 4u);
    EXPECT_TRUE(!layout.tiled || layout.bytes <= gpu::kSharedLimit);
  }
}

}  // namespace
}  // namespace nif::test
