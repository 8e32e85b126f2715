// The ways in which answers are asked for: devices and their settings, calls, and how many rays there are to a call.
// All must give the same bits.
#pragma once

#include <nif/nif.hpp>

#include <cstddef>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "tests/support/test_first_hits.hpp"

namespace nif::test {

/// The calls: a query with all outputs, one with visibility alone, first hits, open rays, and a query with a
/// fallback. They must agree.
inline constexpr uint32_t kCalls = 5;

/// All answers of one scene to some rays.
struct Said {
  explicit Said(size_t count)
      : visible(count, 0xcc),
        certain(count, 0xcc),
        listed(count, 0),
        open(count, NIF_NONE),
        logit(count),
        begin(count),
        end(count),
        hits(count) {}
  bool operator==(const Said&) const = default;

  std::vector<uint8_t> visible, certain;
  std::vector<uint8_t> listed;  ///< 1: listed as open, from `begin` to `end`
  std::vector<uint32_t> open;   ///< the only instance that leaves it open, or NIF_NONE
  std::vector<int32_t> logit;
  std::vector<float> begin, end;
  FirstHits hits;
};

/// A device, and how it is used.
struct Way {
  std::string name;
  nifkit::Device device;
  bool coded;     ///< its file is coded
  uint64_t most;  ///< rays per call
  bool gpu = false, mapped = false;
};

/// The ways of this machine; the first is the reference. `module`: a GPU module, or empty.
std::vector<Way> make_ways(const std::string& module);

/// Adds a way whose device has this configuration, unless the processor lacks its instruction set.
void add_way(const std::string& config, bool coded, uint64_t most, std::vector<Way>& ways);

/// The answers of a scene by all calls, each for next_call() rays. The user values of its instances are user_of().
/// `masks`: for each ray, one for all, or empty. Throws std::runtime_error if calls disagree.
Said ask(const nifkit::Scene& scene, const std::vector<NifRay>& rays, std::span<const uint32_t> masks,
         const std::function<uint64_t()>& next_call);
inline uint64_t user_of(uint32_t instance) { return 0x123456789abcdef0u + instance; }

/// Whether two ways give ray i of one and ray j of the other the same bits.
bool agree(const Said& a, size_t i, const Said& b, size_t j);
/// Both as text.
std::string both(const Said& a, size_t i, const Said& b, size_t j);

}  // namespace nif::test
