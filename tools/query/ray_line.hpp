// Parses rays from lines of text.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "nif/nif.h"

namespace nif::tools {

/// What is wrong with a line; the caller knows its file and number.
struct LineProblem {
  std::string what;
};

/// Names of a ray's numbers, in the order that applies without a header.
inline constexpr std::array<std::string_view, 8> kRayNumbers{"ox", "oy", "oz",   "dx",
                                                             "dy", "dz", "tmin", "tmax"};

/// A number as text: decimal or hexadecimal ("0x1p-3"), "inf" or "nan". It is rounded once.
std::optional<float> parse_float(std::string_view word);

/// A word of the input, shortened for messages.
std::string shown(std::string_view word);

/// Rows of numbers, separated by commas, semicolons, or blanks and tabs. The first line determines the
/// separator and the columns of the numbers. Quotes around a word are dropped.
class RayTable {
 public:
  /// Examines the first line. Returns whether it is a header rather than a ray. Throws LineProblem.
  bool begin(std::string_view line);
  /// Throws LineProblem.
  NifRay parse(std::string_view line) const;

 private:
  char separator_ = ' ';
  bool has_header_ = false;
  std::vector<uint8_t> columns_;  ///< the number of kRayNumbers in each column
};

/// {"origin": [x, y, z], "direction": [x, y, z], "tmin": t, "tmax": t}, with the last two optional, or an
/// array of 6 or 8 numbers. A number may also be a string, because JSON cannot express all numbers, or one of
/// Python's words for those: NaN, Infinity, -Infinity. Throws LineProblem.
NifRay parse_json_ray(std::string_view line);

}  // namespace nif::tools
