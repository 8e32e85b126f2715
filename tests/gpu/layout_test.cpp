// The fingerprint by which the runtime and its GPU module check that they match: any change of a layout
// changes it, and a module with another one is refused.
#include "runtime/src/gpu/layout.hpp"

#include <gtest/gtest.h>
#include <nif/nif.hpp>

#include <string>

#include "runtime/src/gpu/crossing.hpp"

namespace nif::runtime {
namespace {

struct Small {
  uint32_t a;
  uint16_t b;
};
struct Large {
  double a, b;
};
struct Swapped {
  uint16_t b;
  uint32_t a;
};
struct Moved {
  uint16_t b, c;
  uint32_t a;
};

template <class... Add>
constexpr uint64_t hash_of(const Add&... add) {
  LayoutHash hash;
  (add(hash), ...);
  return hash.value();
}
constexpr auto kSmall = [](LayoutHash& hash) { hash.structure<Small>({&Small::a, &Small::b}); };
constexpr auto kLarge = [](LayoutHash& hash) { hash.structure<Large>({&Large::a, &Large::b}); };

TEST(LayoutHash, TellsTheOrderOfSizes) {
  EXPECT_EQ(hash_of(kSmall, kLarge), hash_of(kSmall, kLarge));
  EXPECT_NE(hash_of(kSmall, kLarge), hash_of(kLarge, kSmall)) << "their sum is the same";
  const auto number = [](uint64_t n) { return [n](LayoutHash& hash) { hash.number(n); }; };
  EXPECT_NE(hash_of(number(8), number(16)), hash_of(number(16), number(8)));
  EXPECT_NE(hash_of(number(8), number(16)), hash_of(number(9), number(15)));
}

/// Structures of one size and alignment whose members lie elsewhere.
TEST(LayoutHash, TellsWhereMembersAre) {
  static_assert(sizeof(Small) == sizeof(Swapped) && alignof(Small) == alignof(Swapped));
  const uint64_t small = hash_of(kSmall);
  const uint64_t swapped = hash_of([](LayoutHash& hash) {
    hash.structure<Swapped>({&Swapped::b, &Swapped::a});
  });
  const uint64_t moved = hash_of([](LayoutHash& hash) {
    hash.structure<Moved>({&Moved::b, &Moved::c, &Moved::a});
  });
  EXPECT_NE(small, swapped);
  EXPECT_NE(small, moved);
  EXPECT_NE(swapped, moved);
}

/// When it is not computed by the compiler it throws.
TEST(LayoutHash, RefusesAListWithoutAMember) {
  LayoutHash hash;
  EXPECT_ANY_THROW(hash.structure<Large>({&Large::a}));
  EXPECT_ANY_THROW(hash.structure<Small>({&Small::b, &Small::a, &Small::b}));
}

/// NIF_OTHER_MODULE is like a real module except for its layout (other_module.cpp).
TEST(LayoutHash, OfAnotherModuleIsRefused) {
  const auto code = [](const char* module) {
    NifDevice device = nullptr;
    const NifError error =
        nifNewDevice((std::string("backend=gpu,module=") + module).c_str(), nullptr, &device);
    nifReleaseDevice(device);
    return error;
  };
  EXPECT_EQ(code(NIF_EMULATED_MODULE), NIF_OK) << nifGetErrorMessage();
  EXPECT_EQ(code(NIF_OTHER_MODULE), NIF_ERROR_NOT_AVAILABLE);
  EXPECT_NE(std::string(nifGetErrorMessage()).find("is of another version than this library"),
            std::string::npos)
      << nifGetErrorMessage();
}

}  // namespace
}  // namespace nif::runtime
