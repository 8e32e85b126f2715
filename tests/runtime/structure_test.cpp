// Programs with an older header keep working once a structure has grown. This tests a structure that nif.h does not have;
// bending_test.cpp passes a NifPose as it first was.
#include "api/structure.hpp"

#include <gtest/gtest.h>

namespace nif::runtime {

/// It once had two members, and has three today.
struct Grown {
  uint64_t struct_size, first, added;
};
template <>
inline constexpr uint64_t kFirstSize<Grown> = 16;

namespace {

struct Old {
  uint64_t struct_size, first, behind;
};

TEST(GrownStructure, IsReadAndWrittenAsFarAsAnOldProgramKnowsIt) {
  Old old{16, 5, 77};
  auto* as_new = reinterpret_cast<Grown*>(&old);
  const Grown read = read_structure(as_new, "it");
  EXPECT_EQ(read.first, 5u);
  EXPECT_EQ(read.added, 0u) << "what lies behind an old structure is not looked at";
  write_structure(as_new, Grown{0, 6, 9}, "it");
  EXPECT_EQ(old.struct_size, 16u);
  EXPECT_EQ(old.first, 6u);
  EXPECT_EQ(old.behind, 77u) << "nor written";
  old.struct_size = 24;
  EXPECT_EQ(read_structure(as_new, "it").added, 77u);
  old.struct_size = 8;
  EXPECT_THROW(read_structure(as_new, "it"), Failure);
  EXPECT_THROW(write_structure(as_new, Grown{}, "it"), Failure);
}

}  // namespace
}  // namespace nif::runtime
