// Why no accepted network can overflow evaluate_network's 32-bit sums: a layer has at most
// max(kMaxInputs, kMaxWidth) = 296 inputs, each product is at most 127 * 127 in size, |bias| <= 2^26, and the
// rounding term is at most 2^23. 296 * 127 * 127 + 2^26 + 2^23 < 2^27. The last sum, the logit, plus the
// threshold is within 2^27 + 2^27. Features: the eight corner weights of
// a point sum to 2^21, so a sum is at most 127 * 2^21 < 2^28. Indices: there are at most 65533 * 64 corners,
// so corner * features_per_corner < 2^25.
#include <algorithm>
#include <bit>

#include "formats/nif/segment/check.hpp"
#include "formats/nif/segment/decode.hpp"
#include "formats/nif/segment/encoding.hpp"
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
  place.require(record.threshold >= -kernels::kMaxThreshold && record.threshold <= kernels::kMaxThreshold,
                "threshold is out of range");
  network.layer_count = record.layer_count;
  network.calibration = {record.logit_scale, record.threshold};
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

/// Gives decoded words the kinds that say all that is proven. Where a file states kinds, some must say less.
void complete_kinds(const SideRegions& sides, bool stated, std::span<uint32_t> words, const Place& place) {
  bool same = true;
  for (uint32_t i = 0; i < words.size(); ++i) {
    const uint32_t kind = kernels::word_kind(words[i]);
    if (kind == kernels::kLink) continue;
    const uint32_t proven = proven_kind(sides, i, separates(kind));
    same = same && kind == proven;
    if (stated) continue;
    place.require(proven < kernels::kPlaneKinds, "a cell does not separate sides that are proven to differ");
    words[i] = (words[i] & ~15u) | proven;
  }
  place.require(!stated || !same, "forms states kinds that follow from the planes");
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

struct SegmentReader::InFile {
  Bytes occupancy, cells, features;
};

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
  place.require(record.samples % 4 == 0, "samples is no multiple of 4");
  std::copy_n(record.origin, 3, field.origin);
  place.within(record.levels, 0, kernels::kMaxLevels, "levels");
  set_scales(record.voxels_per_unit, record.length_scale, record.levels, field);
  place.require(std::isfinite(field.cells_per_unit), "voxels_per_unit is too large");
  field.features_per_corner = record.features_per_corner;
  field.samples = record.samples;
  field.network = shared_.networks[record.network].network;
  place.require(
      field.network.layers[0].inputs == kernels::input_count(record.samples, record.features_per_corner),
      "its network takes another number of inputs");
  place.require((record.forms & ~uint32_t{kPayloadForms}) == 0 && record.reserved == 0,
                "forms has unknown bits, or reserved bytes are not zero");
  place.require((record.forms & kCodedOccupancy) != 0 || (record.forms & kStatedCorners) == 0,
                "forms states corners of an occupancy that is not coded");
  place.require((record.forms & kCodedCells) != 0 || (record.forms & kStatedKinds) == 0,
                "forms states kinds of cells that are not coded");
  view.coded = record.forms & kCodedPayloads;
  for (int a = 0; a < 3; ++a) {
    place.within(record.voxels[a], 1, std::min(kernels::kMaxVoxels, kernels::kMaxCells >> record.levels),
                 "voxels");
    field.voxels[a] = record.voxels[a];
    field.bricks[a] = bricks_for(record.voxels[a]);
  }
  // The table's entries have 16 bits, which limits the mixed bricks and with them the corners.
  place.within(record.mixed_bricks, 0, 0xffff - kernels::kFirstMixedBrick + 1, "mixed_bricks");
  place.within(record.part_count, 0, kernels::kMaxParts, "part_count");
  field.mixed_bricks = record.mixed_bricks;
  field.surface_voxels = record.surface_voxels;
  field.part_count = record.part_count;
  field.corners = record.corners;

  const InFile in_file = take(record, UncodedBytes(record), place);
  read_occupancy(record, in_file.occupancy, view, place);
  read_cells(record, in_file.cells, view, place);
  read_features(record, in_file.features, view, place);
  return view;
}

/// All payloads, before there is memory for what they decode to.
SegmentReader::InFile SegmentReader::take(const SegmentRecord& record, const UncodedBytes& uncoded,
                                          const Place& place) {
  const auto next = [&](Payloads& payloads, const Payload& payload, uint32_t form, uint64_t bytes,
                        const char* name) {
    const bool coded = (record.forms & form) != 0;
    if (coded && payload.bytes >= bytes)
      place.damaged(std::string(name) + " payload is coded, but no smaller for it");
    return payloads.next(payload, coded ? payload.bytes : bytes, name, place);
  };
  InFile in_file;
  in_file.occupancy = next(occupancy_, record.occupancy, kCodedOccupancy, uncoded.occupancy, "occupancy");
  in_file.cells = next(cells_, record.cells, kCodedCells, uncoded.cells, "cells");
  in_file.features = next(features_, record.features, kCodedFeatures, uncoded.features, "features");
  const uint64_t bytes = in_file.occupancy.size() + in_file.cells.size() + in_file.features.size();
  place.require((record.forms & kCodedPayloads) == 0 || uncoded.may_take(bytes),
                "payloads decode to more than 16 times their bytes, or have more bricks than half as many");
  return in_file;
}

