// Checks the code that GPU compilers make of the kernels: for every target, the registers, memory and spills
// in its report, and the instructions in its assembly. Skipped if there is no compiler for the target.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <ostream>
#include <regex>
#include <sstream>
#include <string>
#include <string_view>

namespace nif::test {
namespace {

namespace fs = std::filesystem;

/// Of one kernel.
struct Resources {
  uint32_t registers = 0;  ///< vector registers of AMD, registers of NVIDIA
  uint32_t stack = 0;      ///< bytes of memory that each thread has to itself
  uint32_t spilled = 0;    ///< registers of AMD, bytes of NVIDIA
  uint32_t scalars = 0;    ///< scalar registers of AMD that are kept in lanes of vector registers
};

struct Target {
  const char* name;
  const char* product;       ///< the instruction that networks of integers are evaluated by
  const char* half_product;  ///< and those in half precision
  uint32_t wave;

  friend std::ostream& operator<<(std::ostream& out, const Target& target) { return out << target.name; }
};
constexpr Target kTargets[] = {
    {"gfx1030", "v_dot4c_i32_i8", "v_dot2c_f32_f16", 32},
    {"gfx1100", "v_wmma_i32_16x16x16_iu8", "v_wmma_f32_16x16x16_f16", 32},
    {"gfx90a", "v_mfma_i32_16x16x16i8", "v_mfma_f32_16x16x16f16", 64},
    {"gfx942", "v_mfma_i32_16x16x32_i8", "v_mfma_f32_16x16x16_f16", 64},
    {"sm_80", "mma.sync.aligned.m16n8k32", "mma.sync.aligned.m16n8k16.row.col.f32.f16.f16.f32", 32},
    {"sm_90", "mma.sync.aligned.m16n8k32", "mma.sync.aligned.m16n8k16.row.col.f32.f16.f16.f32", 32},
};

std::string read(const fs::path& path) {
  std::ostringstream text;
  text << std::ifstream(path).rdbuf();
  return text.str();
}

/// The number that the pattern's first group is, in the text from `from` on.
uint32_t number(const std::string& text, size_t from, const char* pattern) {
  std::smatch match;
  const std::string rest = text.substr(from, 4000);
  if (!std::regex_search(rest, match, std::regex(pattern))) {
    ADD_FAILURE() << "no " << pattern << " in the compiler's report";
    return ~0u;
  }
  return uint32_t(std::stoul(match[1]));
}

std::map<std::string, Resources> read_report(const std::string& text, bool amd) {
  std::map<std::string, Resources> kernels;
  const std::regex start(amd ? "Function Name: (nif_\\w+)" : "Compiling entry function '(\\w+)'");
  for (std::sregex_iterator it(text.begin(), text.end(), start), end; it != end; ++it) {
    const auto at = size_t(it->position());
    Resources& kernel = kernels[(*it)[1]];
    if (amd)
      kernel = {number(text, at, " VGPRs: (\\d+)"), number(text, at, "ScratchSize \\[bytes/lane\\]: (\\d+)"),
                number(text, at, "VGPRs Spill: (\\d+)"), number(text, at, "SGPRs Spill: (\\d+)")};
    else
      kernel = {number(text, at, "Used (\\d+) registers"), number(text, at, "(\\d+) bytes stack frame"),
                number(text, at, "(\\d+) bytes spill stores"), 0};
  }
  return kernels;
}

/// The assembly of one kernel: from its label or entry to its end.
std::string assembly_of(const std::string& text, const std::string& kernel, bool amd) {
  const size_t at = text.find(amd ? "\n" + kernel + ":" : ".entry " + kernel + "(");
  if (at == std::string::npos) return "";
  return text.substr(at, text.find(amd ? "\n.Lfunc_end" : "\n}", at + 1) - at);
}

class GpuCodeTest : public testing::TestWithParam<Target> {
 protected:
  void SetUp() override {
    const fs::path folder = NIF_GPU_FOLDER;
    const std::string name = GetParam().name;
    amd_ = name.starts_with("gfx");
    if (!fs::exists(folder / (name + ".s"))) GTEST_SKIP() << "no code was compiled for GPU target " << name;
    code_ = folder / (name + (amd_ ? ".co" : ".cubin"));
    assembly_ = read(folder / (name + ".s"));
    kernels_ = read_report(read(folder / (name + ".txt")), amd_);
  }

