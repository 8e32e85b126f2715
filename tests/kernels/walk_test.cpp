// The reference's walk at the ends of what single precision can say.
#include <gtest/gtest.h>

#include <limits>
#include <stdexcept>

#include "formats/nif/reader.hpp"
#include "formats/nif/writer.hpp"
#include "kernels/reference/segment/walk.hpp"
#include "tests/support/random_asset.hpp"

namespace nif::test {
namespace {

using kernels::Segment;
using kernels::Verdict;
using kernels::WalkResult;

/// From so far, at so slow a pace, that t overflows before the grid is reached: this walked on the spot for
/// ever.
TEST(Walk, EndsWhereEveryCrossingOverflows) {
  const std::vector<std::byte> file = format::encode(random_asset(1));
  const format::AssetView asset = format::read_asset(file, "test");
  const kernels::SegmentField& field = asset.objects[0].as<format::SegmentView>().field;
  const float infinity = std::numeric_limits<float>::infinity();
  for (const float side : {-1.0f, 1.0f})
    for (int axis = 0; axis < 3; ++axis)
      for (const float tmin : {0.0f, -infinity}) {
        Segment segment{{field.origin[0], field.origin[1], field.origin[2]}, {0, 0, 0}, tmin, infinity};
        segment.origin[axis] = side * 1e37f;
        segment.direction[axis] = -side * 0x1p-58f / field.voxels_per_unit;
        WalkResult walk;
        uint32_t voxels = 0;
        kernels::follow_segment(
            field, segment, walk, [](uint32_t, const kernels::Run&) {},
            [&](const int32_t(&)[3]) {
              if (++voxels > 1000) throw std::runtime_error("the walk does not end");
            });
        EXPECT_EQ(walk.verdict, Verdict::visible);
        EXPECT_FALSE(walk.certain);
      }
}

}  // namespace
}  // namespace nif::test
