// Lays out the sections of a .nif file; formats/nif/layout.hpp and docs/format.md say what goes where.
#include "formats/nif/writer.hpp"

#include <algorithm>
#include <cstring>
#include <span>

#include "formats/nif/crc32c.hpp"
#include "formats/nif/reader.hpp"
#include "formats/nif/utf8.hpp"
#include "kernels/reference/half.hpp"

namespace nif::format {
namespace {

/// The bytes of one section as they grow.
class Section {
 public:
  template <class T>
  void append(const T* values, size_t count) {
    static_assert(std::is_trivially_copyable_v<T>);
    const auto bytes = std::as_bytes(std::span(values, count));
    bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
  }
  template <class T>
  void append(const std::vector<T>& values) {
    append(values.data(), values.size());
  }
  /// In half precision or as they are.
  void append_values(const std::vector<float>& values, bool half) {
    if (!half) return append(values);
    std::vector<uint16_t> halves;
    for (const float value : values) halves.push_back(kernels::to_half(value));
    append(halves);
  }
  Block begin_block() {
    bytes_.resize(aligned(bytes_.size()));
    return {bytes_.size(), 0};
  }
  void end_block(Block& block) const { block.bytes = bytes_.size() - block.offset; }
  Name append_name(const std::string& name) {
    const Name place{uint32_t(bytes_.size()), uint32_t(name.size())};
    append(name.c_str(), name.size() + 1);
    return place;
  }
  const std::vector<std::byte>& bytes() const { return bytes_; }

