// Chooses a decision threshold that keeps one kind of error of an object below a rate.
#pragma once

#include <array>
#include <atomic>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "bake/ground_truth/ray_sets.hpp"
#include "formats/nif/network/network_part.hpp"

namespace nif::bake {

/// The two ways to be wrong, see Accuracy.
enum class Mistake { leak, spurious };
std::string_view name_of(Mistake mistake);

/// The purpose of a threshold: to keep a mistake at or below a share of all rays of every ray set.
struct ErrorLimit {
  Mistake mistake = Mistake::leak;
  double rate = 0;  ///< 0..1
};

/// The effect of a threshold on held-out rays.
struct ErrorLimitReport {
  struct Set {
    uint64_t rays = 0, wrong = 0;  ///< held out; of those, with this mistake
    double bound = 0;              ///< 99 % confidence bound of the mistake's share of all rays
  };
  ErrorLimit asked;
  int32_t threshold = 0;
  /// No answer can be this mistake: the network gives only the other answer, because no threshold in between
  /// could be proven to meet the rate. Then nothing is counted.
  bool proven = false;
  std::array<Set, kRaySets.size()> sets{};  ///< by RaySet; without rays if the object has none

  /// The set with the highest bound.
  RaySet worst() const;
};

/// "limits leaks: ..."; a sentence without a full stop.
std::string describe(const ErrorLimitReport& report);
nlohmann::ordered_json to_json(const ErrorLimitReport& report);

/// The held-out rays of one set, as needed for a threshold.
struct HeldOut {
  uint64_t rays = 0;  ///< all of them
  /// For each ray with the mistake: how far the output would have to move for the other answer, minus one.
  std::vector<uint32_t> excess;
};

/// How far outputs must move so that the share of rays with a mistake is at most `rate` in every set, with
/// 99 % confidence (Clopper and Pearson 1934). 0 if they need not move. nullopt if there are too few rays to
/// prove it for any move. Sorts `excess`, largest first. Ignores sets without rays.
///
/// The counts come from the same rays by which the result is chosen. The confidence still holds: a smaller
/// move has no fewer mistakes, so a move that is too small is chosen only if the largest such move seems good
/// enough.
std::optional<uint32_t> least_move(std::span<HeldOut> sets, double rate);

/// Moves the threshold of a trained field's network as requested. `object` and `network` are the field.
/// Throws Error(interrupted) once `cancel` is set. The result does not depend on the number of threads.
ErrorLimitReport limit_error(const RaySource& source, const format::Object& object, const ErrorLimit& asked,
                             uint64_t seed, const std::atomic<bool>& cancel, format::Mlp& network);

}  // namespace nif::bake
