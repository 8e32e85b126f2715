// Why no accepted network can overflow evaluate_network's 32-bit sums: a layer has at most
// max(kMaxInputs, kMaxWidth) = 264 inputs, each product is at most 127 * 127 in size, |bias| <= 2^26, and the
// rounding term is at most 2^23. 264 * 127 * 127 + 2^26 + 2^23 < 2^27. Features: the eight corner weights of
// a point sum to 2^21, so a sum is at most 127 * 2^21 < 2^28. Indices: there are at most 65533 * 64 corners,
// so corner * features_per_corner < 2^25.
#include <algorithm>
#include <bit>

#include "formats/nif/segment/encoding.hpp"
#include "formats/nif/segment/sides.hpp"
#include "kernels/reference/segment/walk.hpp"

namespace nif::format {
namespace {

using kernels::kMaxLayers;

static_assert(kernels::kMaxInputs * 127ll * 127 + kernels::kMaxBias + (1ll << kernels::kMaxShift) <
              1ll << 28);
static_assert(kMaxLayers == std::size(NetworkRecord{}.layers));

/// No byte is -128: weights and features are symmetric, -127..127.
bool symmetric(const int8_t* values, uint64_t count) {
  uint32_t found = 0;
  for (uint64_t i = 0; i < count; ++i) found |= uint32_t(values[i] == -128);
  return found == 0;
}

NetworkView read_network(const NetworkRecord& record, Payloads& payloads, const Place& place) {
  NetworkView view;
  kernels::Network& network = view.network;
  place.require(record.reserved == 0, "reserved bytes are not zero");
  place.within(record.layer_count, 1, kMaxLayers, "layer_count");
  place.require(std::isfinite(record.logit_scale) && record.logit_scale > 0,
                "logit_scale is not a finite number above 0");
  network.layer_count = record.layer_count;
  network.logit_scale = record.logit_scale;
  for (uint32_t l = 0; l < kMaxLayers; ++l) {
    const LayerRecord& layer = record.layers[l];
    if (l >= record.layer_count) {
      place.require(layer.inputs == 0 && layer.outputs == 0 && layer.shift == 0,
                    "a layer beyond layer_count is not zero");
      continue;
    }
    if (l == 0)
      place.within(layer.inputs, 4, kernels::kMaxInputs, "inputs of the first layer");
    else
      place.require(layer.inputs == record.layers[l - 1].outputs,
                    "a layer's inputs are not the outputs of the one before it");
    place.require(layer.inputs % 4 == 0, "a layer's inputs are no multiple of 4");
    if (l + 1 == record.layer_count)
      place.require(layer.outputs == 1, "the last layer has not one output");
    else
      place.within(layer.outputs, 4, kernels::kMaxWidth, "outputs of a hidden layer");
    place.within(layer.shift, 0, kernels::kMaxShift, "shift");
    view.bytes += layer.outputs * (sizeof(int32_t) + layer.inputs);
    network.layers[l] = {layer.inputs, layer.outputs, layer.shift, nullptr, nullptr};
  }

  const std::byte* at = payloads.next(record.weights, view.bytes, "weights", place).data();
  for (uint32_t l = 0; l < record.layer_count; ++l) {
    kernels::Network::Layer& layer = network.layers[l];
    layer.biases = reinterpret_cast<const int32_t*>(at);
    at += layer.outputs * sizeof(int32_t);
    layer.weights = reinterpret_cast<const int8_t*>(at);
    at += size_t(layer.outputs) * layer.inputs;
    place.require(std::all_of(layer.biases, layer.biases + layer.outputs,
                              [](int32_t b) { return b >= -kernels::kMaxBias && b <= kernels::kMaxBias; }),
                  "a bias is out of range");
    place.require(symmetric(layer.weights, uint64_t(layer.outputs) * layer.inputs), "a weight is -128");
  }
  return view;
}

/// Bits of those voxels of a brick that lie within the grid along one axis: `brick` is the brick's place
/// along it, `stride` how many bits on the next voxel is.
uint64_t bits_within(uint32_t voxels, uint32_t brick, uint32_t stride) {
  const uint64_t first = stride == 1 ? 0x1111111111111111u : stride == 4 ? 0x000f000f000f000fu : 0xffffu;
  uint64_t bits = 0;
  for (uint32_t v = 0; v < kernels::kBrickSide && brick * kernels::kBrickSide + v < voxels; ++v)
    bits |= first << (v * stride);
  return bits;
}

/// Kernels look up the corners around every surface voxel, and number bricks with surface voxels in 16
/// bits. So each mixed brick stands in the table once, and has no voxel beyond the grid.
void check_bricks(const kernels::SegmentField& field, const Place& place) {
  uint32_t next = kernels::kFirstMixedBrick;
  const uint16_t* entry = field.brick_table;
  for (uint32_t z = 0; z < field.bricks[2]; ++z)
    for (uint32_t y = 0; y < field.bricks[1]; ++y)
      for (uint32_t x = 0; x < field.bricks[0]; ++x, ++entry) {
        if (*entry < kernels::kFirstMixedBrick) continue;
        place.require(*entry == next, "brick_table does not name each mixed brick once, in order");
        place.require(next - kernels::kFirstMixedBrick < field.mixed_bricks,
                      "brick_table names a brick that is not there");
        const kernels::BrickStates& states = field.brick_states[next++ - kernels::kFirstMixedBrick];
        const uint64_t beyond = ~(bits_within(field.voxels[0], x, 1) & bits_within(field.voxels[1], y, 4) &
                                  bits_within(field.voxels[2], z, 16));
        place.require(((states.surface | states.aux) & beyond) == 0,
                      "brick_states has a voxel beyond the grid");
      }
  place.require(next - kernels::kFirstMixedBrick == field.mixed_bricks,
                "brick_table leaves out a mixed brick");
}

/// Planes are such as the baker makes, and links lead from voxels to parts and on to parts of these: the
/// links, voxels' first, name all parts in order, so that each part belongs to one, and no voxel is cut more
/// often than `levels` says.
void check_words(const kernels::SegmentField& field, const Place& place) {
  uint32_t next = 0;
  const auto check = [&](uint32_t word, bool may_link) {
    if (kernels::word_kind(word) == kernels::kLink) {
      place.require(may_link, "a voxel is cut more often than levels says");
      place.require(kernels::link_mask(word) != 0, "a cell is cut in no parts");
      place.require(kernels::link_first(word) == next, "links do not name all parts in order");
      next += uint32_t(std::popcount(kernels::link_mask(word)));
      return;
    }
    place.require(kernels::word_kind(word) < kernels::kPlaneKinds, "a cell is of an unknown kind");
    place.require((word >> 4 & 63) <= uint32_t(kernels::kNormalSum) &&
                      (word >> 10 & 63) <= uint32_t(kernels::kNormalSum),
                  "a normal is out of range");
    place.require(kernels::lower_place(word) < kernels::upper_place(word),
                  "a cell's lower plane is not below its upper plane");
  };
  for (uint32_t i = 0; i < field.surface_voxels; ++i) check(field.voxel_records[i], field.levels > 0);
  // Parts of voxels come first, then parts of those, and so on.
  uint32_t level_end = next, level = 1;
  for (uint32_t i = 0; i < field.part_count; ++i) {
    if (i == level_end) level_end = next, ++level;
    place.require(i < next, "a part belongs to no cell");
    check(field.parts[i], level < field.levels);
  }
  place.require(next == field.part_count, "part_count is not the number of parts that links name");
}

/// Sides are what the planes and voxels around say, or nothing.
void check_sides(const kernels::SegmentField& field, const Place& place) {
  const SideRegions sides(field);
  place.require(!sides.contradictory(), "planes join what is outside with what is inside");
  uint32_t record = 0;
  const auto check = [&](const uint32_t* words, uint32_t count) {
    for (uint32_t i = 0; i < count; ++i, ++record) {
      const uint32_t kind = kernels::word_kind(words[i]);
      if (kind >= kernels::kPlaneKinds) continue;
      const kernels::CellKind& known = kernels::kCellKinds[kind];
      place.require((known.above == 0 || known.above == sides.above(record)) &&
                        (known.below == 0 || known.below == sides.below(record)),
                    "a cell has a side that its planes and its neighbours do not prove");
    }
  };
  check(field.voxel_records, field.surface_voxels);
  check(field.parts, field.part_count);
}

}  // namespace

SegmentReader::SegmentReader(const SectionTable& sections, std::string_view file, SegmentSharedView& shared)
    : file_(file),
      shared_(shared),
      records_(sections[kSegments], "SEGM", file),
      occupancy_(sections[kOccupancy]),
      features_(sections[kFeatures]),
      cells_(sections[kCells]) {
  const Records<NetworkRecord> networks(sections[kNetworks], "NETS", file);
  Payloads weights(sections[kWeights]);
  shared.networks.reserve(networks.count());
  for (uint32_t i = 0; i < networks.count(); ++i)
    shared.networks.push_back(read_network(networks[i], weights, Place{file, "NETS", i}));
  weights.finish("WGTS", file);
}

SegmentView SegmentReader::read(uint32_t index, const Bounds&) {
  const SegmentRecord record = records_[index];
  const Place place{file_, "SEGM", index};
  SegmentView view;
  place.require(record.network < shared_.networks.size(), "network is out of range");
  view.network = record.network;
  kernels::SegmentField& field = view.field;
  place.require(all_finite(record.origin), "origin is not finite");
  place.require(std::isfinite(record.voxels_per_unit) && record.voxels_per_unit > 0,
                "voxels_per_unit is not a finite number above 0");
  place.require(std::isfinite(record.length_scale) && record.length_scale >= 0,
                "length_scale is negative or not finite");
  place.within(record.features_per_corner, 1, kernels::kMaxFeatures, "features_per_corner");
  place.within(record.samples, 1, kernels::kMaxSamples, "samples");
  place.require(record.features_per_corner * record.samples % 4 == 0,
                "samples times features_per_corner is no multiple of 4");
  std::copy_n(record.origin, 3, field.origin);
  place.within(record.levels, 0, kernels::kMaxLevels, "levels");
  set_scales(record.voxels_per_unit, record.length_scale, record.levels, field);
  place.require(std::isfinite(field.cells_per_unit), "voxels_per_unit is too large");
  field.features_per_corner = record.features_per_corner;
  field.samples = record.samples;
  field.network = shared_.networks[record.network].network;
  place.require(
      field.network.layers[0].inputs == record.samples * record.features_per_corner + kernels::kGlobalInputs,
      "its network takes another number of inputs");
  read_occupancy(record, view, place);
  read_cells(record, view, place);

  view.feature_bytes = uint64_t(record.corners) * record.features_per_corner;
  field.features = reinterpret_cast<const int8_t*>(
      features_.next(record.features, view.feature_bytes, "features", place).data());
  place.require(symmetric(field.features, view.feature_bytes), "a feature is -128");
  return view;
}

void SegmentReader::read_occupancy(const SegmentRecord& record, SegmentView& view, const Place& place) {
  kernels::SegmentField& field = view.field;
  uint64_t bricks = 1;
  for (int a = 0; a < 3; ++a) {
    place.within(record.voxels[a], 1, std::min(kernels::kMaxVoxels, kernels::kMaxCells >> record.levels),
                 "voxels");
    field.voxels[a] = record.voxels[a];
    field.bricks[a] = bricks_for(record.voxels[a]);
    bricks *= field.bricks[a];
  }
  // The table's entries have 16 bits, which limits the mixed bricks and with them the corners.
  const uint64_t mixed = record.mixed_bricks;
  place.within(mixed, 0, 0xffff - kernels::kFirstMixedBrick + 1, "mixed_bricks");
  field.mixed_bricks = record.mixed_bricks;
  field.corners = record.corners;
  view.occupancy_bytes = mixed * (sizeof(kernels::BrickStates) + sizeof(uint64_t) + 2 * sizeof(uint32_t)) +
                         bricks * sizeof(uint16_t);

  const std::byte* at = occupancy_.next(record.occupancy, view.occupancy_bytes, "occupancy", place).data();
  field.brick_states = reinterpret_cast<const kernels::BrickStates*>(at);
  at += mixed * sizeof(kernels::BrickStates);
  field.brick_corners = reinterpret_cast<const uint64_t*>(at);
  at += mixed * sizeof(uint64_t);
  field.corner_base = reinterpret_cast<const uint32_t*>(at);
  at += mixed * sizeof(uint32_t);
  field.voxel_base = reinterpret_cast<const uint32_t*>(at);
  at += mixed * sizeof(uint32_t);
  field.brick_table = reinterpret_cast<const uint16_t*>(at);

  uint32_t corners = 0, surface_voxels = 0;
  for (uint64_t i = 0; i < mixed; ++i) {
    place.require(field.corner_base[i] == corners, "corner_base is not the number of corners before");
    corners += uint32_t(std::popcount(field.brick_corners[i]));
    place.require(field.voxel_base[i] == surface_voxels,
                  "voxel_base is not the number of surface voxels before");
    surface_voxels += uint32_t(std::popcount(field.brick_states[i].surface & ~field.brick_states[i].aux));
  }
  place.require(corners == record.corners, "corners is not the number of bits in brick_corners");
  place.require(surface_voxels == record.surface_voxels,
                "surface_voxels is not the number of surface voxels in brick_states");
  field.surface_voxels = surface_voxels;
  check_bricks(field, place);
}

void SegmentReader::read_cells(const SegmentRecord& record, SegmentView& view, const Place& place) {
  kernels::SegmentField& field = view.field;
  place.within(record.part_count, 0, kernels::kMaxParts, "part_count");
  field.part_count = record.part_count;
  view.cell_bytes = (uint64_t{record.surface_voxels} + record.part_count) * sizeof(uint32_t);
  const std::byte* at = cells_.next(record.cells, view.cell_bytes, "cells", place).data();
  field.voxel_records = reinterpret_cast<const uint32_t*>(at);
  field.parts = field.voxel_records + field.surface_voxels;
  check_words(field, place);
  check_sides(field, place);
}

void SegmentReader::finish() const {
  occupancy_.finish("OCCU", file_);
  cells_.finish("CELL", file_);
  features_.finish("FEAT", file_);
}

void SegmentView::drop_bytes() {
  occupancy_bytes = cell_bytes = feature_bytes = 0;
  field.brick_table = nullptr;
  field.brick_states = nullptr;
  field.brick_corners = nullptr;
  field.corner_base = nullptr;
  field.voxel_base = nullptr;
  field.voxel_records = nullptr;
  field.parts = nullptr;
  field.features = nullptr;
  const float logit_scale = field.network.logit_scale;
  field.network = {};
  field.network.logit_scale = logit_scale;
}

}  // namespace nif::format
