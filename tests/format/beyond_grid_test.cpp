// Surface voxels beyond a grid, which once made a loader read beyond its tables, in every encoding that has a
// grid; and the version of the format in which that was found.
#include <gtest/gtest.h>

#include "tests/support/beyond_grid.hpp"

namespace nif {
namespace {

using test::BeyondGrid, test::Bytes, test::ExactBuffer, test::FileBeyondGrid;

/// Found by fuzzing: the loader read beyond its tables.
TEST(Damage, SurfaceBitsBeyondTheGrid) {
  for (const BeyondGrid& kind : test::kBeyondGrid) {
    const FileBeyondGrid file = test::file_beyond_grid(kind);
    EXPECT_EQ(test::status_of(file.good), Status::ok) << kind.encoding;
    const ExactBuffer bytes(file.bad);
    const test::ReadOutcome outcome = test::outcome_of(bytes.bytes());
    EXPECT_EQ(outcome.status, Status::damaged_nif) << kind.encoding;
    EXPECT_EQ(outcome.sentence, std::string("x.nif: ") + test::kBeyondGridSentence);
  }
}

/// The writer makes no such file.
TEST(Damage, SurfaceBitsBeyondTheGridAreNotWritten) {
  for (const BeyondGrid& kind : test::kBeyondGrid)
    for (const uint32_t coded : {0u, test::kCodedAll}) {
      FileBeyondGrid file = test::file_beyond_grid(kind);
      test::set_coded(coded, file.asset.objects[0]);
      EXPECT_THROW(format::encode(file.asset), Error) << kind.encoding << ' ' << coded;
    }
}

/// The same through a record with a smaller grid than its bricks, coded or not.
TEST(Damage, GridsThatAreCutShort) {
  for (const BeyondGrid& kind : test::kBeyondGrid)
    for (uint64_t seed = 1; seed <= 40; ++seed)
      for (const uint32_t coded : {0u, test::kCodedAll}) {
        test::RandomAssetOptions options = kind.one_object;
        options.coded = coded;
        const Bytes file = format::encode(test::random_asset(seed, options));
        for (size_t axis = 0; axis < 3; ++axis) {
          const Bytes cut = test::with_record<format::PlanesRecord>(file, format::kPlanes, 0,
                                                                    [&](auto& r) { --r.voxels[axis]; });
          const ExactBuffer bytes(cut);
          const test::ReadOutcome outcome = test::outcome_of(bytes.bytes());
          // A layer of empty voxels may be dropped.
          if (outcome.status == Status::ok) continue;
          EXPECT_EQ(outcome.status, Status::damaged_nif) << kind.encoding << ' ' << seed << ' ' << axis;
          EXPECT_NE(outcome.sentence.find("record 0: "), std::string::npos) << outcome.sentence;
        }
      }
}

/// Whatever else is wrong with the file, including its grid.
TEST(Damage, VersionOneGetsItsSentence) {
  for (const BeyondGrid& kind : test::kBeyondGrid)
    for (const bool damaged : {false, true}) {
      const FileBeyondGrid both = test::file_beyond_grid(kind);
      Bytes file = damaged ? both.bad : both.good;
      auto header = test::load<format::Header>(file, 0);
      header.version = 1;
      test::store(file, 0, header);
      test::fix_checksums(file);
      const test::ReadOutcome outcome = test::outcome_of(file);
      EXPECT_EQ(outcome.status, Status::unsupported_nif);
      EXPECT_EQ(outcome.sentence, "x.nif: header: format version 1 is no longer read; bake the mesh again");
    }
}

}  // namespace
}  // namespace nif
