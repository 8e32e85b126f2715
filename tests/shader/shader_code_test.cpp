// What compilers make of kernels/shader/nif.glsl: no arithmetic that a driver may fuse or reorder.
#include <set>

#include "tests/shader/shader_fixture.hpp"

namespace nif::test {
namespace {

// Numbers of SPIR-V's specification.
constexpr uint32_t kOpDecorate = 71, kNoContraction = 42;
constexpr bool rounds(uint32_t operation) {
  switch (operation) {
    case 129:  // OpFAdd
    case 131:  // OpFSub
    case 133:  // OpFMul
    case 136:  // OpFDiv
    case 140:  // OpFRem
    case 141:  // OpFMod
    case 142:  // OpVectorTimesScalar
    case 148:  // OpDot
      return true;
    default:
      return false;
  }
}

struct Arithmetic {
  size_t operations = 0, loose = 0;  ///< those that round, and those of them that may be contracted
};
Arithmetic arithmetic_of(const std::vector<uint32_t>& code) {
  constexpr size_t kHeader = 5;
  std::set<uint32_t> precise;
  Arithmetic found;
  // Decorations come before functions.
  for (size_t at = kHeader; at < code.size(); at += code[at] >> 16) {
    const uint32_t operation = code[at] & 0xffff;
    if (operation == kOpDecorate && code[at + 2] == kNoContraction) precise.insert(code[at + 1]);
    if (!rounds(operation)) continue;
    ++found.operations;
    found.loose += !precise.contains(code[at + 2]);
  }
  return found;
}

TEST(ShaderCode, NoOperationMayBeContracted) {
  std::vector<const char*> names = {"query",   "prove", "wide",   "query_scene", "prove_scene",
                                    "default", "small", "planes", "hits",        "hits_scene"};
  names.insert(names.end(), {"wide_hlsl", "prove_hlsl", "query_scene_hlsl", "prove_scene_hlsl",
                             "default_hlsl", "hits_hlsl", "hits_scene_hlsl"});
  for (const char* name : names) {
    const Arithmetic found = arithmetic_of(shader_code(name));
    EXPECT_GT(found.operations, 80u) << name;
    EXPECT_EQ(found.loose, 0u) << name;
  }
  // This test would notice.
  const Arithmetic without = arithmetic_of(shader_code("imprecise"));
  EXPECT_EQ(without.loose, without.operations);
}

}  // namespace
}  // namespace nif::test
