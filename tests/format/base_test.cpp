// Small helpers of formats/base: what names of files tell, and quantities as text.
#include <gtest/gtest.h>

#include "formats/base/file_name.hpp"
#include "formats/base/quantities.hpp"

namespace nif {
namespace {

TEST(FileName, EndingIsInSmallLetters) {
  EXPECT_EQ(ending_of("a/Dragon.PLY"), ".ply");
  EXPECT_EQ(ending_of("dragon.ply.gz"), ".gz");
  EXPECT_EQ(ending_of("a.b/dragon"), "");
}

TEST(FileName, IsUnpackedOnce) {
  EXPECT_EQ(unpacked_name("a/dragon.ply.gz"), "dragon.ply");
  EXPECT_EQ(unpacked_name("a/Dragon.PLY.ZST"), "Dragon.PLY");
  EXPECT_EQ(unpacked_name("a/dragon.ply"), "dragon.ply");
  EXPECT_EQ(unpacked_name("dragon.gz"), "dragon");
}

TEST(Quantities, BytesInPowersOfAThousand) {
  EXPECT_EQ(format_bytes(0), "0 B");
  EXPECT_EQ(format_bytes(999), "999 B");
  EXPECT_EQ(format_bytes(1000), "1.0 kB");
  EXPECT_EQ(format_bytes(152'340), "152.3 kB");
  EXPECT_EQ(format_bytes(1.5e6), "1.5 MB");
  EXPECT_EQ(format_bytes(12.345e9), "12.35 GB");
  EXPECT_EQ(format_bytes(1e300).size(), 292 + 6);
}

TEST(Quantities, CountsWithTheirNoun) {
  EXPECT_EQ(count_of(0, "ray"), "0 rays");
  EXPECT_EQ(count_of(1, "ray"), "1 ray");
  EXPECT_EQ(count_of(UINT64_MAX, "ray"), "18446744073709551615 rays");
}

}  // namespace
}  // namespace nif
