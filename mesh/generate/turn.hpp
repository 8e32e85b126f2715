// Cosine and sine of a fraction of a turn, using only correctly rounded operations, because generated meshes
// must not depend on a machine's maths library.
#pragma once

#include <cmath>

namespace nif::generate {

struct Turn {
  double cos, sin;
};

/// The direction after `turns` turns from the first axis towards the second; `turns` may be any finite
/// number.
inline Turn turn(double turns) {
  const double rest = turns - std::floor(turns + 0.5), quarter = std::floor(4 * rest + 0.5);
  const double a = 6.283185307179586 * (rest - quarter * 0.25), b = a * a;  // |a| <= pi / 4
  // Taylor series, until the remaining terms are below 1e-16.
  const double s =
      a *
      (1 -
       b / 6 * (1 - b / 20 * (1 - b / 42 * (1 - b / 72 * (1 - b / 110 * (1 - b / 156 * (1 - b / 210)))))));
  const double c =
      1 - b / 2 *
              (1 - b / 12 *
                       (1 - b / 30 *
                                (1 - b / 56 * (1 - b / 90 * (1 - b / 132 * (1 - b / 182 * (1 - b / 240)))))));
  switch (int(quarter)) {
    case 0:
      return {c, s};
    case 1:
      return {-s, c};
    case -1:
      return {s, -c};
    default:
      return {-c, -s};
  }
}

}  // namespace nif::generate
