// The `spherical` kernels in half precision: to the bit what kernels/reference/spherical/half_query.hpp says
// where no sum is rounded, and else within what the arithmetic allows.
#include <set>

#include "kernels/gpu/spherical/half_kernels.hpp"
#include "tests/gpu/half_bound.hpp"
#include "tests/gpu/loaded.hpp"

namespace nif::test {
namespace {

namespace gpu = kernels::gpu;

struct Shape {
  uint32_t features, width, layers;
};

/// A field whose sums single precision holds exactly, so that their order and rounding do not matter: latent
/// vectors are 1 to 2, weights -1, 0 or 1, and few of a neuron's are not 0. Inputs are then multiples of
/// 2^-10; each layer makes them at most 4 times as large, and a slope of 1/2 adds a bit; so at the end there
/// are at most 23.
struct ExactField {
  kernels::SphericalField field;
  std::vector<float> latents, weights[2];

  ExactField(uint64_t seed, const Shape& outer, const Shape& inner) {
    constexpr uint32_t kResolution = 5;
    const float low[3] = {-1, -2, -1}, high[3] = {1, 2, 3};
    EXPECT_TRUE(kernels::set_bounds(low, high, field));
    Random random(seed);
    latents.resize(kResolution * kResolution * kernels::kMaxSphericalFeatures);
    for (float& latent : latents) latent = random.between(1.0f, 2.0f);
    const auto grid = [&](uint32_t features) {
      return kernels::SphericalGrid{{latents.data(), false}, kResolution, features};
    };
    field.outer_position = field.outer_direction = grid(outer.features);
    field.inner_position = field.inner_direction = grid(inner.features);
    field.distance = grid(1);
    field.slope = 0.5f;
    field.outer = network(random, 2 * outer.features, outer, weights[0]);
    field.inner = network(random, 2 * inner.features + 1, inner, weights[1]);
  }

  static kernels::SphericalNetwork network(Random& random, uint32_t inputs, const Shape& shape,
                                           std::vector<float>& to) {
    const auto layer = [&](uint32_t from, uint32_t outputs, uint32_t used) {
      const size_t at = to.size();
      to.resize(at + size_t(from) * outputs);
      for (uint32_t o = 0; o < outputs; ++o)
        for (uint32_t k = 0; k < used; ++k)
          to[at + random.below(from) * outputs + o] = random.below(2) ? 1.0f : -1.0f;
    };
    for (uint32_t l = 0; l < shape.layers; ++l) layer(l == 0 ? inputs : shape.width, shape.width, 4);
    layer(shape.width, 1, 8);
    return {{to.data(), false}, inputs, shape.width, shape.layers, 1};
  }

