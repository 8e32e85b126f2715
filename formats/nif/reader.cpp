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
#include "formats/nif/bvh/check.hpp"
#include "formats/nif/records.hpp"
#include "formats/nif/spherical/read.hpp"
#include "formats/nif/utf8.hpp"
#include "kernels/reference/instance.hpp"

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
    read_primaries();
    read_instances();
    if (names_end_ != names_.size())
      refuse(Status::damaged_nif, file_, "section NAME", "bytes that belong to no name");
    return std::move(asset_);
  }

 private:
  void find_sections() {
    enum class Kind {
      everywhere,  ///< in every file
      as_needed,   ///< where an object needs it, and then required of readers
      optional,    ///< where an object has it, for readers that know it
    };
    struct Known {
      uint32_t type;
      Bytes* bytes;
      Kind kind = Kind::everywhere;
      bool found = false;
    } known[] = {{kObjects, &objects_},
                 {kInstances, &instances_},
                 {kNames, &names_},
                 {kNetworks, &networks_},
                 {kWeights, &weights_},
                 {kOccupancy, &occupancy_},
                 {kFeatures, &features_},
                 {kBvhs, &bvhs_, Kind::as_needed},
                 {kSphericalNetworks, &spherical_networks_, Kind::as_needed},
                 {kSphericalWeights, &spherical_weights_, Kind::as_needed},
                 {kGrids, &grids_, Kind::as_needed},
                 {kPrimaries, &primaries_, Kind::optional},
                 {kPrimaryValues, &primary_values_, Kind::optional}};
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
      if (required == (match->kind == Kind::optional))
        refuse(Status::damaged_nif, file_, place(),
               required ? "is marked as required" : "is not marked as required");
      match->found = true;
      has_bvhs_ |= section.type == kBvhs;
      has_spherical_ |=
          section.type == kSphericalNetworks || section.type == kSphericalWeights || section.type == kGrids;
      has_primaries_ |= section.type == kPrimaries || section.type == kPrimaryValues;
      *match->bytes = section.bytes;
    }
    for (const Known& k : known)
      if (!k.found && k.kind == Kind::everywhere)
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
          format::read_spherical_networks(records[i], blocks, Place{file_, "SNET", i}));
    if (!blocks.finished())
      refuse(Status::damaged_nif, file_, "section SWGT", "bytes that belong to no network");
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
    place.require(record.network < asset_.spherical_networks.size(), "network is out of range");
    kernels::SphericalField& field = asset_.spherical_fields.emplace_back();
    view.spherical = &field;
    view.grid_bytes =
        read_spherical_field(record, asset_.spherical_networks[record.network], blocks, place, field);
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
    check_bricks(field, place);
  }

  /// Kernels look up the corners around every surface voxel, and number bricks with surface voxels in 16
  /// bits. So each mixed brick stands in the table once, and has no voxel beyond the grid.
  static void check_bricks(const kernels::SegmentField& field, const Place& place) {
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

  /// Bits of those voxels of a brick that lie within the grid along one axis: `brick` is the brick's place
  /// along it, `stride` how many bits on the next voxel is.
  static uint64_t bits_within(uint32_t voxels, uint32_t brick, uint32_t stride) {
    const uint64_t first = stride == 1 ? 0x1111111111111111u : stride == 4 ? 0x000f000f000f000fu : 0xffffu;
    uint64_t bits = 0;
    for (uint32_t v = 0; v < kernels::kBrickSide && brick * kernels::kBrickSide + v < voxels; ++v)
      bits |= first << (v * stride);
    return bits;
  }

  void read_primaries() {
    const Records<PrimaryRecord> records(primaries_, "PRIM", file_);
    Blocks blocks(primary_values_);
    asset_.primaries.reserve(records.count());
    for (uint32_t i = 0; i < records.count(); ++i) {
      const PrimaryRecord record = records[i];
      const Place place{file_, "PRIM", i};
      place.require(record.object < asset_.objects.size(), "object is out of range");
      place.require(i == 0 || record.object > asset_.primaries.back().object,
                    "object does not come after that of the record before");
      asset_.primaries.push_back(read_primary(record, asset_.objects[record.object], blocks, place));
    }
    if (!blocks.finished() || (has_primaries_ && records.count() == 0))
      refuse(Status::damaged_nif, file_, "section PVAL", "is there, or holds bytes, for no object");
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
  Bytes spherical_networks_, spherical_weights_, grids_, primaries_, primary_values_;
  uint64_t names_end_ = 0;
  bool has_bvhs_ = false, has_spherical_ = false, has_primaries_ = false;
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
         spherical_fields.capacity() * sizeof(kernels::SphericalField) +
         primaries.capacity() * sizeof(PrimaryView);
}

const PrimaryView* AssetView::primary_of(uint32_t object) const {
  const auto at = std::lower_bound(primaries.begin(), primaries.end(), object,
                                   [](const PrimaryView& view, uint32_t o) { return view.object < o; });
  return at != primaries.end() && at->object == object ? &*at : nullptr;
}

}  // namespace nif::format
