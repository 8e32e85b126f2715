// The content of a .nif file's sections, checked record by record.
//
// Why no accepted network can overflow evaluate_network's 32-bit sums: a layer has at most
// max(kMaxInputs, kMaxWidth) = 264 inputs, each product is at most 127 * 127 in size, |bias| <= 2^26, and the
// rounding term is at most 2^23. 264 * 127 * 127 + 2^26 + 2^23 < 2^27. Features: the eight corner weights of
// a point sum to 2^21, so a sum is at most 127 * 2^21 < 2^28. Indices: there are at most 65533 * 64 corners,
// so corner * features_per_corner < 2^25.
#include "formats/nif/reader.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <string>

#include "formats/nif/asset.hpp"
#include "formats/nif/check_bvh.hpp"
#include "formats/nif/utf8.hpp"
#include "kernels/reference/half.hpp"
#include "kernels/reference/instance.hpp"

namespace nif::format {
namespace {

using kernels::kMaxLayers;
using Bytes = std::span<const std::byte>;

static_assert(kernels::kMaxInputs * 127ll * 127 + kernels::kMaxBias + (1ll << kernels::kMaxShift) <
              1ll << 28);
static_assert(kMaxLayers == std::size(NetworkRecord{}.layers));

/// One place in the file, for messages; built only where something is wrong.
struct Place {
  std::string_view file;
  const char* section;
  uint64_t record;

  [[noreturn]] void damaged(const std::string& what) const {
    refuse(Status::damaged_nif, file, text(), what);
  }
  void require(bool good, const char* what) const {
    if (!good) damaged(what);
  }
  void within(uint64_t value, uint64_t low, uint64_t high, const char* name) const {
    if (value < low || value > high)
      damaged(std::string(name) + " is " + std::to_string(value) + ", not " + std::to_string(low) + " to " +
              std::to_string(high));
  }
  std::string text() const {
    return std::string("section ") + section + ", record " + std::to_string(record);
  }
};

template <class T>
bool all_finite(const T& values) {
  return std::all_of(std::begin(values), std::end(values), [](float v) { return std::isfinite(v); });
}

template <class T>
bool all_zero(const T& values) {
  return std::all_of(std::begin(values), std::end(values), [](auto value) { return value == 0; });
}

/// No byte is -128: weights and features are symmetric, -127..127.
bool symmetric(const int8_t* values, uint64_t count) {
  uint32_t found = 0;
  for (uint64_t i = 0; i < count; ++i) found |= uint32_t(values[i] == -128);
  return found == 0;
}

/// None is NaN or larger than kernels::kMaxSphericalValue.
bool bounded(const kernels::SphericalValues& values, uint64_t count) {
  constexpr float kMost = kernels::kMaxSphericalValue;
  constexpr uint16_t kMostAsHalf = kernels::to_half(kMost);
  static_assert(kernels::from_half(kMostAsHalf) == kMost);
  uint32_t found = 0;
  if (values.half) {
    const auto* halves = static_cast<const uint16_t*>(values.data);
    for (uint64_t i = 0; i < count; ++i) found |= uint32_t((halves[i] & 0x7fff) > kMostAsHalf);
  } else {
    const auto* floats = static_cast<const float*>(values.data);
    for (uint64_t i = 0; i < count; ++i)
      found |= uint32_t(!(floats[i] <= kMost)) | uint32_t(!(floats[i] >= -kMost));
  }
  return found == 0;
}

/// Hands out the blocks of a section in the order of their records and sees to it that they fill it.
class Blocks {
 public:
  explicit Blocks(Bytes section) : section_(section) {}

  Bytes next(const Block& block, uint64_t expected, const char* name, const Place& place) {
    const std::string what = std::string(name) + " block";
    if (block.offset != aligned(end_)) place.damaged(what + " is not where the one before it ends");
    if (block.bytes != expected)
      place.damaged(what + " has " + std::to_string(block.bytes) + " bytes, not " + std::to_string(expected));
    if (block.offset > section_.size() || block.bytes > section_.size() - block.offset)
      place.damaged(what + " reaches past the end of its section");
    for (uint64_t at = end_; at < block.offset; ++at)
      if (section_[at] != std::byte{0}) place.damaged("padding before the " + what + " is not zero");
    end_ = block.offset + block.bytes;
    return section_.subspan(block.offset, block.bytes);
  }
  bool finished() const { return end_ == section_.size(); }