  std::vector<kernels::Segment> segments(uint64_t seed, uint32_t count) const {
    Random random(seed);
    std::vector<kernels::Segment> segments;
    for (uint32_t i = 0; i < count; ++i) segments.push_back(random_segment(random, field));
    return segments;
  }
};

class GpuSphericalHalfTest : public GpuWayTest {
 protected:
  static ObjectAnswers ask(const kernels::SphericalField& field,
                           const std::vector<kernels::Segment>& segments) {
    EXPECT_TRUE(gpu::make_half_layout(field).fits);
    return ObjectOnGpu(field, GetParam()).ask(segments);
  }
  static void expect_exact(const kernels::SphericalField& field,
                           const std::vector<kernels::Segment>& segments) {
    const ObjectAnswers answers = ask(field, segments);
    for (size_t i = 0; i < segments.size(); ++i) {
      const kernels::Answer expected = kernels::query_spherical_half(field, segments[i]);
      ASSERT_EQ(answers.logit[i], expected.logit) << "ray " << i;
      ASSERT_EQ(answers.certain[i], uint8_t(expected.certain)) << "ray " << i;
    }
  }
};
std::vector<EmulatedWay> half_ways() {
  std::vector<EmulatedWay> ways;
  // gfx90a and gfx942 have the same instruction for halves.
  for (const MatrixKind kind :
       {MatrixKind::dot32, MatrixKind::dot64, MatrixKind::wmma, MatrixKind::mfma32, MatrixKind::imma})
    ways.push_back({kind, runtime::GpuWay::automatic, true});
  return ways;
}
INSTANTIATE_TEST_SUITE_P(Each, GpuSphericalHalfTest, testing::ValuesIn(half_ways()), name_of_way);

constexpr Shape kPaperOuter{3, 64, 2}, kPaperInner{5, 48, 3};

TEST_P(GpuSphericalHalfTest, AnswersAsDefinedWhereSumsAreExact) {
  const ExactField exact(1, kPaperOuter, kPaperInner);
  const auto segments = exact.segments(2, 4000);
  expect_exact(exact.field, segments);
  uint32_t outer = 0, inner = 0;
  for (const kernels::Segment& segment : segments) {
    const kernels::SphericalKind kind = kernels::prepare_spherical(exact.field, segment).kind;
    outer += kind == kernels::SphericalKind::outer;
    inner += kind == kernels::SphericalKind::inner;
  }
  EXPECT_GT(outer, 500u);
  EXPECT_GT(inner, 500u);
  // The answers are not all alike, or dealing neurons and rays wrongly would not show.
  const ObjectAnswers answers = ask(exact.field, segments);
  EXPECT_GT(std::set<int32_t>(answers.logit.begin(), answers.logit.end()).size(), 500u);
}

TEST_P(GpuSphericalHalfTest, AnswersByNetworksOfAnyShape) {
  const Shape shapes[] = {{1, 4, 1},  {8, 4, 3},  {2, 12, 2}, {3, 16, 1}, {4, 20, 3}, {5, 32, 2}, {7, 48, 1},
                          {8, 60, 2}, {3, 64, 3}, {6, 80, 2}, {3, 80, 3}, {8, 96, 1}, {3, 96, 2}, {3, 88, 2}};
  for (size_t i = 0; i < std::size(shapes); ++i) {
    const ExactField exact(i, shapes[i], shapes[(i + 5) % std::size(shapes)]);
    expect_exact(exact.field, exact.segments(i, 600));
  }
}

/// The order of items is random; the answers are not.
TEST_P(GpuSphericalHalfTest, AnswersDoNotDependOnTheOrder) {
  const ExactField exact(3, kPaperOuter, kPaperInner);
  for (const uint64_t order : {1u, 2u, 12345u}) {
    machine().order = order;
    machine().processors = 1 + uint32_t(order % 5);
    expect_exact(exact.field, exact.segments(3, 2000));
  }
}

TEST_P(GpuSphericalHalfTest, AnswersBatchesOfAnySize) {
  const ExactField exact(4, kPaperOuter, kPaperInner);
  for (const uint32_t count : {0u, 1u, 15u, 16u, 17u, 31u, 32u, 33u, 63u, 64u, 65u, 127u, 128u, 129u})
    expect_exact(exact.field, exact.segments(count, count));
}

TEST_P(GpuSphericalHalfTest, AnswersInvalidRays) {
  const ExactField exact(5, kPaperOuter, kPaperInner);
  auto segments = exact.segments(5, 3000);
  spoil(segments, 6);
  expect_exact(exact.field, segments);
}

/// On networks of any weights, in both precisions of grids and of weights.
TEST_P(GpuSphericalHalfTest, StaysWithinWhatTheArithmeticAllows) {
  uint32_t asked = 0, sure = 0;
  for (uint64_t seed = 0; seed < 8; ++seed) {
    const Loaded asset(seed,
                       {.objects = 0, .instances = 0, .max_voxels = seed % 2 ? 14u : 40u, .sphericals = 2});
    for (const format::ObjectView& object : asset.view.objects) {
      const kernels::SphericalField& field = object.as<kernels::SphericalField>();
      ASSERT_TRUE(gpu::make_half_layout(field).fits);
      const auto segments = random_segments(object, seed, 1000);
      machine().order = seed;
      const ObjectAnswers answers = ask(field, segments);
      for (size_t i = 0; i < segments.size(); ++i) {
        const kernels::Answer expected = kernels::query(field, segments[i]);
        const double bound = half_bound(field, segments[i]), unit = double(kernels::kSphericalLogitUnit);
        ASSERT_LE(std::fabs(double(answers.logit[i]) - double(expected.logit)), bound * unit) << "ray " << i;
        // A probability moves by at most a quarter of what its log-odds move by.
        ASSERT_LE(std::fabs(probability_of(answers.logit[i]) - probability_of(expected.logit)), bound / 4);
        ASSERT_EQ(answers.certain[i], uint8_t(expected.certain)) << "ray " << i;
        asked += bound > 0;
        sure += bound > 0 && std::fabs(double(expected.logit)) > bound * unit;
        if (std::fabs(double(expected.logit)) > bound * unit) {
          ASSERT_EQ(answers.logit[i] >= 0, expected.visible) << "ray " << i;
        }
      }
    }
  }
  EXPECT_GT(asked, 3000u);
  EXPECT_GT(sure, asked / 2);  // the bound says something
}

/// Values too large for half precision become its largest value, never an infinity or NaN.
TEST_P(GpuSphericalHalfTest, AnswersWhereHalvesOverflow) {
  ExactField exact(6, kPaperOuter, kPaperInner);
  for (float& latent : exact.latents) latent *= 2000;
  for (auto& weights : exact.weights)
    for (float& weight : weights) weight *= 4096;
  const auto segments = exact.segments(6, 1000);
  const ObjectAnswers answers = ask(exact.field, segments);
  const auto most = int32_t(kernels::kMaxSphericalOutput * kernels::kSphericalLogitUnit);
  for (size_t i = 0; i < segments.size(); ++i) {
    const kernels::Answer expected = kernels::query_spherical_half(exact.field, segments[i]);
    ASSERT_EQ(answers.logit[i] >= 0, expected.visible) << "ray " << i;
    ASSERT_TRUE(expected.certain || answers.logit[i] == kernels::kCertainLogit ||
                std::abs(answers.logit[i]) <= most);
  }
}

/// The paper's networks fit, wider ones up to 96 do by other kernels, or say that they do not.
TEST(GpuSphericalHalf, LayoutsFit) {
  kernels::SphericalField field;
  field.outer = {{}, 6, 64, 2, 1};
  field.inner = {{}, 13, 48, 3, 1};
  EXPECT_TRUE(gpu::make_half_layout(field).fits);
  EXPECT_EQ(gpu::make_half_layout(field).tiles, gpu::kHalfTiles);
  // The inner one: 48 rows of 16 halves and twice 48 of 48, 256 rows of 16, each with 16 bytes more; 48
  // floats.
  EXPECT_EQ(gpu::make_half_layout(field).bytes, 48u * 48 + 2 * 48 * 112 + 256 * 48 + 48 * 4);
  field.outer.width = 96;
  EXPECT_TRUE(gpu::make_half_layout(field).fits);
  EXPECT_EQ(gpu::make_half_layout(field).tiles, gpu::kMostHalfTiles);
  for (uint32_t width = 4; width <= kernels::kMaxSphericalWidth; width += 4)
    for (uint32_t inputs = 2; inputs <= kernels::kMaxSphericalInputs; ++inputs) {
      field.outer = {{}, inputs, width, 3, 1};
      const gpu::SphericalHalfLayout layout = gpu::make_half_layout(field);
      EXPECT_EQ(layout.outer.stride / 16 % 2, 1u);
      EXPECT_EQ(layout.outer.first_stride / 16 % 2, 1u);
      EXPECT_TRUE(!layout.fits || (width <= 96 && layout.bytes <= gpu::kSharedLimit));
      EXPECT_TRUE(layout.fits || width > 64);
    }
}

}  // namespace
}  // namespace nif::test
