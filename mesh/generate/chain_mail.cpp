// `chain-mail`: a square sheet of rings in the European pattern, each linked with two in the row before and
// two in the row behind, on gentle waves.
#include <algorithm>
#include <cmath>

#include "formats/base/random.hpp"
#include "mesh/generate/computed.hpp"
#include "mesh/generate/noise.hpp"
#include "mesh/generate/ring.hpp"
#include "mesh/generate/shapes.hpp"

namespace nif::generate {
namespace {

constexpr uint64_t kMailStream = 0x6d61696c;  // "mail"
constexpr uint64_t kFewestOfRing = 36;        // a hexagon of triangular wire

// In radii of a ring. Among all steps in multiples of 0.05 and tilts in multiples of 0.05 radians, these keep
// the circles of linked rings farthest apart, 0.49, so that wires of 0.18 do not touch, and rings may turn a
// little.
constexpr double kStepX = 2.5, kStepZ = 0.65, kTilt = 0.55 / 6.283185307179586, kWire = 0.18;
constexpr double kTurn = 1.5 / 360;

class ChainMail {
 public:
  explicit ChainMail(const Request& request) : seed_(request.seed), waves_(request.seed, kMailStream) {
    // More triangles give more rings and finer ones: 300 per ring for 100,000 in all, 3,000 per ring for 50
    // million.
    const double root = std::sqrt(std::sqrt(std::sqrt(double(request.triangles))));
    const uint64_t of_ring = std::max(kFewestOfRing, uint64_t(4 * root * root * root));
    const uint64_t rings = request.triangles / of_ring;
    columns_ = std::max<uint64_t>(1, uint64_t(std::sqrt(double(rings) * kStepZ / kStepX) + 0.5));
    rows_ = rings / columns_;
    grid_ = RingGrid::of(request.triangles / (columns_ * rows_), 1 / kWire);
  }

  uint64_t vertex_count() const { return columns_ * rows_ * grid_.vertex_count(); }
  uint64_t triangle_count() const { return columns_ * rows_ * grid_.triangle_count(); }

  Double3 vertex(uint64_t index) const {
    const uint64_t number = index / grid_.vertex_count();
    const Double3 flat = ring(number).vertex(grid_, index % grid_.vertex_count());
    // Waves that shear space upwards keep linked rings linked and separate rings separate.
    const double scale = 2 / (double(columns_) * kStepX);  // the sheet reaches from -1 to 1
    const Double3 p = flat * scale;
    return p + Double3{0, 0.22 * waves_(Double3{1.3 * p[0], 0, 1.3 * p[2]}), 0};
  }

  mesh::Triangle triangle(uint64_t index) const {
    const auto base = uint32_t(index / grid_.triangle_count() * grid_.vertex_count());
    const auto [a, b, c] = grid_.triangle(index % grid_.triangle_count());
    return {base + a, base + b, base + c};
  }

 private:
  Ring ring(uint64_t number) const {
    const uint64_t row = number / columns_, column = number % columns_;
    Random random(seed_, kMailStream, number);
    const double odd = double(row % 2);
    const Turn tilt = turn((1 - 2 * odd) * kTilt + random.uniform(-kTurn, kTurn)),
               yaw = turn(random.uniform(-kTurn, kTurn));
    const double x = (double(column) + odd / 2 + 0.25 - double(columns_) / 2) * kStepX,
                 z = (double(row) + 0.5 - double(rows_) / 2) * kStepZ;
    return {{x, 0, z}, {yaw.cos, 0, yaw.sin}, {yaw.sin * tilt.cos, tilt.sin, -yaw.cos * tilt.cos}, 1, kWire};
  }

  uint64_t seed_;
  Noise waves_;
  uint64_t columns_, rows_;
  RingGrid grid_;
};

}  // namespace

std::unique_ptr<mesh::MeshSource> make_chain_mail(const Request& request) {
  return computed(ChainMail(request));
}

}  // namespace nif::generate
