// Rays as lines of text.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "nif/nif.h"

namespace nif::tools {

/// What is wrong with a line, for whoever knows its file and number.
struct LineProblem {
  std::string what;
};

/// Names of a ray's numbers in the order that they have without a header.
inline constexpr std::array<std::string_view, 8> kRayNumbers{"ox", "oy", "oz",   "dx",
                                                             "dy", "dz", "tmin", "tmax"};

/// A number as text: decimal or hexadecimal ("0x1p-3"), "inf" or "nan". It is rounded once.
std::optional<float> parse_float(std::string_view word);

/// A word of others in a message: not all of a long one.
std::string shown(std::string_view word);

/// Rows of numbers with a comma, a semicolon, or blanks and tabs between them; the first line says which, and
/// in which columns the numbers are. Quotes around a word are dropped.
class RayTable {
 public:
  /// Looks at the first line. Returns whether it is a header, rather than a ray. Throws LineProblem.
  bool begin(std::string_view line);
  /// Throws LineProblem.
  NifRay parse(std::string_view line) const;

 private:
  char separator_ = ' ';
  bool has_header_ = false;
  std::vector<uint8_t> columns_;  ///< which of kRayNumbers each has
};

/// {"origin": [x, y, z], "direction": [x, y, z], "tmin": t, "tmax": t} with the last two optional, or an
/// array of 6 or 8 numbers. A number may also be a string, for what JSON has no numbers for, or what Python
/// writes for that: NaN, Infinity, -Infinity. Throws LineProblem.
NifRay parse_json_ray(std::string_view line);

}  // namespace nif::tools
