// Files of very many objects: time and memory that go with the file's size, whatever it says.
#include "tests/support/many_objects.hpp"

#include <gtest/gtest.h>

#include <ctime>

#include "formats/nif/writer.hpp"

namespace nif {
namespace {

/// Of this thread alone, however busy the machine is.
double seconds() {
  timespec now;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return double(now.tv_sec) + 1e-9 * double(now.tv_nsec);
}

/// Knows the most that was held at a time.
class Meter : public std::pmr::memory_resource {
 public:
  size_t most() const { return most_; }

 private:
  void* do_allocate(size_t bytes, size_t alignment) override {
    most_ = std::max(most_, held_ += bytes);
    return std::pmr::new_delete_resource()->allocate(bytes, alignment);
  }
  void do_deallocate(void* memory, size_t bytes, size_t alignment) override {
    held_ -= bytes;
    std::pmr::new_delete_resource()->deallocate(memory, bytes, alignment);
  }
  bool do_is_equal(const memory_resource& other) const noexcept override { return this == &other; }

  size_t held_ = 0, most_ = 0;
};

struct Cost {
  double seconds;
  size_t bytes, file_bytes;
};

Cost cost_of_reading(uint32_t objects) {
  const auto file = format::encode(test::many_objects(objects));
  Meter meter;
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
