// Small parts of placing.hpp that need no templates.
#include "mesh/generate/placing.hpp"

#include "mesh/generate/axes.hpp"
#include "mesh/generate/turn.hpp"

namespace nif::generate {
namespace {

constexpr uint64_t kVariantStream = 0x76617269;  // "vari"

}  // namespace

Deck::Deck(uint64_t seed, size_t kind, uint32_t variants)
    : random_(seed, kVariantStream, kind), cards_(variants) {
  std::iota(cards_.begin(), cards_.end(), 0u);
}

uint32_t Deck::next() {
  const size_t at = dealt_++ % cards_.size();
  std::swap(cards_[at], cards_[at + random_.below(uint32_t(cards_.size() - at))]);
  return cards_[at];
}

mesh::Transform transform_of(const Double3& p, double turns, double scale) {
  const Turn t = turn(turns);
  const double c = t.cos * scale, s = t.sin * scale;
  return {float(c), 0,           float(s),  float(p[0]), 0,        float(scale),
          0,        float(p[1]), float(-s), 0,           float(c), float(p[2])};
}

mesh::Camera camera(const char* name, const Double3& position, const Double3& target, double degrees) {
  const Double3 back = unit(position - target), right = unit(cross(Double3{0, 1, 0}, back)),
                up = cross(back, right);
  mesh::Camera camera{name, {}, degrees * 3.141592653589793 / 180};
  for (size_t row = 0; row < 3; ++row) {
    const double values[4] = {right[row], up[row], back[row], position[row]};
    for (size_t k = 0; k < 4; ++k) camera.transform[4 * row + k] = float(values[k]);
  }
  return camera;
}

}  // namespace nif::generate