 private:
  Bytes section_;
  uint64_t end_ = 0;
};

/// Records of one section, copied out one at a time.
template <class Record>
class Records {
 public:
  Records(Bytes section, const char* name, std::string_view file) : section_(section) {
    if (section.size() % sizeof(Record) != 0 || section.size() / sizeof(Record) > 0xffffffffu)
      refuse(Status::damaged_nif, file, std::string("section ") + name,
             std::to_string(section.size()) + " bytes are no whole number of records of " +
                 std::to_string(sizeof(Record)));
  }
  uint32_t count() const { return uint32_t(section_.size() / sizeof(Record)); }
  Record operator[](uint32_t i) const {
    Record record;
    std::memcpy(&record, section_.data() + uint64_t(i) * sizeof(Record), sizeof(Record));
    return record;
  }

 private:
  Bytes section_;
};

/// What the blocks of objects are taken from.
struct ObjectBlocks {
  Blocks occupancy, features, bvhs, grids;
};

class Reader {
 public:
  Reader(Bytes bytes, std::string_view file, std::pmr::memory_resource* memory)
      : file_(file), asset_(memory) {
    asset_.bytes = bytes;
    asset_.sections = open_container(bytes, file, memory);
  }

  AssetView read() {
    find_sections();
    read_networks();
    read_spherical_networks();
    read_objects();
    read_instances();
    if (names_end_ != names_.size())
      refuse(Status::damaged_nif, file_, "section NAME", "bytes that belong to no name");
    return std::move(asset_);
  }

 private:
  void find_sections() {
    struct Known {
      uint32_t type;
      Bytes* bytes;
      bool found = false;
      bool optional = false;
    } known[] = {{kObjects, &objects_},
                 {kInstances, &instances_},
                 {kNames, &names_},
                 {kNetworks, &networks_},
                 {kWeights, &weights_},
                 {kOccupancy, &occupancy_},
                 {kFeatures, &features_},
                 {kBvhs, &bvhs_, false, true},
                 {kSphericalNetworks, &spherical_networks_, false, true},
                 {kSphericalWeights, &spherical_weights_, false, true},
                 {kGrids, &grids_, false, true}};
    for (const SectionView& section : asset_.sections) {
      const auto place = [&] { return "section " + section_name(section.type); };
      const bool required = section.flags & kRequired;
      if (section.type == kMetadata) {
        asset_.metadata = {reinterpret_cast<const char*>(section.bytes.data()), section.bytes.size()};
        if (required || asset_.metadata.empty() || !is_utf8(asset_.metadata))
          refuse(Status::damaged_nif, file_, place(), "is required, empty or not UTF-8");
        continue;
      }
      auto* match = std::find_if(std::begin(known), std::end(known),
                                 [&](const Known& k) { return k.type == section.type; });
      if (match == std::end(known)) {
        if (required) refuse(Status::unsupported_nif, file_, place(), "required, and newer than this build");
        continue;  // an optional section of a later version: skipped, as promised
      }
      if (!required) refuse(Status::damaged_nif, file_, place(), "is not marked as required");
      match->found = true;
      has_bvhs_ |= section.type == kBvhs;
      has_spherical_ |=
          section.type == kSphericalNetworks || section.type == kSphericalWeights || section.type == kGrids;
      *match->bytes = section.bytes;
    }
    for (const Known& k : known)
      if (!k.found && !k.optional)
        refuse(Status::damaged_nif, file_, "section " + section_name(k.type), "is missing");
  }

  std::string_view read_name(const Name& name, const Place& place) {
    place.require(name.offset == names_end_, "name does not follow the one before it");
    place.require(names_.size() - names_end_ > name.bytes, "name reaches past the end of section NAME");
    const std::string_view text(reinterpret_cast<const char*>(names_.data()) + name.offset, name.bytes);
    place.require(names_[name.offset + uint64_t(name.bytes)] == std::byte{0}, "name is not followed by a 0");
    place.require(text.find('\0') == text.npos && is_utf8(text), "name is not UTF-8 text");
    names_end_ += uint64_t(name.bytes) + 1;
    return text;
  }