  bool amd_ = false;
  fs::path code_;
  std::string assembly_;
  std::map<std::string, Resources> kernels_;
};
INSTANTIATE_TEST_SUITE_P(Each, GpuCodeTest, testing::ValuesIn(kTargets),
                         [](const auto& p) { return p.param.name; });

/// What a kernel may take at most.
struct Bounds {
  uint32_t amd, nvidia;  ///< registers
  uint32_t scalars;      ///< spilled ones
  uint32_t stack;        ///< bytes
  uint32_t spilled = 0;  ///< bytes, on NVIDIA
};

/// Warps of a thread's registers that an NVIDIA multiprocessor has room for: each of its four parts has 16,384
/// registers, of which a thread gets a multiple of 8. So four warps more or less are the smallest step.
constexpr uint32_t resident_warps(uint32_t registers) { return 16384 / ((registers + 7) / 8 * 8 * 32) * 4; }
static_assert(resident_warps(64) == 32 && resident_warps(72) == 28 && resident_warps(80) == 24 &&
              resident_warps(96) == 20 && resident_warps(128) == 16 && resident_warps(168) == 12 &&
              resident_warps(169) == 8);

/// Every kernel.
///
/// Registers are bounded so that enough waves are in flight to hide the latency of loads: 128 are 8 of 16
/// waves (RDNA), or 4 of 8 (CDNA), the latter where the accumulators of matrix products count, too; 80 are 24
/// of 64 warps on NVIDIA, 128 are 16. Kernels in half precision keep a layer's inputs and outputs in
/// registers, and shared memory, of which the paper's networks take 25 kB a block, has room for 10 waves on a
/// SIMD of gfx1100's and for 2 on one of gfx90a's. 176 registers leave room for 8 and for 2; 128, on NVIDIA,
/// for two blocks. For wider networks 208 do for 7 and for 2, and 160 for one block. Where a thread goes all
/// the way with its ray it keeps the ray in two spaces and its way through the top level besides, and for
/// details joins answers in double precision. Those are bounded by what compilers need today, so that a
/// change for the worse shows.
///
/// A traversal holds the planes of a cell, and the segment's way through it, besides its own state. That
/// costs some 20 registers on CDNA and 10 on NVIDIA, and of the waves that registers leave room for: in the
/// pipeline's traversal one of 5 on gfx942 (none of 4 on gfx90a) and 4 of 28 on NVIDIA; in the one with
/// details one of 4 and none of 20; in nif_scene_segment one of 4 on gfx90a; in the one with details and in
/// nif_pipeline_alone 4 of 20 on NVIDIA. That intervals end at planes, and not where cells do, costs up to 6
/// registers more: one of 4 waves in the pipeline's traversal on gfx90a, and 4 of 20 warps in
/// nif_scene_segment on NVIDIA. Where there may be an `exact` object, a ray waits in the space of its BVH
/// while it is traversed: 2 registers in nif_pipeline_traverse_any on gfx90a, and no wave. `proof` objects,
/// with a traversal of their own, cost 2 in the one with details on CDNA: 186, of which there is room for 2
/// waves, as of 184.
///
/// A thread that looks for a first hit keeps besides all this what it has found so far, the nearest triangle
/// of a BVH in double precision, and of a traversal its last open cell. Lists of open cells would have been
/// 1.5 kB of stack.
///
/// nif_pipeline_traverse_one gives a lane the next ray, so the ray's number and a traversal's state live as
/// long as the lane; yet it takes fewer registers than nif_pipeline_traverse_segment, which knows the way
/// through a top level.
///
/// Three kernels without details are made for 16 blocks of 64 threads on NVIDIA, which leaves a thread 64
/// registers. What then is in memory costs less than twice as many warps gain: measured on an H200
/// (kernel_list.hpp).
///
/// A ray seldom passes close to an edge, but what looks at that (passes_close()) takes registers wherever
/// triangles are tested: up to 16 on AMD and 26 on NVIDIA, which is one wave of 3 in nif_scene_bvh and in
/// nif_pipeline_traverse_any on gfx90a, 4 of 12 warps in nif_scene_bvh_details and in nif_scene_any_details,
/// and 340 bytes more in memory where a thread has 64 registers. Called as a function, or with twice the
/// digits, it took 50 to 90.
///
/// A ray from far away is seldom met either. What moves it for boxes takes 2 registers in nif_scene_bvh on
/// gfx90a, of which there is room for as many waves, and up to 180 bytes more in memory where a thread has 64
/// or 128 registers.
///
/// Masks, and instances under numbers that are not 0, keep two pointers and a number more, which is 4
/// registers where triangles are tested on gfx90a and in nif_scene_open on NVIDIA, of which there is room for
/// as many waves, and up to 32 scalar registers more in lanes.
/// nif_pipeline_traverse_segment, for which nvcc then took 88 registers, is held at 6 blocks, and takes 78 as
/// before, without memory.
///
/// Whether an instance's object and the whole scene are proven is one value more in kernels that say whether
/// an answer is certain: up to 2 registers, of which there is room for as many warps and waves, and up to 12
/// scalar registers in lanes.
///
/// That the box of an instance skips NaN takes up to 6 registers more on gfx90a where triangles are tested; sm_80
/// stays within its bounds. There is room for as many waves, 2, and 3 in nif_scene_bvh_single.
///
/// nif_scene_hits is made for 8 blocks on NVIDIA, of 128 registers; what is in memory then costs less than
/// the blocks gain (docs/results/gpu/tried.md).
///
/// Scenes with holes have kernels of their own, which take what the others do and up to 18 registers more on AMD and
/// 43 on NVIDIA, for the weights of a triangle and its place in a map.
///
/// The stack is for what functions that are not inlined hand each other, and on gfx1030 for copies of
/// arguments that nothing reads.
const std::map<std::string, Bounds> kBounds{{"nif_pack_bits", {16, 16, 0, 0}},
                                            {"nif_pipeline_alone", {128, 112, 88, 176}},
                                            {"nif_pipeline_half_inner_64", {176, 128, 8, 248}},
                                            {"nif_pipeline_half_inner_96", {208, 160, 16, 248}},
                                            {"nif_pipeline_half_outer_64", {176, 128, 8, 248}},
                                            {"nif_pipeline_half_outer_96", {208, 160, 16, 248}},
                                            {"nif_pipeline_offsets", {32, 32, 0, 0}},
                                            {"nif_pipeline_order", {16, 24, 0, 0}},
                                            {"nif_pipeline_segment_2", {120, 80, 40, 8}},
                                            {"nif_pipeline_segment_any", {128, 120, 32, 8}},
                                            {"nif_pipeline_traverse_any", {178, 128, 170, 168}},
                                            {"nif_pipeline_traverse_any_details", {200, 148, 226, 168}},
                                            {"nif_pipeline_traverse_holes", {188, 146, 176, 168}},
                                            {"nif_pipeline_traverse_holes_details", {210, 162, 230, 168}},
                                            {"nif_pipeline_traverse_one", {96, 80, 56, 0}},
                                            {"nif_pipeline_traverse_one_details", {104, 96, 72, 0}},
                                            {"nif_pipeline_traverse_segment", {136, 80, 88, 16}},
                                            {"nif_pipeline_traverse_segment_details", {160, 104, 152, 16}},
                                            {"nif_scene_any", {184, 128, 93, 144, 224}},
                                            {"nif_scene_any_details", {200, 186, 139, 144}},
                                            {"nif_scene_bvh", {180, 64, 130, 352, 1310}},
                                            {"nif_scene_bvh_single", {162, 64, 90, 200, 780}},
                                            {"nif_scene_bvh_details", {218, 177, 204, 16}},
                                            {"nif_scene_hits", {230, 128, 186, 168, 800}},
                                            {"nif_scene_hits_holes", {232, 171, 190, 168}},
                                            {"nif_scene_holes", {200, 196, 93, 144}},
                                            {"nif_scene_holes_details", {216, 214, 139, 144}},
                                            {"nif_scene_open", {192, 148, 206, 48}},
                                            {"nif_scene_open_holes", {204, 166, 206, 48}},
                                            {"nif_scene_segment", {144, 64, 74, 112, 640}},
                                            {"nif_scene_segment_details", {176, 112, 127, 72}}};

TEST_P(GpuCodeTest, HasEveryKernel) {
  EXPECT_GT(fs::file_size(code_), 10'000u);
  EXPECT_EQ(kernels_.size(), kBounds.size());
  for (const auto& [name, bounds] : kBounds) {
    EXPECT_TRUE(kernels_.contains(name)) << name;
    EXPECT_GT(assembly_of(assembly_, name, amd_).size(), 1000u) << name;
  }
}

/// Two folders make the same bytes (see kernels/gpu/compile.sh).
TEST_P(GpuCodeTest, ContainsNoPaths) {
  EXPECT_FALSE(std::regex_search(assembly_, std::regex("__hip_cuid_[0-9a-f]")));
}

/// Nothing is spilled but scalar registers of AMD, to lanes of vector registers, and what is meant to be.
TEST_P(GpuCodeTest, StaysWithinBounds) {
  for (const auto& [name, kernel] : kernels_) {
    ASSERT_TRUE(kBounds.contains(name)) << name;
    const Bounds& bounds = kBounds.at(name);
    EXPECT_LE(kernel.registers, amd_ ? bounds.amd : bounds.nvidia) << name;
    EXPECT_LE(kernel.spilled, amd_ ? 0 : bounds.spilled) << name;
    EXPECT_LE(kernel.scalars, bounds.scalars) << name;
    EXPECT_LE(kernel.stack, bounds.stack) << name;
  }
}

/// What is written to the stack is not needed, but where functions are called. Kernels that answer items by
/// networks may have the sole instance's number there, which they need once, when a network is done.
TEST_P(GpuCodeTest, ReadsNoStack) {
  if (!amd_) return;  // there is none but in the kernels for all encodings: see StaysWithinBounds
  // nif_scene_open, which asks BVHs from two places, has its answer there where clang 19 compiles it.
  const std::regex load("\n\t(buffer|scratch)_load_");
  for (const auto& [name, bounds] : kBounds) {
    const std::string code = assembly_of(assembly_, name, true);
    const auto loads = std::distance(std::sregex_iterator(code.begin(), code.end(), load), {});
    EXPECT_TRUE(loads == 0 || (loads == 1 && name.starts_with("nif_pipeline_segment_")) ||
                name.starts_with("nif_scene_any") || name.starts_with("nif_scene_holes") ||
                (name == "nif_scene_open" &&
                 (GetParam().name == std::string("gfx1100") || GetParam().name == std::string("gfx942"))))
        << name << ": " << loads;
  }
}

TEST_P(GpuCodeTest, HasTheExpectedMatrixInstructions) {
  for (const char* name : {"nif_pipeline_segment_2", "nif_pipeline_segment_any"})
    EXPECT_NE(assembly_of(assembly_, name, amd_).find(GetParam().product), std::string::npos) << name;
  // Of a layer of the paper's, 4 x 4 tiles of 16 x 16 for the wave's rays, and of the last one, 4 at a time.
  for (const char* name : {"nif_pipeline_half_outer_64", "nif_pipeline_half_inner_64",
                           "nif_pipeline_half_outer_96", "nif_pipeline_half_inner_96"}) {
    const std::string code = assembly_of(assembly_, name, amd_);
    uint32_t count = 0;
    for (size_t at = 0; (at = code.find(GetParam().half_product, at)) != std::string::npos; ++at) ++count;
    EXPECT_GE(count, 2 * (4 * 4 + 4u)) << name;
  }
  // And dot products of bytes where a thread is alone with its ray.
  const std::string whole = assembly_of(assembly_, "nif_pipeline_alone", amd_);
  EXPECT_TRUE(whole.find("v_dot4") != std::string::npos || whole.find("dp4a.s32.s32") != std::string::npos);
}

/// PTX says of every operation how it rounds; AMD's assembly of divisions cannot be told from fused products.
TEST_P(GpuCodeTest, RoundsAsTheReference) {
  if (amd_) {
    EXPECT_NE(assembly_.find("v_div_fixup_f32"), std::string::npos);  // the last step of a correct division
    EXPECT_NE(assembly_.find("v_div_scale_f32"), std::string::npos);
    const std::string wave = ".wavefront_size: " + std::to_string(GetParam().wave);
    EXPECT_NE(assembly_.find(wave), std::string::npos);
    // Denormals of single precision are kept.
    EXPECT_EQ(std::regex_search(assembly_, std::regex("float_denorm_mode_32 [012]")), false);
    EXPECT_NE(assembly_.find("float_denorm_mode_32 3"), std::string::npos);
    // So are those of half precision, which latent vectors in files may be.
    EXPECT_EQ(std::regex_search(assembly_, std::regex("float_denorm_mode_16_64 [012]")), false);
    EXPECT_NE(assembly_.find("float_denorm_mode_16_64 3"), std::string::npos);
    return;
  }
  EXPECT_NE(assembly_.find("div.rn.f32"), std::string::npos);
  EXPECT_NE(assembly_.find("sqrt.rn.f32"), std::string::npos);
  for (const char* loose : {"mad.f32", ".approx", ".ftz", "div.full"})
    EXPECT_EQ(assembly_.find(loose), std::string::npos) << loose;
  // Fused are those products of the skipping traversal that are exact, or estimates, and no others. In each
  // traversal they are five along each axis: the cell's number, the plane of the exit, how far the segment
  // has come, its estimated cell, and the plane to compare with.
  for (const auto& [name, bounds] : kBounds) {
    const std::string code = assembly_of(assembly_, name, amd_);
    uint32_t fused = 0;
    for (size_t at = 0; (at = code.find("fma.rn.f32", at)) != std::string::npos; ++at) ++fused;
    const bool traversals = name.find("_traverse_") != std::string::npos || name == "nif_pipeline_alone" ||
                            name.starts_with("nif_scene_segment") || name.starts_with("nif_scene_any") ||
                            name.starts_with("nif_scene_hits") || name.starts_with("nif_scene_open") ||
                            name.starts_with("nif_scene_holes");
    EXPECT_EQ(fused > 0, traversals) << name;
    EXPECT_EQ(fused % 15, 0u) << name << ": " << fused;
  }
}

}  // namespace
}  // namespace nif::test
