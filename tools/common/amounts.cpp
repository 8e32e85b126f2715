// Parses a number with std::stod, then a unit from a table. kB is 1000 bytes and KiB is 1024.
#include "tools/common/amounts.hpp"

#include <fmt/format.h>

#include <cmath>
#include <span>
#include <string_view>
#include <utility>

#include "formats/base/status.hpp"

namespace nif::tools {
namespace {

/// The number that `text` starts with; the remaining text goes to `rest`.
double leading_number(const std::string& text, std::string& rest, const std::string& option) {
  size_t used = 0;
  double value = 0;
  try {
    value = std::stod(text, &used);
  } catch (const std::exception&) {
    used = 0;
  }
  if (used == 0 || !std::isfinite(value)) {
    throw Error(Status::usage, fmt::format("{} '{}' is not a number", option, text));
  }
  rest = text.substr(used);
  return value;
}

}  // namespace

double parse_rate(const std::string& text, const std::string& option) {
  std::string rest;
  double value = leading_number(text, rest, option);
  if (rest == "%") value /= 100;
  if ((rest != "" && rest != "%") || value < 0 || value > 1) {
    throw Error(Status::usage,
                fmt::format("{} '{}' is not a rate from 0 to 1: write 0.002 or 0.2%", option, text));
  }
  return value;
}

namespace {

using Units = std::span<const std::pair<std::string_view, double>>;

/// `what` and `examples` are used in the error message.
uint64_t parse_whole(const std::string& text, const std::string& option, Units units, const char* what,
                     const char* examples) {
  std::string rest;
  const double value = leading_number(text, rest, option);
  for (const auto& [unit, factor] : units) {
    if (rest == unit && value >= 0 && value * factor < 1e18) return uint64_t(value * factor);
  }
  throw Error(Status::usage, fmt::format("{} '{}' is not a {}: write {}", option, text, what, examples));
}

}  // namespace

uint64_t parse_bytes(const std::string& text, const std::string& option) {
  static constexpr std::pair<std::string_view, double> kUnits[] = {
      {"", 1},     {"B", 1},       {"k", 1e3},        {"kB", 1e3}, {"M", 1e6},
      {"MB", 1e6}, {"KiB", 1024.}, {"MiB", 1048576.}, {"GB", 1e9}, {"GiB", 1073741824.}};
  return parse_whole(text, option, kUnits, "size", "200000, 200kB or 256KiB");
}

uint64_t parse_count(const std::string& text, const std::string& option) {
  static constexpr std::pair<std::string_view, double> kUnits[] = {
      {"", 1}, {"k", 1e3}, {"M", 1e6}, {"G", 1e9}};
  return parse_whole(text, option, kUnits, "count", "500000, 500k or 2M");
}

}  // namespace nif::tools