  void read_networks() {
    const Records<NetworkRecord> records(networks_, "NETS", file_);
    Blocks blocks(weights_);
    asset_.networks.reserve(records.count());
    for (uint32_t i = 0; i < records.count(); ++i)
      asset_.networks.push_back(read_network(records[i], blocks, Place{file_, "NETS", i}));
    if (!blocks.finished())
      refuse(Status::damaged_nif, file_, "section WGTS", "bytes that belong to no network");
  }

  static NetworkView read_network(const NetworkRecord& record, Blocks& blocks, const Place& place) {
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

    const std::byte* at = blocks.next(record.weights, view.bytes, "weights", place).data();
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

  void read_spherical_networks() {
    const Records<SphericalNetworksRecord> records(spherical_networks_, "SNET", file_);
    Blocks blocks(spherical_weights_);
    asset_.spherical_networks.reserve(records.count());
    for (uint32_t i = 0; i < records.count(); ++i)
      asset_.spherical_networks.push_back(
          read_spherical_networks(records[i], blocks, Place{file_, "SNET", i}));
    if (!blocks.finished())
      refuse(Status::damaged_nif, file_, "section SWGT", "bytes that belong to no network");
  }

  static SphericalNetworksView read_spherical_networks(const SphericalNetworksRecord& record, Blocks& blocks,
                                                       const Place& place) {
    SphericalNetworksView view;
    place.within(record.half, 0, 1, "half");
    place.require(record.slope >= 0 && record.slope <= 1, "slope is not a number from 0 to 1");
    place.require(all_zero(record.reserved), "reserved bytes are not zero");
    view.slope = record.slope;
    const uint64_t size = record.half ? sizeof(uint16_t) : sizeof(float);
    uint64_t weights[2];
    const SphericalShapeRecord* shapes[] = {&record.outer, &record.inner};
    kernels::SphericalNetwork* networks[] = {&view.outer, &view.inner};
    for (int n = 0; n < 2; ++n) {
      const SphericalShapeRecord& shape = *shapes[n];
      place.within(shape.inputs, 1, kernels::kMaxSphericalInputs, "inputs");
      place.within(shape.width, 4, kernels::kMaxSphericalWidth, "width");
      place.require(shape.width % 4 == 0, "width is no multiple of 4");
      place.within(shape.hidden_layers, 1, kernels::kMaxSphericalLayers, "hidden_layers");
      weights[n] = kernels::spherical_weights(shape.inputs, shape.width, shape.hidden_layers);
      *networks[n] = {{nullptr, record.half != 0}, shape.inputs, shape.width, shape.hidden_layers};
    }
    view.bytes = (weights[0] + weights[1]) * size;
    const std::byte* at = blocks.next(record.weights, view.bytes, "weights", place).data();
    for (int n = 0; n < 2; ++n) {
      networks[n]->weights.data = at;
      at += weights[n] * size;
      place.require(bounded(networks[n]->weights, weights[n]), "a weight is NaN or beyond +-4096");
    }
    return view;
  }

  void read_objects() {
    const Records<ObjectRecord> records(objects_, "OBJS", file_);
    if (records.count() == 0) refuse(Status::damaged_nif, file_, "section OBJS", "holds no object");
    ObjectBlocks blocks{Blocks(occupancy_), Blocks(features_), Blocks(bvhs_), Blocks(grids_)};
    asset_.objects.reserve(records.count());
    size_t sphericals = 0;
    for (uint32_t i = 0; i < records.count(); ++i) sphericals += records[i].encoding == kSpherical;
    asset_.spherical_fields.reserve(sphericals);  // so that they stay where they are
    for (uint32_t i = 0; i < records.count(); ++i)
      asset_.objects.push_back(read_object(records[i], blocks, Place{file_, "OBJS", i}));
    if (!blocks.occupancy.finished())
      refuse(Status::damaged_nif, file_, "section OCCU", "bytes that belong to no object");
    if (!blocks.features.finished())
      refuse(Status::damaged_nif, file_, "section FEAT", "bytes that belong to no object");
    const auto any = [&](Encoding encoding) {
      return std::any_of(asset_.objects.begin(), asset_.objects.end(),
                         [&](const ObjectView& object) { return object.encoding == encoding; });
    };
    if (!blocks.bvhs.finished() || (has_bvhs_ && !any(kBvh)))
      refuse(Status::damaged_nif, file_, "section BVHS", "bytes that belong to no object");
    if (!blocks.grids.finished() || (has_spherical_ && !any(kSpherical)))
      refuse(Status::damaged_nif, file_, "section GRID", "is there, or holds bytes, for no object");
  }

  ObjectView read_object(const ObjectRecord& record, ObjectBlocks& blocks, const Place& place) {
    if (record.encoding != kSegment && record.encoding != kSpherical && record.encoding != kBvh)
      refuse(Status::unsupported_nif, file_, place.text(),
             "encoding " + std::to_string(record.encoding) +
                 "; this build reads 1 (segment), 2 (spherical) and 3 (bvh)");
    ObjectView view;
    view.encoding = Encoding(record.encoding);
    view.name = read_name(record.name, place);
    place.require(all_finite(record.aabb_min) && all_finite(record.aabb_max), "bounds are not finite");
    for (int a = 0; a < 3; ++a) place.require(record.aabb_min[a] <= record.aabb_max[a], "bounds are empty");
    place.require(std::isfinite(record.bias) && record.bias >= 0, "bias is negative or not finite");
    place.require(all_zero(record.reserved) && record.reserved_half == 0, "reserved bytes are not zero");
    view.network = record.network;
    view.bias = record.bias;
    view.triangles = record.triangles;
    std::copy_n(record.aabb_min, 3, view.aabb_min.begin());
    std::copy_n(record.aabb_max, 3, view.aabb_max.begin());
    if (view.encoding == kBvh) {
      read_bvh(record, view, blocks.bvhs, place);
    } else if (view.encoding == kSpherical) {
      read_spherical(record, view, blocks.grids, place);
    } else {
      read_segment(record, view, blocks.occupancy, blocks.features, place);
    }
    return view;
  }

  /// What is the same for every encoding, and nothing else.
  static ObjectRecord shared_part(const ObjectRecord& record) {
    ObjectRecord blank{};
    blank.encoding = record.encoding;
    blank.name = record.name;
    std::copy_n(record.aabb_min, 3, blank.aabb_min);
    std::copy_n(record.aabb_max, 3, blank.aabb_max);
    blank.bias = record.bias;
    blank.triangles = record.triangles;
    return blank;
  }

  void read_spherical(const ObjectRecord& record, ObjectView& view, Blocks& blocks, const Place& place) {
    ObjectRecord blank = shared_part(record);
    blank.network = record.network;
    blank.outer_resolution = record.outer_resolution;
    blank.inner_resolution = record.inner_resolution;
    blank.distance_resolution = record.distance_resolution;
    blank.outer_features = record.outer_features;
    blank.inner_features = record.inner_features;
    blank.distance_features = record.distance_features;
    blank.half_grids = record.half_grids;
    blank.grids = record.grids;
    place.require(std::memcmp(&blank, &record, sizeof(record)) == 0,
                  "members of `segment` or `bvh` are not zero");
    kernels::SphericalField& field = asset_.spherical_fields.emplace_back();
    view.spherical = &field;
    place.require(kernels::set_bounds(record.aabb_min, record.aabb_max, field),
                  "bounds are too small or too large to compute with");
    place.require(record.network < asset_.spherical_networks.size(), "network is out of range");
    const SphericalNetworksView& networks = asset_.spherical_networks[record.network];
    field.outer = networks.outer;
    field.inner = networks.inner;
    field.slope = networks.slope;
    place.within(record.half_grids, 0, 1, "half_grids");
    const std::pair<kernels::SphericalGrid*, bool> grids[] = {{&field.outer_position, true},
                                                              {&field.outer_direction, true},
                                                              {&field.inner_position, true},
                                                              {&field.inner_direction, true},
                                                              {&field.distance, false}};
    uint64_t counts[5], all = 0;
    for (size_t g = 0; g < 5; ++g) {
      kernels::SphericalGrid& grid = *grids[g].first;
      grid.resolution = g < 2   ? record.outer_resolution
                        : g < 4 ? record.inner_resolution
                                : record.distance_resolution;
      grid.features = g < 2   ? record.outer_features
                      : g < 4 ? record.inner_features
                              : record.distance_features;
      place.within(grid.resolution, 2, kernels::kMaxSphericalResolution, "a grid's resolution");
      place.within(grid.features, 1, kernels::kMaxSphericalFeatures, "a grid's number of features");
      counts[g] = uint64_t(grid.resolution) * (grids[g].second ? grid.resolution : 1) * grid.features;
      all += counts[g];
    }
    place.require(field.outer.inputs == 2 * field.outer_position.features &&
                      field.inner.inputs == 2 * field.inner_position.features + field.distance.features,
                  "its network takes another number of inputs");
    const uint64_t size = record.half_grids ? sizeof(uint16_t) : sizeof(float);
    view.grid_bytes = all * size;
    const std::byte* at = blocks.next(record.grids, view.grid_bytes, "grids", place).data();
    for (size_t g = 0; g < 5; ++g) {
      grids[g].first->values = {at, record.half_grids != 0};
      at += counts[g] * size;
      place.require(bounded(grids[g].first->values, counts[g]), "a latent vector is NaN or beyond +-4096");
    }
    view.reach_scale = field.reach_scale;
    view.logit_scale = kernels::kSphericalLogitScale;
  }

  static void read_bvh(const ObjectRecord& record, ObjectView& view, Blocks& blocks, const Place& place) {
    ObjectRecord blank = shared_part(record);
    blank.bvh = record.bvh;
    blank.bvh_nodes = record.bvh_nodes;
    blank.bvh_vertices = record.bvh_vertices;
    blank.bvh_triangles = record.bvh_triangles;
    place.require(std::memcmp(&blank, &record, sizeof(record)) == 0,
                  "members of `segment` or `spherical` are not zero");

    kernels::BvhField& field = view.bvh;
    field.node_count = record.bvh_nodes;
    field.vertex_count = record.bvh_vertices;
    field.triangle_count = record.bvh_triangles;
    const uint64_t node_bytes = uint64_t(record.bvh_nodes) * sizeof(kernels::BvhNode),
                   vertex_bytes = uint64_t(record.bvh_vertices) * sizeof(*field.vertices);
    view.bvh_bytes = node_bytes + vertex_bytes + uint64_t(record.bvh_triangles) * sizeof(*field.triangles);
    const std::byte* at = blocks.next(record.bvh, view.bvh_bytes, "bvh", place).data();
    field.nodes = reinterpret_cast<const kernels::BvhNode*>(at);
    field.vertices = reinterpret_cast<const float(*)[3]>(at + node_bytes);
    field.triangles = reinterpret_cast<const uint8_t(*)[3]>(at + node_bytes + vertex_bytes);
    if (const char* wrong = fault_of(field)) place.damaged(wrong);
    field.extent = kernels::bvh_extent(field.nodes[0]);
    view.reach_scale = kernels::kBvhUnits / field.extent;
  }

  void read_segment(const ObjectRecord& record, ObjectView& view, Blocks& occupancy, Blocks& features,
                    const Place& place) const {
    place.require(record.network < asset_.networks.size(), "network is out of range");
    place.require(record.bvh.offset == 0 && record.bvh.bytes == 0 && record.bvh_nodes == 0 &&
                      record.bvh_vertices == 0 && record.bvh_triangles == 0,
                  "members of `bvh` are not zero");
    place.require(record.outer_resolution == 0 && record.inner_resolution == 0 && record.grids.offset == 0 &&
                      record.grids.bytes == 0 && record.distance_resolution == 0 &&
                      record.outer_features == 0 && record.inner_features == 0 &&
                      record.distance_features == 0 && record.half_grids == 0,
                  "members of `spherical` are not zero");
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
    field.voxels_per_unit = record.voxels_per_unit;
    field.length_scale = record.length_scale;
    field.features_per_corner = record.features_per_corner;
    field.samples = record.samples;
    field.network = asset_.networks[record.network].network;
    view.reach_scale = record.voxels_per_unit;
    view.logit_scale = field.network.logit_scale;
    place.require(field.network.layers[0].inputs ==
                      record.samples * record.features_per_corner + kernels::kGlobalInputs,
                  "its network takes another number of inputs");
    read_occupancy(record, view, occupancy, place);

    view.feature_bytes = uint64_t(record.corners) * record.features_per_corner;
    field.features = reinterpret_cast<const int8_t*>(
        features.next(record.features, view.feature_bytes, "features", place).data());
    place.require(symmetric(field.features, view.feature_bytes), "a feature is -128");
  }

  static void read_occupancy(const ObjectRecord& record, ObjectView& view, Blocks& blocks,
                             const Place& place) {
    kernels::SegmentField& field = view.field;
    uint64_t bricks = 1;
    for (int a = 0; a < 3; ++a) {
      place.within(record.voxels[a], 1, kernels::kMaxVoxels, "voxels");
      field.voxels[a] = record.voxels[a];
      field.bricks[a] = bricks_for(record.voxels[a]);
      bricks *= field.bricks[a];
    }
    // The table's entries have 16 bits, which limits the mixed bricks and with them the corners.
    const uint64_t mixed = record.mixed_bricks;
    place.within(mixed, 0, 0xffff - kernels::kFirstMixedBrick + 1, "mixed_bricks");
    field.mixed_bricks = record.mixed_bricks;
    field.corners = record.corners;
    view.occupancy_bytes = mixed * (sizeof(kernels::BrickStates) + sizeof(uint64_t) + sizeof(uint32_t)) +
                           bricks * sizeof(uint16_t);

    const std::byte* at = blocks.next(record.occupancy, view.occupancy_bytes, "occupancy", place).data();
    field.brick_states = reinterpret_cast<const kernels::BrickStates*>(at);
    at += mixed * sizeof(kernels::BrickStates);
    field.brick_corners = reinterpret_cast<const uint64_t*>(at);
    at += mixed * sizeof(uint64_t);
    field.corner_base = reinterpret_cast<const uint32_t*>(at);
    at += mixed * sizeof(uint32_t);
    field.brick_table = reinterpret_cast<const uint16_t*>(at);

    uint32_t corners = 0;
    for (uint64_t i = 0; i < mixed; ++i) {
      place.require(field.corner_base[i] == corners, "corner_base is not the number of corners before");
      corners += uint32_t(std::popcount(field.brick_corners[i]));
    }
    place.require(corners == record.corners, "corners is not the number of bits in brick_corners");
    uint16_t highest = 0;
    for (uint64_t i = 0; i < bricks; ++i) highest = std::max(highest, field.brick_table[i]);
    place.require(highest < kernels::kFirstMixedBrick + mixed, "brick_table names a brick that is not there");
  }

  void read_instances() {
    const Records<InstanceRecord> records(instances_, "INST", file_);
    asset_.instances.reserve(records.count());
    for (uint32_t i = 0; i < records.count(); ++i) {
      const InstanceRecord record = records[i];
      const Place place{file_, "INST", i};
      InstanceView view;
      view.name = read_name(record.name, place);
      place.require(record.object < asset_.objects.size(), "object is out of range");
      place.require(record.reserved == 0, "reserved bytes are not zero");
      place.require(all_finite(record.transform), "transform is not finite");
      view.object = record.object;
      std::copy_n(record.transform, 12, view.transform.begin());
      asset_.instances.push_back(view);
    }
  }

  std::string_view file_;
  AssetView asset_;
  Bytes objects_, instances_, names_, networks_, weights_, occupancy_, features_, bvhs_;
  Bytes spherical_networks_, spherical_weights_, grids_;
  uint64_t names_end_ = 0;
  bool has_bvhs_ = false, has_spherical_ = false;
};

}  // namespace

AssetView read_asset(std::span<const std::byte> bytes, std::string_view file_name,
                     std::pmr::memory_resource* memory) {
  if (reinterpret_cast<uintptr_t>(bytes.data()) % kAddressAlignment != 0)
    refuse(Status::usage, file_name, "",
           "its bytes lie at an address that is no multiple of " + std::to_string(kAddressAlignment));
  return Reader(bytes, file_name, memory).read();
}

uint64_t AssetView::resident_bytes() const {
  return bytes.size() + sections.capacity() * sizeof(SectionView) + objects.capacity() * sizeof(ObjectView) +
         instances.capacity() * sizeof(InstanceView) + networks.capacity() * sizeof(NetworkView) +
         spherical_networks.capacity() * sizeof(SphericalNetworksView) +
         spherical_fields.capacity() * sizeof(kernels::SphericalField);
}

}  // namespace nif::format
