// Draws the ways in which a random scene is asked, and counts the rays that differ.
#include "tests/exact/compare_scene.hpp"

#include <algorithm>
#include <stdexcept>

#include "tests/exact/judge.hpp"

namespace nif::test {

SceneTally& SceneTally::operator+=(const SceneTally& other) {
  rays += other.rays, certain += other.certain, hit += other.hit, open += other.open;
  answers += other.answers, differing += other.differing;
  return *this;
}

std::vector<std::vector<Way>> make_scene_ways() {
  std::vector<std::vector<Way>> all;
  for (const char* isa : {"isa=scalar", "isa=sse4", "isa=avx2", "isa=avx512", "isa=neon"}) {
    std::vector<Way> ways;
    for (const char* settings : {"threads=1,", "threads=2,", "threads=3,", "threads=1,memory=least,"})
      add_way(std::string(settings) + isa, false, 10'000, ways);
    if (!ways.empty()) all.push_back(std::move(ways));
  }
  return all;
}

SceneTally compare(const RandomScene& scene, const std::vector<std::vector<Way>>& ways, uint64_t number) {
  return compare_with(scene.expected(), scene, ways, number);
}

SceneTally compare_with(const Said& expected, const RandomScene& scene,
                        const std::vector<std::vector<Way>>& ways, uint64_t number) {
  constexpr uint64_t kCallSizes[] = {1, 2, 7, 8, 9, 15, 16, 17, 100, 1000, 1023, 1024, 1025, 3000, 10'000};
  Random random(number);
  SceneTally tally;
  const size_t count = tally.rays = scene.rays().size();
  tally.certain = uint64_t(std::count(expected.certain.begin(), expected.certain.end(), 1));
  tally.hit = uint64_t(std::count(expected.hits.hit.begin(), expected.hits.hit.end(), 1));
  tally.open = uint64_t(std::count(expected.listed.begin(), expected.listed.end(), 1));
  std::vector<uint8_t> differs(count);
  for (const std::vector<Way>& of_isa : ways) {
    // The reference's kernels take most of the time, and are what is compared with.
    if (&of_isa == ways.data() && ways.size() > 1 && random.below(3) != 0) continue;
    const Way& way = of_isa[random.below(uint32_t(of_isa.size()))];
    const auto report = [&](const std::string& what) {
      tally.findings.push_back("scene " + std::to_string(number) + " (" + std::to_string(scene.instances()) +
                               " instances, " + scene.layout() + "), " + way.name + " at most: " + what);
    };
    try {
      const Said said =
          scene.ask(way.device, [&] { return kCallSizes[random.below(std::size(kCallSizes))]; });
      tally.answers += kCalls * count;
      bool reported = false;
      for (size_t i = 0; i < count; ++i) {
        if (agree(expected, i, said, i)) continue;
        differs[i] = 1;
        if (!reported)
          report("ray " + std::to_string(i) + ", " + in_hex(scene.rays()[i]) + ": " +
                 both(expected, i, said, i));
        reported = true;
      }
    } catch (const std::runtime_error& error) {  // calls that disagree
      differs[0] = 1;
      report(error.what());
    }
  }
  tally.differing = uint64_t(std::count(differs.begin(), differs.end(), 1));
  return tally;
}

}  // namespace nif::test
