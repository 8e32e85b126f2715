// Tables for moving chosen lanes together and apart, for instruction sets without an instruction for it.
#pragma once

#include <cstdint>

namespace nif::kernels::cpu {

/// For each set of eight lanes, one byte per lane: which lane to take.
struct LaneOrders8 {
  alignas(64) uint8_t orders[256][8] = {};
  constexpr const uint8_t* operator[](uint32_t lanes) const { return orders[lanes]; }
};
/// The same for four lanes, for byte shuffles.
struct LaneOrders4 {
  alignas(64) uint8_t orders[16][16] = {};
  constexpr const uint8_t* operator[](uint32_t lanes) const { return orders[lanes]; }
};

/// The chosen lanes, starting with the first; the rest are undefined.
constexpr uint8_t lane_together(uint32_t lanes, uint32_t place) {
  uint32_t seen = 0;
  for (uint32_t lane = 0; lane < 8; ++lane)
    if (lanes >> lane & 1 && seen++ == place) return uint8_t(lane);
  return 0;
}
/// For each chosen lane, how many chosen lanes come before it.
constexpr uint8_t lane_apart(uint32_t lanes, uint32_t place) {
  uint32_t before = 0;
  for (uint32_t lane = 0; lane < place; ++lane) before += lanes >> lane & 1;
  return uint8_t(before);
}

template <class Which>
constexpr LaneOrders8 make_orders8(Which which) {
  LaneOrders8 table;
  for (uint32_t lanes = 0; lanes < 256; ++lanes)
    for (uint32_t place = 0; place < 8; ++place) table.orders[lanes][place] = which(lanes, place);
  return table;
}
template <class Which>
constexpr LaneOrders4 make_orders4(Which which) {
  LaneOrders4 table;
  for (uint32_t lanes = 0; lanes < 16; ++lanes)
    for (uint32_t place = 0; place < 4; ++place)
      for (uint32_t k = 0; k < 4; ++k)
        table.orders[lanes][4 * place + k] = uint8_t(4 * (which(lanes, place) & 3) + k);
  return table;
}

inline constexpr LaneOrders8 kTogether8 = make_orders8(lane_together), kApart8 = make_orders8(lane_apart);
inline constexpr LaneOrders4 kTogether4 = make_orders4(lane_together), kApart4 = make_orders4(lane_apart);

}  // namespace nif::kernels::cpu