 private:
  std::vector<std::byte> bytes_;
};

struct Sections {
  Section objects, instances, names, networks, weights, occupancy, features, bvhs, metadata;
  Section spherical_networks, spherical_weights, grids, primaries, primary_values;
};

void add_network(const Network& network, Sections& out) {
  NetworkRecord record{};
  if (network.layers.size() > std::size(record.layers))
    throw Error(Status::internal,
                "an asset's network has " + std::to_string(network.layers.size()) + " layers");
  record.layer_count = uint32_t(network.layers.size());
  record.logit_scale = network.logit_scale;
  record.weights = out.weights.begin_block();
  for (size_t l = 0; l < network.layers.size(); ++l) {
    const Layer& layer = network.layers[l];
    record.layers[l] = {layer.inputs, layer.outputs, layer.shift};
    out.weights.append(layer.biases);
    out.weights.append(layer.weights);
  }
  out.weights.end_block(record.weights);
  out.networks.append(&record, 1);
}

SphericalShapeRecord shape_of(const SphericalLayers& layers) {
  return {layers.inputs, layers.width, layers.hidden_layers};
}

void add_networks(const SphericalNetworks& networks, Sections& out) {
  SphericalNetworksRecord record{};
  record.half = networks.half;
  record.slope = networks.slope;
  record.outer = shape_of(networks.outer);
  record.inner = shape_of(networks.inner);
  record.weights = out.spherical_weights.begin_block();
  out.spherical_weights.append_values(networks.outer.weights, networks.half);
  out.spherical_weights.append_values(networks.inner.weights, networks.half);
  out.spherical_weights.end_block(record.weights);
  out.spherical_networks.append(&record, 1);
}

void add_spherical(const SphericalGrids& grids, ObjectRecord& record, Sections& out) {
  record.outer_resolution = uint16_t(grids.outer_resolution);
  record.inner_resolution = uint16_t(grids.inner_resolution);
  record.distance_resolution = uint16_t(grids.distance_resolution);
  record.outer_features = uint8_t(grids.outer_features);
  record.inner_features = uint8_t(grids.inner_features);
  record.distance_features = uint8_t(grids.distance_features);
  record.half_grids = grids.half;
  record.grids = out.grids.begin_block();
  for (const std::vector<float>* values : {&grids.outer_position, &grids.outer_direction,
                                           &grids.inner_position, &grids.inner_direction, &grids.distance})
    out.grids.append_values(*values, grids.half);
  out.grids.end_block(record.grids);
}

void add_primary(const Primary& primary, uint32_t object, Sections& out) {
  PrimaryRecord record{};
  record.object = object;
  record.resolution = uint16_t(primary.resolution);
  record.features = uint8_t(primary.features);
  record.half_grids = primary.half_grids;
  record.half_network = primary.half_network;
  record.slope = primary.slope;
  record.margin = primary.margin;
  record.network = shape_of(primary.network);
  record.values = out.primary_values.begin_block();
  out.primary_values.append_values(primary.position, primary.half_grids);
  out.primary_values.append_values(primary.direction, primary.half_grids);
  out.primary_values.append_values(primary.network.weights, primary.half_network);
  out.primary_values.end_block(record.values);
  out.primaries.append(&record, 1);
}

void add_segment(const Object& object, ObjectRecord& record, Sections& out) {
  std::copy(object.origin.begin(), object.origin.end(), record.origin);
  record.voxels_per_unit = object.voxels_per_unit;
  std::copy(object.voxels.begin(), object.voxels.end(), record.voxels);
  record.mixed_bricks = uint32_t(object.brick_states.size());
  record.corners = object.corners;
  record.features_per_corner = object.features_per_corner;
  record.samples = object.samples;
  record.length_scale = object.length_scale;

  record.occupancy = out.occupancy.begin_block();
  out.occupancy.append(object.brick_states);
  out.occupancy.append(object.brick_corners);
  out.occupancy.append(object.corner_base);
  out.occupancy.append(object.brick_table);
  out.occupancy.end_block(record.occupancy);
  record.features = out.features.begin_block();
  out.features.append(object.features);
  out.features.end_block(record.features);
}

void add_object(const Object& object, Sections& out) {
  ObjectRecord record{};
  record.encoding = object.encoding;
  record.network = object.network;
  record.name = out.names.append_name(object.name);
  std::copy(object.aabb_min.begin(), object.aabb_min.end(), record.aabb_min);
  std::copy(object.aabb_max.begin(), object.aabb_max.end(), record.aabb_max);
  record.bias = object.bias;
  record.triangles = object.triangles;
  if (object.encoding == kBvh) {
    record.bvh_nodes = uint32_t(object.bvh.nodes.size());
    record.bvh_vertices = uint32_t(object.bvh.vertices.size());
    record.bvh_triangles = uint32_t(object.bvh.triangles.size());
    record.bvh = out.bvhs.begin_block();
    out.bvhs.append(object.bvh.nodes);
    out.bvhs.append(object.bvh.vertices);
    out.bvhs.append(object.bvh.triangles);
    out.bvhs.end_block(record.bvh);
  } else if (object.encoding == kSpherical) {
    add_spherical(object.grids, record, out);
  } else {
    add_segment(object, record, out);
  }
  out.objects.append(&record, 1);
}

void add_instance(const Instance& instance, Sections& out) {
  InstanceRecord record{};
  std::copy(instance.transform.begin(), instance.transform.end(), record.transform);
  record.object = instance.object;
  record.name = out.names.append_name(instance.name);
  out.instances.append(&record, 1);
}

template <class T>
void store(std::vector<std::byte>& file, uint64_t offset, const T& value) {
  std::memcpy(file.data() + offset, &value, sizeof(value));
}

}  // namespace

std::vector<std::byte> encode(const Asset& asset) {
  Sections out;
  for (const Network& network : asset.networks) add_network(network, out);
  for (const SphericalNetworks& networks : asset.spherical_networks) add_networks(networks, out);
  for (const Object& object : asset.objects) add_object(object, out);
  for (uint32_t i = 0; i < asset.objects.size(); ++i)
    if (const std::optional<Primary>& primary = asset.objects[i].primary) add_primary(*primary, i, out);
  for (const Instance& instance : asset.instances) add_instance(instance, out);
  out.metadata.append(asset.metadata.data(), asset.metadata.size());

  // Small tables first: one page holds what a tool needs to describe the file. Features before occupancy, so
  // that a vector load at the last feature stays inside the file.
  struct Part {
    uint32_t type, flags;
    const std::vector<std::byte>& bytes;
  };
  std::vector<Part> parts = {
      {kObjects, kRequired, out.objects.bytes()},    {kInstances, kRequired, out.instances.bytes()},
      {kNetworks, kRequired, out.networks.bytes()},  {kNames, kRequired, out.names.bytes()},
      {kWeights, kRequired, out.weights.bytes()},    {kFeatures, kRequired, out.features.bytes()},
      {kOccupancy, kRequired, out.occupancy.bytes()}};
  if (!out.bvhs.bytes().empty()) parts.push_back({kBvhs, kRequired, out.bvhs.bytes()});
  if (!asset.spherical_networks.empty()) {
    parts.push_back({kSphericalNetworks, kRequired, out.spherical_networks.bytes()});
    parts.push_back({kSphericalWeights, kRequired, out.spherical_weights.bytes()});
    parts.push_back({kGrids, kRequired, out.grids.bytes()});
  }
  if (!out.primaries.bytes().empty()) {
    parts.push_back({kPrimaries, 0, out.primaries.bytes()});
    parts.push_back({kPrimaryValues, 0, out.primary_values.bytes()});
  }
  if (!asset.metadata.empty()) parts.push_back({kMetadata, 0, out.metadata.bytes()});

  std::vector<std::byte> file(sizeof(Header) + parts.size() * sizeof(SectionEntry));
  for (size_t i = 0; i < parts.size(); ++i) {
    const auto& bytes = parts[i].bytes;
    file.resize(aligned(file.size()));
    store(file, sizeof(Header) + i * sizeof(SectionEntry),
          SectionEntry{parts[i].type, parts[i].flags, file.size(), bytes.size(), crc32c(bytes), 0});
    file.insert(file.end(), bytes.begin(), bytes.end());
  }
  Header header{};
  std::copy(std::begin(kIdentifier), std::end(kIdentifier), header.identifier);
  header.version = kVersion;
  header.file_bytes = file.size();
  header.section_count = uint32_t(parts.size());
  header.table_crc = crc32c(std::span(file).subspan(sizeof(Header), parts.size() * sizeof(SectionEntry)));
  header.header_crc = crc32c(std::as_bytes(std::span(&header, 1)));
  store(file, 0, header);

  try {
    read_asset(file, "the asset to be written");
  } catch (const Error& error) {
    throw Error(Status::internal, error.what());
  }
  return file;
}

std::string clean_name(std::string_view text) {
  std::string clean;
  while (!text.empty()) {
    const size_t bytes = text[0] == '\0' ? 0 : utf8_sequence(text);
    if (bytes == 0)
      clean += "\xef\xbf\xbd";
    else
      clean += text.substr(0, bytes);
    text.remove_prefix(std::max<size_t>(bytes, 1));
  }
  return clean;
}

}  // namespace nif::format
