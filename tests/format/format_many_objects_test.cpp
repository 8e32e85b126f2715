// Files of very many objects: memory that goes with the file's size, whatever it says. Of the work
// tests/runtime/work_test.cpp asks.
#include "tests/support/many_objects.hpp"

#include <gtest/gtest.h>

#include "formats/nif/writer.hpp"
#include "tests/support/test_meter.hpp"

namespace nif {
namespace {

TEST(ManyObjects, TakeMemoryByTheirNumber) {
  constexpr uint32_t kObjects = 100'000;
  const auto file = format::encode(test::many_objects(kObjects));
  test::Meter meter;
  const format::AssetView view = format::read_asset(file, "file", &meter);
  EXPECT_EQ(view.objects.size(), kObjects);
  EXPECT_EQ(view.instances.size(), kObjects);
  EXPECT_LT(meter.most(), 4 * file.size());
  RecordProperty("bytes_per_byte", std::to_string(double(meter.most()) / double(file.size())));
}

}  // namespace
}  // namespace nif