/// Where the payload is as a field uses it: in the file, or in memory that decode(memory) has filled.
/// `bytes` is how many it has there.
template <class Decode>
const std::byte* SegmentReader::usable(Bytes payload, bool coded, uint64_t bytes, const char* name,
                                       const Place& place, PayloadBytes& taken, const Decode& decode) {
  taken.file = payload.size();
  if (!coded) return payload.data();
  // One line more, because kernels load more than the last few bytes.
  const uint64_t lines = aligned(bytes) / kAlignment + 1;
  taken.decoded = lines * kAlignment;
  std::byte* const to = shared_.decoded.emplace_back(lines).front().bytes;
  if (!decode(to)) place.damaged(std::string(name) + " payload is not what an encoder makes");
  return to;
}

void SegmentReader::read_occupancy(const SegmentRecord& record, Bytes payload, SegmentView& view,
                                   const Place& place) {
  kernels::SegmentField& field = view.field;
  const std::byte* at = usable(payload, (record.forms & kCodedOccupancy) != 0, UncodedBytes(record).occupancy,
                               "occupancy", place, view.occupancy, [&](std::byte* to) {
                                 const bool stated = (record.forms & kStatedCorners) != 0;
                                 return decode_occupancy(payload, stated, field, to);
                               });
  const size_t mixed = field.mixed_bricks;
  field.brick_states = reinterpret_cast<const kernels::BrickStates*>(at);
  at += mixed * sizeof(kernels::BrickStates);
  field.brick_corners = reinterpret_cast<const uint64_t*>(at);
  at += mixed * sizeof(uint64_t);
  field.corner_base = reinterpret_cast<const uint32_t*>(at);
  at += mixed * sizeof(uint32_t);
  field.voxel_base = reinterpret_cast<const uint32_t*>(at);
  at += mixed * sizeof(uint32_t);
  field.brick_table = reinterpret_cast<const uint16_t*>(at);
  if (const char* fault = fault_of_bricks(field)) place.damaged(fault);
}

void SegmentReader::read_cells(const SegmentRecord& record, Bytes payload, SegmentView& view,
                               const Place& place) {
  kernels::SegmentField& field = view.field;
  const bool coded = (record.forms & kCodedCells) != 0, stated = (record.forms & kStatedKinds) != 0;
  uint32_t* words = nullptr;
  const std::byte* at =
      usable(payload, coded, UncodedBytes(record).cells, "cells", place, view.cells, [&](std::byte* to) {
        words = reinterpret_cast<uint32_t*>(to);
        return decode_cells(payload, stated, field, to);
      });
  field.voxel_records = reinterpret_cast<const uint32_t*>(at);
  field.parts = field.voxel_records + field.surface_voxels;
  if (const char* fault = fault_of_words(field)) place.damaged(fault);
  const SideRegions sides(field);
  if (coded) complete_kinds(sides, stated, {words, size_t{field.surface_voxels} + field.part_count}, place);
  if (const char* fault = fault_of_sides(field, sides)) place.damaged(fault);
}

void SegmentReader::read_features(const SegmentRecord& record, Bytes payload, SegmentView& view,
                                  const Place& place) {
  kernels::SegmentField& field = view.field;
  const uint64_t bytes = UncodedBytes(record).features;
  field.features = reinterpret_cast<const int8_t*>(
      usable(payload, (record.forms & kCodedFeatures) != 0, bytes, "features", place, view.features,
             [&](std::byte* to) { return decode_features(payload, field, to); }));
  place.require(symmetric(field.features, bytes), "a feature is -128");
}

void SegmentReader::finish() const {
  occupancy_.finish("OCCU", file_);
  cells_.finish("CELL", file_);
  features_.finish("FEAT", file_);
}

void SegmentView::drop_bytes() {
  occupancy = cells = features = {};
  field.brick_table = nullptr;
  field.brick_states = nullptr;
  field.brick_corners = nullptr;
  field.corner_base = nullptr;
  field.voxel_base = nullptr;
  field.voxel_records = nullptr;
  field.parts = nullptr;
  field.features = nullptr;
  const kernels::Calibration calibration = field.network.calibration;
  field.network = {};
  field.network.calibration = calibration;
}

}  // namespace nif::format
