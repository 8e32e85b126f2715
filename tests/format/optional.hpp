// What holds of all optional sections: readers may do without them.
#pragma once

#include <gtest/gtest.h>

#include <initializer_list>

#include "formats/nif/writer.hpp"
#include "tests/format/damaged.hpp"

namespace nif::test {

/// `with` has sections of these types; `without` is the same asset without them. A reader that does not know
/// them finds the same objects. One that knows them requires all or none, and refuses any that is marked as
/// required.
inline void expect_optional(const Bytes& with, const Bytes& without, std::initializer_list<uint32_t> types) {
  Bytes unknown = with;
  for (const uint32_t type : types) {
    for (uint32_t i = 0; i < load<format::Header>(without, 0).section_count; ++i)
      EXPECT_NE(section_entry(without, i).type, type);
    const uint32_t index = find_section(with, type);
    auto entry = section_entry(with, index);
    const uint32_t payloads = entry.flags;
    EXPECT_EQ(payloads & ~uint32_t{format::kPayloads}, 0u);
    entry.flags = payloads | format::kRequired;
    Bytes required = with;
    store_entry(required, index, entry);
    fix_checksums(required);
    EXPECT_EQ(status_of(required), Status::damaged_nif);

    entry.type = format::fourcc("NEW0") + (index & 1);
    entry.flags = payloads;
    Bytes half = with;
    store_entry(half, index, entry);
    fix_checksums(half);
    EXPECT_EQ(status_of(half), Status::damaged_nif) << "one without the other";
    store_entry(unknown, index, entry);
  }
  fix_checksums(unknown);
  EXPECT_EQ(format::encode(format::to_asset(format::read_asset(unknown, "file"))), without);
}

}  // namespace nif::test
