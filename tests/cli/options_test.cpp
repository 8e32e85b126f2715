// Wrong and contradictory options are refused by name, with exit code 2, before any file is touched.
#include <gtest/gtest.h>

#include "formats/base/status.hpp"
#include "tests/cli/program.hpp"

namespace nif::test {
namespace {

struct WrongOptions {
  const char* name;
  std::vector<std::string> arguments;
  std::vector<std::string> named;  ///< what the sentence must mention
};
void PrintTo(const WrongOptions& wrong, std::ostream* out) { *out << wrong.name; }

class Options : public testing::TestWithParam<WrongOptions> {};

TEST_P(Options, AreRefusedByName) {
  const Outcome outcome = nif(GetParam().arguments);
  EXPECT_EQ(outcome.code, int(Status::usage)) << outcome.err;
  EXPECT_EQ(outcome.out, "");
  // The mesh does not exist, so any other order of checks would give another exit code.
  EXPECT_EQ(lines_of(outcome.err).size(), 1u) << outcome.err;
  for (const std::string& word : GetParam().named)
    EXPECT_NE(outcome.err.find(word), std::string::npos) << "'" << word << "' in: " << outcome.err;
}

/// Arguments of a bake of a missing mesh, followed by `more`.
std::vector<std::string> bake(std::vector<std::string> more) {
  more.insert(more.begin(), {"bake", "none.ply", "-o", "none.nif"});
  return more;
}

std::vector<std::string> bench(std::vector<std::string> more) {
  more.insert(more.begin(), {"bench", "none.nif", "--mesh", "none.ply"});
  return more;
}

INSTANTIATE_TEST_SUITE_P(
    All, Options,
    testing::Values(
        WrongOptions{"NoValueBehindAName", bake({"--report=", "--json"}), {"--report has no value"}},
        WrongOptions{"MoreThreadsThanAnyMachineHas", bake({"-j", "1025"}), {"--threads", "1024"}},
        WrongOptions{"NoSubcommand", {}, {"--help"}},
        WrongOptions{"UnknownSubcommand", {"fry", "none.ply"}, {"fry", "bake", "render"}},
        WrongOptions{"NoVerb", {"mesh"}, {"--help"}},
        WrongOptions{"UnknownVerb", {"mesh", "fry", "none.ply"}, {"mesh", "fry", "generate"}},
        WrongOptions{"NoMesh", {"bake", "-o", "none.nif"}, {"MESH"}},
        WrongOptions{"NoOutput", {"bake", "none.ply"}, {"--output"}},
        WrongOptions{"UnknownOption", bake({"--turbo"}), {"--turbo"}},
        WrongOptions{"NegativeSeed", bake({"--seed", "-1"}), {"--seed", "negative"}},
        WrongOptions{"NegativeRays", bake({"--rays=-1"}), {"--rays", "negative"}},
        WrongOptions{"SeedBeyond64Bits", bake({"--seed", "18446744073709551616"}), {"--seed", "too large"}},
        WrongOptions{"NoNumber", bake({"--checkpoint", "nan"}), {"--checkpoint", "nan"}},
        WrongOptions{"NoRatio",
                     {"mesh", "decimate", "none.ply", "-o", "none.obj", "--ratio", "nan"},
                     {"--ratio", "nan"}},
        WrongOptions{"UnknownPreset", bake({"--preset", "perfect"}), {"--preset", "perfect"}},
        WrongOptions{"UnknownEncoding", bake({"--encoding", "zip"}), {"--encoding", "zip"}},
        WrongOptions{
            "PresetOfABvh", bake({"--encoding", "bvh", "--preset", "fast"}), {"--encoding", "--preset"}},
        WrongOptions{"ResolutionOfABvh",
                     bake({"--encoding", "bvh", "--resolution", "64"}),
                     {"--encoding", "--resolution"}},
        WrongOptions{"MixOfABvh", bake({"--encoding", "bvh", "--mix", "segments"}), {"--encoding", "--mix"}},
        WrongOptions{"PaperOfAnotherEncoding",
                     bake({"--encoding", "segment", "--preset", "paper"}),
                     {"--encoding segment", "--preset paper"}},
        WrongOptions{"SphericalOfAnotherPreset",
                     bake({"--encoding", "spherical", "--preset", "fast"}),
                     {"--encoding spherical", "--preset fast"}},
        WrongOptions{"ResolutionOfSpherical",
                     bake({"--preset", "paper", "--resolution", "64"}),
                     {"--resolution", "--outer-resolution"}},
        WrongOptions{"SphericalOptionOfAnotherEncoding",
                     bake({"--encoding", "segment", "--inner-width", "32"}),
                     {"--inner-width", "--encoding spherical"}},
        WrongOptions{"SharedNetworkOfAuto", bake({"--shared-network"}), {"--shared-network"}},
        WrongOptions{"NoOuterResolution",
                     bake({"--preset", "paper", "--outer-resolution", "0"}),
                     {"--outer-resolution 0"}},
        WrongOptions{"TooManyFeatures",
                     bake({"--preset", "paper", "--distance-features", "9"}),
                     {"--distance-features 9"}},
        WrongOptions{"WidthThatNoKernelHas",
                     bake({"--preset", "paper", "--outer-width", "130"}),
                     {"--outer-width 130"}},
        WrongOptions{"WidthBetweenLanes",
                     bake({"--preset", "paper", "--inner-width", "50"}),
                     {"--inner-width 50", "multiple of 4"}},
        WrongOptions{"NoLayers", bake({"--preset", "paper", "--inner-layers", "0"}), {"--inner-layers 0"}},
        WrongOptions{"OddBatch",
                     bake({"--preset", "paper", "--outer-batch", "1000"}),
                     {"--outer-batch 1000", "multiple of 512"}},
        WrongOptions{"UnknownPrecision",
                     bake({"--preset", "paper", "--precision", "double"}),
                     {"--precision", "double"}},
        WrongOptions{
            "NoLearningRate", bake({"--preset", "paper", "--learning-rate", "0"}), {"--learning-rate 0"}},
        WrongOptions{
            "UnknownLoss", bake({"--preset", "paper", "--loss", "l1"}), {"--loss", "l1", "cross-entropy"}},
        WrongOptions{"UnknownWeights",
                     bake({"--preset", "paper", "--weights", "zero"}),
                     {"--weights", "zero", "xavier"}},
        WrongOptions{
            "NoPasses", bake({"--preset", "paper", "--training-passes", "0"}), {"--training-passes"}},
        WrongOptions{"PassesOverAView",
                     bake({"--preset", "paper", "--view", "s.toml", "--training-passes", "2"}),
                     {"--training-passes", "--view-samples"}},
        WrongOptions{
            "PrimaryWithoutAView", bake({"--preset", "paper", "--primary"}), {"--primary", "--view"}},
        WrongOptions{"PrimaryOfAnotherEncoding",
                     bake({"--encoding", "segment", "--primary"}),
                     {"--primary", "--encoding spherical"}},
        WrongOptions{"ShapeOfNoPrimaryField",
                     bake({"--preset", "paper", "--view", "s.toml", "--primary-width", "32"}),
                     {"--primary-width", "--primary,"}},
        WrongOptions{
            "NoPrimaryResolution",
            bake({"--preset", "paper", "--view", "s.toml", "--primary", "--primary-resolution", "1"}),
            {"--primary-resolution 1"}},
        WrongOptions{"PrimaryWidthBetweenLanes",
                     bake({"--preset", "paper", "--view", "s.toml", "--primary", "--primary-width", "30"}),
                     {"--primary-width 30", "multiple of 4"}},
        WrongOptions{"TooManyPrimaryLayers",
                     bake({"--preset", "paper", "--view", "s.toml", "--primary", "--primary-layers", "4"}),
                     {"--primary-layers 4"}},
        WrongOptions{"NoPrimaryFeatures",
                     bake({"--preset", "paper", "--view", "s.toml", "--primary", "--primary-features", "0"}),
                     {"--primary-features 0"}},
        WrongOptions{"UnknownSetInMix", bake({"--mix", "moon=1"}), {"--mix", "moon"}},
        WrongOptions{"EmptyMix", bake({"--mix", "segments=0"}), {"--mix"}},
        WrongOptions{"ResolutionOutOfRange", bake({"--resolution", "1"}), {"--resolution"}},
        WrongOptions{"ResolutionIsNoNumber", bake({"--resolution", "fine"}), {"--resolution"}},
        WrongOptions{"MaxBytesIsNoSize", bake({"--max-bytes", "12 parsecs"}), {"--max-bytes", "12 parsecs"}},
        WrongOptions{"MaxErrorIsNoRate", bake({"--max-error", "150%"}), {"--max-error", "150%"}},
        WrongOptions{"NoErrorOfWhatIsLearned",
                     bake({"--max-error", "0", "--encoding", "segment"}),
                     {"--max-error 0", "--encoding segment", "contradict"}},
        WrongOptions{"ErrorOfProofs",
                     bake({"--max-error", "1%", "--encoding", "proof"}),
                     {"--max-error", "--encoding proof"}},
        WrongOptions{"OpenRaysOfAnEncoding",
                     bake({"--open-rays", "--encoding", "segment"}),
                     {"--open-rays", "--encoding auto"}},
        WrongOptions{"UnknownBlend", bake({"--blend", "half"}), {"--blend 'half'", "cutoff, opaque, ignore"}},
        WrongOptions{"UnknownGlass", bake({"--glass", "half"}), {"--glass 'half'", "ignore, opaque"}},
        WrongOptions{"CutoffAboveOne",
                     bake({"--alpha-cutoff", "1.5"}),
                     {"--alpha-cutoff '1.5' is not a rate from 0 to 1"}},
        WrongOptions{"CutoffBelowZero",
                     bake({"--alpha-cutoff", "-1"}),
                     {"--alpha-cutoff '-1' is not a rate from 0 to 1"}},
        WrongOptions{
            "CutoffIsNoNumber", bake({"--alpha-cutoff", "nan"}), {"--alpha-cutoff 'nan' is not a number"}},
        WrongOptions{"NegativeBytes", bake({"--max-bytes", "-5"}), {"--max-bytes '-5' is not a size"}},
        WrongOptions{"NoAlphaResolution", bake({"--alpha-resolution", "0"}), {"--alpha-resolution", "16384"}},
        WrongOptions{
            "TooMuchAlphaResolution", bake({"--alpha-resolution", "16385"}), {"--alpha-resolution", "16384"}},
        WrongOptions{"AlphaResolutionOfWhatIsSolid",
                     bake({"--alpha-resolution", "64", "--ignore-alpha"}),
                     {"--alpha-resolution", "--ignore-alpha"}},
        WrongOptions{"CutoffOfWhatIsOpaque",
                     bake({"--alpha-cutoff", "0.3", "--blend", "opaque"}),
                     {"--alpha-cutoff", "--blend opaque"}},
        WrongOptions{"GlassAndIgnoredAlpha",
                     bake({"--glass", "opaque", "--ignore-alpha"}),
                     {"--glass", "--ignore-alpha"}},
        WrongOptions{
            "UnknownPreference", bake({"--prefer", "quality"}), {"--prefer 'quality'", "speed, bytes"}},
        WrongOptions{"PreferenceOfAnEncoding",
                     bake({"--prefer", "speed", "--encoding", "exact"}),
                     {"--prefer", "--encoding auto", "exact"}},
        WrongOptions{"PreferenceOfThePaper",
                     bake({"--prefer", "bytes", "--preset", "paper"}),
                     {"--prefer", "--encoding auto", "spherical"}},
        WrongOptions{"SourceTrianglesOfAField",
                     bake({"--source-triangles", "--encoding", "segment"}),
                     {"--source-triangles", "--encoding segment"}},
        WrongOptions{"SourceTrianglesOfProofs",
                     bake({"--source-triangles", "--encoding", "proof"}),
                     {"--source-triangles", "--encoding proof"}},
        WrongOptions{"SourceTrianglesOfThePaper",
                     bake({"--source-triangles", "--preset", "paper"}),
                     {"--source-triangles", "--encoding spherical"}},
        WrongOptions{"ColorsOfABvh", bake({"--colors", "--encoding", "bvh"}), {"--colors", "--encoding bvh"}},
        WrongOptions{"ColorsOfThePaper",
                     bake({"--colors", "--preset", "paper"}),
                     {"--colors", "--encoding spherical"}},
        WrongOptions{"UnknownFallback", bench({"--fallback", "optix"}), {"--fallback", "optix"}},
        WrongOptions{"FallbackOfAGpu",
                     bench({"--fallback", "embree", "--device", "gpu"}),
                     {"--device gpu", "--fallback"}},
        WrongOptions{"HitsBehindProofs", bench({"--hits", "--fallback", "embree"}), {"--hits", "--fallback"}},
        WrongOptions{"StagesOfHits", bench({"--hits", "--stages"}), {"--hits", "--stages"}},
        WrongOptions{"HitsOfAGpu", bench({"--hits", "--device", "gpu"}), {"--device gpu", "--hits"}},
        WrongOptions{"MaxLeakIsNoRate", bake({"--max-leak", "much"}), {"--max-leak", "much"}},
        WrongOptions{"MaxSpuriousAboveOne", bake({"--max-spurious", "150%"}), {"--max-spurious", "150%"}},
        WrongOptions{"LimitsOfBothKindsOfError",
                     bake({"--max-leak", "0.1%", "--max-spurious", "0.1%"}),
                     {"--max-leak", "--max-spurious"}},
        WrongOptions{"MaxLeakOfSpherical",
                     bake({"--encoding", "spherical", "--max-leak", "0.1%"}),
                     {"--encoding spherical", "--max-leak"}},
        WrongOptions{"MaxSpuriousOfSpherical",
                     bake({"--encoding", "spherical", "--max-spurious", "0.1%"}),
                     {"--encoding spherical", "--max-spurious"}},
        WrongOptions{"NegativeThreads", bake({"-j", "-1"}), {"--threads"}},
        WrongOptions{"GridGivenTwice",
                     bake({"--resolution", "64", "--max-bytes", "100kB"}),
                     {"--resolution", "--max-bytes"}},
        WrongOptions{"LimitOfWhatIsNotMeasured",
                     bake({"--max-error", "0.2%", "--rays", "0"}),
                     {"--max-error", "--rays"}},
        WrongOptions{"StreamAsOutput", {"bake", "none.ply", "-o", "-"}, {"-o -"}},
        WrongOptions{"EvalWithoutMesh", {"eval", "none.nif"}, {"--mesh"}},
        WrongOptions{"EvalOfUnknownSet",
                     {"eval", "none.nif", "--mesh", "none.ply", "--set", "moon"},
                     {"--set", "moon"}},
        WrongOptions{"EvalOfNoRays", {"eval", "none.nif", "--mesh", "none.ply", "--rays", "0"}, {"--rays"}},
        WrongOptions{"HitsOfProofsWithEmbree",
                     {"eval", "none.nif", "--mesh", "none.ply", "--hits", "--fallback", "embree"},
                     {"--hits", "--fallback"}},
        WrongOptions{"BenchWithoutMesh", {"bench", "none.nif"}, {"--mesh"}},
        WrongOptions{"BenchOfUnknownSet", bench({"--set", "moon"}), {"--set", "moon"}},
        WrongOptions{"BenchOfNoRays", bench({"--rays", "0"}), {"--rays"}},
        WrongOptions{"BenchOfNoRounds", bench({"--rounds", "0"}), {"--rounds"}},
        WrongOptions{"BenchOfTooManyThreads", bench({"--threads", "5000"}), {"--threads"}},
        WrongOptions{"BenchOfUnknownEmbree", bench({"--embree", "some"}), {"--embree", "some"}},
        WrongOptions{"BenchOnUnknownDevice", bench({"--device", "tpu"}), {"--device", "tpu"}},
        WrongOptions{
            "ThreadsOfAGpu", bench({"--device", "gpu", "--threads", "1"}), {"--device gpu", "--threads"}},
        WrongOptions{"IsaOfAGpu", bench({"--device", "gpu", "--isa", "auto"}), {"--device gpu", "--isa"}},
        WrongOptions{
            "MemoryOfAGpu", bench({"--device", "gpu", "--least-memory"}), {"--device gpu", "--least-memory"}},
        WrongOptions{"PrecisionOfTheCpu", bench({"--precision", "half"}), {"--precision", "--device gpu"}},
        WrongOptions{"BatchesOfTheCpu", bench({"--batches"}), {"--batches", "--device gpu"}},
        WrongOptions{"PlotOfAGpu", bench({"--device", "gpu", "--plot", "a.svg"}), {"--device gpu", "--plot"}},
        WrongOptions{"PlotAsStream", bench({"--plot", "-"}), {"--plot -"}},
        WrongOptions{"InfoOfNothing", {"info"}, {"ASSET"}}),
    [](const auto& instance) { return std::string(instance.param.name); });

TEST(OptionsThatClash, OutputOverTheInput) {
  TempDir folder;
  const std::string mesh = folder.write("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").string();
  const std::string before = read_bytes(mesh);
  const Outcome outcome = nif({"bake", mesh, "-o", mesh});
  EXPECT_EQ(outcome.code, int(Status::usage)) << outcome.err;
  EXPECT_NE(outcome.err.find(mesh), std::string::npos) << outcome.err;
  EXPECT_EQ(read_bytes(mesh), before);
}

}  // namespace
}  // namespace nif::test
