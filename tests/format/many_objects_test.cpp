// Files of very many objects: time and memory that go with the file's size, whatever it says.
#include "tests/support/many_objects.hpp"

#include <gtest/gtest.h>

#include <ctime>

#include "formats/nif/writer.hpp"
#include "tests/support/meter.hpp"

namespace nif {
namespace {

/// Of this thread alone, however busy the machine is.
double seconds() {
  timespec now;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return double(now.tv_sec) + 1e-9 * double(now.tv_nsec);
}

struct Cost {
  double seconds;
  size_t bytes, file_bytes;
};

Cost cost_of_reading(uint32_t objects) {
  const auto file = format::encode(test::many_objects(objects));
  test::Meter meter;
  const double start = seconds();
  const format::AssetView view = format::read_asset(file, "file", &meter);
  EXPECT_EQ(view.objects.size(), objects);
  EXPECT_EQ(view.instances.size(), objects);
  return {seconds() - start, meter.most(), file.size()};
}

TEST(ManyObjects, TakeTimeAndMemoryByTheirNumber) {
  const Cost some = cost_of_reading(10'000), many = cost_of_reading(100'000);
  EXPECT_LT(many.bytes, 4 * many.file_bytes);
  EXPECT_LT(many.seconds, 30 * some.seconds) << "ten times as many objects";
  RecordProperty("bytes_per_byte", std::to_string(double(many.bytes) / double(many.file_bytes)));
  RecordProperty("seconds", std::to_string(many.seconds));
}

}  // namespace
}  // namespace nif
