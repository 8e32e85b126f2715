// Two ways. Sections are changed and checksums put right: readers mostly refuse that. Or the asset is
// read, changed so that it still fits together, and written: most of these reach the kernels.
#include "tests/fuzz/mutate.hpp"

#include <algorithm>
#include <bit>

#include "formats/nif/writer.hpp"
#include "tests/support/random_asset.hpp"

namespace nif::test {
namespace {

/// Bytes of what a section is an array of; 1 where that differs.
size_t record_bytes(const Part& part) { return part.record_size ? part.record_size : 1; }

/// Of what a payload begins with.
size_t unit_of(const PayloadKind& kind) {
  if (kind.records == format::kTriangles) return sizeof(kernels::BvhNode);
  if (kind.records == format::kPlanes && kind.at == payload::kOccupancy.at)
    return sizeof(kernels::BrickStates);
  return kind.records == format::kNetworks ? sizeof(uint64_t) : sizeof(uint32_t);
}

constexpr uint32_t kWords[] = {0,          1,          2,          3,          4,          7,
                               8,          16,         32,         63,         64,         127,
                               128,        255,        256,        511,        512,        513,
                               2047,       2048,       0xffff,     0x10000,    0x00ffffff, 0x01000000,
                               0x7fffffff, 0x80000000, 0xfffffff0, 0xffffffff, 0x3f800000, 0x00800000,
                               0x00000001, 0x7f7fffff, 0x7f800000, 0xff800000, 0x7fc00000, 0x5d800000};

/// Returns another value for a number in a file.
uint32_t changed_word(uint32_t word, Random& random) {
  switch (random.below(4)) {
    case 0:
      return kWords[random.below(std::size(kWords))];
    case 1:
      return word + uint32_t(random.between(-4, 4));
    case 2:
      return word ^ 1u << random.below(32);
    default:
      return random.below(2) ? word * 2 : word / 2;
  }
}

/// Changes one field of one record, a number of 4, 2 or 1 bytes: to another value, or to that of another
/// record.
void change_field(Part& part, Random& random) {
  const size_t record = record_bytes(part), count = part.content.size() / record;
  if (count == 0 || record < 4) return;
  const uint32_t width = random.below(4) ? 4 : 1u << random.below(2);
  const size_t at = random.below(uint32_t(record / width)) * width;
  std::byte* const field = part.content.data() + random.below(uint32_t(count)) * record + at;
  uint32_t word = 0;
  std::memcpy(&word, field, width);
  if (random.below(4) == 0)
    std::memcpy(&word, part.content.data() + random.below(uint32_t(count)) * record + at, width);
  else
    word = changed_word(word, random);
  std::memcpy(field, &word, width);
}

/// Changes one bit or one word.
void change_table(Part& part, Random& random) {
  if (part.content.empty()) return;
  const uint32_t at = random.below(uint32_t(part.content.size()));
  if (random.below(2) == 0 || part.content.size() < 4) {
    part.content[at] ^= std::byte(1u << random.below(8));
    return;
  }
  const uint32_t width = 1u << random.below(3), start = at / 4 * 4;
  if (start + 4 > part.content.size()) return;
  uint32_t word = 0;
  std::memcpy(&word, part.content.data() + start, width);
  word = changed_word(word, random);
  std::memcpy(part.content.data() + start, &word, width);
}

/// Swaps, duplicates, removes or adds whole records, or chunks if there are no records.
void move_pieces(Part& part, Random& random) {
  size_t unit = record_bytes(part);
  if (unit == 1) unit = random.below(2) ? 64 : 1 + random.below(16);
  Bytes& content = part.content;
  const auto count = uint32_t(content.size() / unit);
  const auto start = [&](uint32_t i) { return content.begin() + ptrdiff_t(i * unit); };
  if (count == 0) {  // maybe because a changed table says that records have a gigabyte
    content.resize(content.size() + std::min<size_t>(unit, 4096));
    return;
  }
  const uint32_t one = random.below(count), other = random.below(count);
  switch (random.below(4)) {
    case 0:
      if (one != other) std::swap_ranges(start(one), start(one) + ptrdiff_t(unit), start(other));
      break;
    case 1: {
      const Bytes copy(start(one), start(one) + ptrdiff_t(unit));
      content.insert(start(other), copy.begin(), copy.end());
      break;
    }
    case 2:
      content.erase(start(one), start(one) + ptrdiff_t(unit));
      break;
    default:
      content.resize(content.size() + unit, std::byte(random.below(2) ? 0 : random.below(256)));
  }
}

void mutate_part(Part& part, MutateBytes mutate_bytes) {
  Bytes& content = part.content;
  const size_t size = content.size(), room = size + 64;
  content.resize(room);
  content.resize(mutate_bytes(reinterpret_cast<uint8_t*>(content.data()), size, room));
}

/// The same asset with all payloads uncoded; the same file if it is refused. Then a bit of a table is a bit
/// of the file. In a coded payload it would change everything after it.
Bytes uncoded(const Bytes& file) {
  try {
    format::Asset asset = format::to_asset(format::read_asset(file, "before"));
    for (format::Object& object : asset.objects) set_coded(0, object);
    return format::encode(asset);
  } catch (const Error&) {
    return file;
  }
}

/// Changes one payload as if it were a section; records say where it and those after it are then, mostly.
void mutate_payload(std::vector<Part>& parts, Random& random, MutateBytes mutate_bytes) {
  const PayloadKind& kind = payload::kPayloadKinds[random.below(std::size(payload::kPayloadKinds))];
  const Part* records = find_part(parts, kind.records);
  const Part* values = find_part(parts, kind.values);
  if (!records || !values || records->record_size < kind.at + sizeof(format::Payload) ||
      records->count() == 0)
    return;
  const size_t index = random.below(uint32_t(records->count()));
  const auto where = load<format::Payload>(records->content, index * records->record_size + kind.at);
  if (!is_within(where, values->content)) return;
  Part own{0, 0, payload_of(parts, kind, index), uint32_t(unit_of(kind))};
  const uint32_t what = random.below(8);
  switch (what) {
    case 0:
      mutate_part(own, mutate_bytes);
      break;
    case 1:
    case 2:
      move_pieces(own, random);
      break;
    case 3:  // what belongs to something later
      own.content.resize(format::aligned(own.content.size()) + 64 * (1 + random.below(3)), std::byte{0xa5});
      break;
    case 4:
      change_field(own, random);
      break;
    default:
      change_table(own, random);
  }
  set_payload(parts, kind, index, own.content);
  if (what != 3 && random.below(4) != 0) return;
  Part& changed = section_of(parts, kind.records);
  const size_t at = index * changed.record_size + kind.at;
  auto stated = load<format::Payload>(changed.content, at);
  stated.bytes = where.bytes;
  store(changed.content, at, stated);
}

Bytes mutate_sections(const Bytes& before, Random& random, MutateBytes mutate_bytes) {
  const Bytes file = random.below(3) == 0 ? uncoded(before) : before;
  std::vector<Part> parts = parts_of(file);
  if (parts.empty()) return file;
  const auto count = uint32_t(parts.size());
  for (uint32_t changes = 1 + random.below(3); changes > 0; --changes) {
    if (random.below(2)) {
      mutate_payload(parts, random, mutate_bytes);
      continue;
    }
    Part& part = parts[random.below(count)];
    switch (random.below(17)) {
      case 16:
        random.below(2) ? lengthen_records(part, 8 + 8 * random.below(3), std::byte(random.below(256)))
                        : void(part.record_size ^= 1u << random.below(32));
        break;
      case 0:
        std::swap(part, parts[random.below(count)]);
        break;
      case 1:
        (random.below(2) ? part.type : part.flags) ^= 1u << random.below(32);
        break;
      case 2:
      case 3:
        mutate_part(part, mutate_bytes);
        break;
      case 4:
      case 5:
        move_pieces(part, random);
        break;
      case 6:
        part.content.resize(random.below(uint32_t(part.content.size()) + 1));
        break;
      case 7:
      case 8:
      case 9:
      case 10:
        change_table(part, random);
        break;
      default:
        change_field(part, random);
    }
  }
  return file_of(file, parts);
}

// Below, data that belong together are changed together, so that most files are accepted.

float changed_float(float value, Random& random) {
  return random.below(3) ? value * random.between(-2.0f, 2.0f)
                         : std::bit_cast<float>(changed_word(std::bit_cast<uint32_t>(value), random));
}

/// A brick of the grid, separate from the others.
struct Brick {
  uint16_t entry = 0;  ///< in the table; kFirstMixedBrick if it is mixed
  kernels::BrickStates states{};
  uint64_t corners = 0;
};

uint64_t random_bits(Random& random) {
  uint64_t bits = 0;
  for (uint32_t n = 1 + random.below(8); n > 0; --n) bits |= uint64_t{1} << random.below(64);
  return random.below(4) ? bits : ~bits;
}

/// Changes bricks, and sometimes the grid's size. Tables that depend on them are corrected.
void mutate_grid(format::PlanesData& data, format::NetworkData* network, Random& random) {
  std::vector<Brick> bricks;
  for (const uint16_t entry : data.brick_table) {
    Brick brick{std::min<uint16_t>(entry, kernels::kFirstMixedBrick), {}, 0};
    if (entry >= kernels::kFirstMixedBrick) {
      brick.states = data.brick_states[entry - kernels::kFirstMixedBrick];
      if (network) brick.corners = network->brick_corners[entry - kernels::kFirstMixedBrick];
    }
    bricks.push_back(brick);
  }
  for (uint32_t changes = random.below(4); changes > 0; --changes) {
    Brick& brick = bricks[random.below(uint32_t(bricks.size()))];
    const uint32_t what = random.below(6);
    if (what == 0) brick = bricks[random.below(uint32_t(bricks.size()))];
    if (what == 1) brick = {uint16_t(random.below(3)), {}, 0};
    if (what >= 2) brick.entry = kernels::kFirstMixedBrick;
    if (what == 2) brick.corners ^= random_bits(random);
    if (what == 3) brick.states.surface ^= random_bits(random);
    if (what == 4) brick.states.aux ^= random_bits(random);
  }
  if (random.below(3) == 0) {
    uint32_t& side = data.voxels[random.below(3)];
    side = random.below(8) == 0 ? 1 + random.below(40)
                                : uint32_t(std::max(1, int32_t(side) + random.between(-5, 5)));
  }
  const uint32_t across = format::bricks_for(data.voxels[0]), down = format::bricks_for(data.voxels[1]),
                 layers = format::bricks_for(data.voxels[2]);
  data.brick_table.clear();
  data.brick_states.clear();
  if (network) {
    network->brick_corners.clear();
    network->corner_base.clear();
    network->corners = 0;
  }
  for (uint32_t b = 0; b < across * down * layers; ++b) {
    const Brick& brick = bricks[b % bricks.size()];
    data.brick_table.push_back(brick.entry);
    if (brick.entry < kernels::kFirstMixedBrick) continue;
    if (data.brick_states.size() > 0xfff0) {
      data.brick_table.back() = 0;
      continue;
    }
    data.brick_table.back() = uint16_t(kernels::kFirstMixedBrick + data.brick_states.size());
    uint64_t within = 0;
    const uint32_t low[3] = {4 * (b % across), 4 * (b / across % down), 4 * (b / across / down)};
    for (uint32_t bit = 0; bit < 64; ++bit)
      if (low[0] + bit % 4 < data.voxels[0] && low[1] + bit / 4 % 4 < data.voxels[1] &&
          low[2] + bit / 16 < data.voxels[2])
        within |= uint64_t{1} << bit;
    data.brick_states.push_back({brick.states.surface & within, brick.states.aux & within});
    if (!network) continue;
    network->brick_corners.push_back(brick.corners);
    network->corner_base.push_back(network->corners);
    network->corners += uint32_t(std::popcount(brick.corners));
  }
}

/// Changes the words of cells and their tables, often in a way that a reader refuses.
void mutate_cells(format::PlanesData& data, Random& random) {
  if (random.below(4) == 0) data.levels = random.below(kernels::kMaxLevels + 1);
  for (uint32_t changes = 1 + random.below(4); changes > 0; --changes) {
    std::vector<uint32_t>& words = random.below(2) ? data.voxel_records : data.children;
    if (words.empty()) continue;
    uint32_t& word = words[random.below(uint32_t(words.size()))];
    switch (random.below(4)) {
      case 0:
        word ^= 1u << random.below(32);
        break;
      case 1:
        word = words[random.below(uint32_t(words.size()))];
        break;
      case 2:  // planes that prove less are always valid
        word = kernels::word_kind(word) == kernels::kLink ? word : word & ~15u;
        break;
      default:
        word = kernels::kBareCell;
    }
  }
}

void mutate(format::PlanesData& data, format::Object& object, format::Asset&, Random& random) {
  if (random.below(4) == 0) data.coded = random.below(format::kCodedPlanes + 1);
  switch (random.below(4)) {
    case 0:
      mutate_cells(data, random);
      break;
    case 1:
      (random.below(2) ? data.voxels_per_unit : data.origin[random.below(3)]) *= random.between(0.1f, 4.0f);
      if (random.below(4) == 0) data.voxels_per_unit = changed_float(data.voxels_per_unit, random);
      if (random.below(4) == 0) data.origin[random.below(3)] = changed_float(data.origin[0], random);
      break;
    default:
      mutate_grid(data, object.network ? &*object.network : nullptr, random);
      format::leave_bare(data);
      if (random.below(2))
        for (uint32_t& word : data.voxel_records)
          word = test::random_planes(random) | (random.below(8) == 0 ? 8u : 0u);
  }
}

void mutate(format::NetworkData& data, format::Object&, format::Asset& asset, Random& random) {
  if (random.below(4) == 0) data.coded = random.below(format::kNetworkForms + 1);
  switch (random.below(3)) {
    case 0:  // as many inputs, from another number of samples
      for (int tries = 0; tries < 8; ++tries) {
        const uint32_t inputs = data.samples * (data.features_per_corner + 1),
                       features = 1 + random.below(kernels::kMaxFeatures);
        if (inputs % (4 * (features + 1)) != 0 || inputs / (features + 1) > kernels::kMaxSamples) continue;
        data.samples = inputs / (features + 1);
        data.features_per_corner = features;
        break;
      }
      break;
    case 1:
      data.mlp = random.below(uint32_t(asset.mlps.size()));
      break;
    default:
      data.length_scale = changed_float(data.length_scale, random);
  }
}

/// Keeps as many features as the planes have corners.
void fit_features(format::Object& object, Random& random) {
  if (!object.network) return;
  format::NetworkData& data = *object.network;
  const size_t before = data.features.size();
  data.features.resize(size_t(data.corners) * data.features_per_corner);
  for (size_t i = before; i < data.features.size(); ++i) data.features[i] = int8_t(random.between(-127, 127));
}

/// A vertex may move to the position of another one, which often keeps it in its box.
void mutate(format::TrianglesData& data, format::Object&, format::Asset&, Random& random) {
  auto& from = data.vertices[random.below(uint32_t(data.vertices.size()))];
  auto& to = data.vertices[random.below(uint32_t(data.vertices.size()))];
  const size_t axis = random.below(3);
  if (random.below(2))
    to[axis] = from[axis];
  else
    to[axis] = changed_float(to[axis], random);
}

void mutate(format::HolesData& data, format::Object&, format::Asset& asset, Random& random) {
  kernels::AlphaPatch& patch = data.patches[random.below(uint32_t(data.patches.size()))];
  switch (random.below(4)) {
    case 0:
      patch.map = random.below(uint32_t(asset.alpha_maps.size()) + 1);
      break;
    case 1:
      patch.shift = random.below(kernels::kAlphaFraction + 2);
      break;
    case 2:
      patch.places[random.below(3)][random.below(2)] ^= int32_t(1u << random.below(32));
      break;
    default:
      data.numbers[random.below(uint32_t(data.numbers.size()))] ^= 1u << random.below(32);
  }
}

std::vector<float>& grid_of(format::SphericalGrids& grids, Random& random) {
  std::vector<float>* const all[] = {&grids.outer_position, &grids.outer_direction, &grids.inner_position,
                                     &grids.inner_direction, &grids.distance};
  return *all[random.below(5)];
}

void mutate(format::SphericalData& data, format::Object&, format::Asset& asset, Random& random) {
  format::SphericalGrids& grids = data.grids;
  switch (random.below(4)) {
    case 0:
      grids.half = !grids.half;
      break;
    case 1:
      data.network = random.below(uint32_t(asset.spherical_networks.size()));
      break;
    case 2: {
      grids.outer_resolution = 2 + random.below(9);
      grids.inner_resolution = 2 + random.below(9);
      grids.distance_resolution = 2 + random.below(9);
      const size_t outer = size_t(grids.outer_resolution) * grids.outer_resolution * grids.outer_features,
                   inner = size_t(grids.inner_resolution) * grids.inner_resolution * grids.inner_features;
      grids.outer_position.resize(outer);
      grids.outer_direction.resize(outer);
      grids.inner_position.resize(inner);
      grids.inner_direction.resize(inner);
      grids.distance.resize(size_t(grids.distance_resolution) * grids.distance_features);
      break;
    }
    default: {
      std::vector<float>& values = grid_of(grids, random);
      float& value = values[random.below(uint32_t(values.size()))];
      value = random.below(2) ? kernels::kMaxSphericalValue : changed_float(value, random);
    }
  }
}

void mutate_networks(format::Asset& asset, Random& random) {
  if (!asset.mlps.empty() && random.below(2)) {
    format::Mlp& network = asset.mlps[random.below(uint32_t(asset.mlps.size()))];
    format::Layer& layer = network.layers[random.below(uint32_t(network.layers.size()))];
    if (random.below(2))
      layer.biases[random.below(layer.outputs)] = random.below(2) ? kernels::kMaxBias : -kernels::kMaxBias;
    else
      std::fill(layer.weights.begin(), layer.weights.end(), int8_t(random.below(2) ? 127 : -127));
    layer.shift = random.below(kernels::kMaxShift + 1);
    if (random.below(4) == 0)
      network.threshold = random.below(2) ? kernels::kMaxThreshold : -kernels::kMaxThreshold;
    if (random.below(4) == 0) network.logit_scale = changed_float(network.logit_scale, random);
  } else if (!asset.spherical_networks.empty()) {
    format::SphericalNetworks& networks =
        asset.spherical_networks[random.below(uint32_t(asset.spherical_networks.size()))];
    std::vector<float>& weights = (random.below(2) ? networks.outer : networks.inner).weights;
    const float extreme = random.below(2) ? kernels::kMaxSphericalValue : -kernels::kMaxSphericalValue;
    if (random.below(2))
      std::fill(weights.begin(), weights.end(), extreme);
    else
      weights[random.below(uint32_t(weights.size()))] = extreme;
    networks.half = networks.half != (random.below(2) == 0);
    networks.slope = random.unit();
  }
}

/// As many as the grid has surface voxels. Sometimes an object without colours gets some.
void fit_colors(format::Object& object, Random& random) {
  if (!object.planes) return;
  if (!object.colors && random.below(16) == 0) object.colors.emplace();
  if (object.colors)
    object.colors->resize(object.planes->voxel_records.size(), uint16_t(random.below(0x10000)));
}

/// Another weight, joint or move of a skin, sometimes of an object that had none.
void mutate_skin(format::Object& object, Random& random) {
  if (!object.triangles || object.planes || object.holes) return;
  if (!object.skin) {
    if (random.below(16) != 0) return;
    const auto stored = uint32_t(object.triangles->vertices.size());
    format::Numbers& sources = object.numbers[format::kSourceVertices];
    sources.below = stored + random.below(3);
    sources.values.resize(stored);
    for (uint32_t& value : sources.values) value = random.below(stored);
    object.skin = random_skin(random, sources.below, 4 * random.below(3), 1 + random.below(2));
  }
  format::Skin& skin = *object.skin;
  if (!skin.weights.empty()) {
    const uint32_t at = random.below(uint32_t(skin.weights.size()));
    skin.weights[at] = random.below(4) ? 1 - skin.weights[at] : changed_float(skin.weights[at], random);
    skin.joints[at] = uint16_t(random.below(skin.joint_count + 1));
  }
  if (!skin.targets.empty()) {
    float& move = skin.targets[random.below(uint32_t(skin.targets.size()))][random.below(3)];
    move = changed_float(move, random);
  }
  if (random.below(8) == 0) skin.joint_count = changed_word(skin.joint_count, random);
}

/// Numbers of another kind, others of them, or another count that they are below.
void mutate_numbers(format::Object& object, Random& random) {
  if (random.below(4) == 0) {
    const uint32_t kind = 1 + random.below(format::kMostNumbers);
    const format::TrianglesData& triangles = *object.triangles;
    format::Numbers& numbers = object.numbers[kind];
    numbers.below = 1u << random.below(32);
    numbers.values.resize(kind == format::kSourceVertices ? triangles.vertices.size()
                                                          : triangles.triangles.size());
    for (uint32_t& value : numbers.values) value = random.below(numbers.below);
  }
  if (object.numbers.empty()) return;
  auto at = object.numbers.begin();
  std::advance(at, random.below(uint32_t(object.numbers.size())));
  auto& [below, values] = at->second;
  if (random.below(8) == 0) below = changed_word(below, random);
  if (values.empty()) return;
  uint32_t& number = values[random.below(uint32_t(values.size()))];
  number = below ? changed_word(number, random) % below : random.below(0xffffffff);
}

/// Masks and so on; a level, where that is right.
void mutate_settings(format::Asset& asset, Random& random) {
  if (random.below(8) == 0) asset.prover = random.below(3);
  if (random.below(8) == 0) {
    const uint32_t first = random.below(uint32_t(asset.objects.size()));
    if (first + 1 < asset.objects.size()) asset.objects[first].level = asset.objects[first + 1].level + 1;
    asset.objects[first].error = changed_float(asset.objects[first].error, random);
    std::erase_if(asset.instances, [&](const auto& instance) { return instance.object == first; });
    for (format::Instance& instance : asset.instances) instance.parent = format::kNoParent;
  }
  if (asset.instances.empty()) return;
  const uint32_t i = random.below(uint32_t(asset.instances.size()));
  format::Instance& instance = asset.instances[i];
  instance.mask = random.below(2) ? random.below(8) : changed_word(instance.mask, random);
  instance.flags = random.below(2);
  instance.user = changed_word(uint32_t(instance.user), random);
  instance.parent = i > 0 && random.below(2) ? random.below(i) : format::kNoParent;
}

/// Changes any of the parts that it has.
void mutate_part_of(format::Object& object, format::Asset& asset, Random& random) {
  uint32_t count = 0;
  format::for_each_part([&](auto part) { count += part.of(object).has_value(); });
  uint32_t left = random.below(count);
  format::for_each_part([&](auto part) {
    if (part.of(object) && left-- == 0) mutate(*part.of(object), object, asset, random);
  });
}

Bytes mutate_asset(const Bytes& file, Random& random) {
  format::Asset asset = format::to_asset(format::read_asset(file, "before"));
  format::Object& object = asset.objects[random.below(uint32_t(asset.objects.size()))];
  if (asset.instances.empty() && random.below(8) == 0) asset.places_nothing = !asset.places_nothing;
  switch (random.below(9)) {
    case 8:
      mutate_settings(asset, random);
      break;
    case 0:
      if (asset.objects.size() < 64) {
        asset.objects.push_back(format::Object(object));
        asset.objects.back().primary.reset();
        asset.objects.back().level = 0;
      }
      break;
    case 1:
      if (asset.objects.size() > 1) asset.objects.pop_back();
      asset.objects.back().level = 0;
      std::erase_if(asset.instances, [&](const auto& i) { return i.object >= asset.objects.size(); });
      for (format::Instance& instance : asset.instances) instance.parent = format::kNoParent;
      break;
    case 2: {
      format::Instance instance;
      instance.object = random.below(uint32_t(asset.objects.size()));
      for (float& x : instance.transform) x += random.between(-1.0f, 1.0f);
      float& x = instance.transform[random.below(12)];
      x = changed_float(x, random);
      if (random.below(4) == 0) {
        instance.transform[3] = 5411987.5f;
        instance.remainder[0] = -0.125f;
      }
      asset.instances.push_back(instance);
      asset.places_nothing = false;
      break;
    }
    case 3: {
      const size_t axis = random.below(3);
      float& bound = (random.below(2) ? object.aabb_min : object.aabb_max)[axis];
      bound = random.below(4) ? object.aabb_min[axis] : changed_float(bound, random);
      object.triangle_count = random.below(2) ? 0xffffffffu : 0;
      break;
    }
    case 4:
      mutate_networks(asset, random);
      break;
    case 5:
      if (object.triangles) {
        mutate_numbers(object, random);
        if (random.below(2)) mutate_skin(object, random);
        break;
      }
      [[fallthrough]];
    default:
      mutate_part_of(object, asset, random);
  }
  for (format::Object& one : asset.objects) {
    fit_features(one, random);
    fit_colors(one, random);
  }
  return format::encode(asset);
}

}  // namespace

Bytes mutate_structure(const Bytes& file, Random& random, MutateBytes mutate_bytes) {
  if (random.below(3) == 0) return mutate_sections(file, random, mutate_bytes);
  try {
    return mutate_asset(file, random);
  } catch (const Error&) {  // before or after the change
    return mutate_sections(file, random, mutate_bytes);
  }
}

Bytes join_assets(const Bytes& one, const Bytes& other) {
  try {
    format::Asset asset = format::to_asset(format::read_asset(one, "one"));
    format::Asset more = format::to_asset(format::read_asset(other, "other"));
    const auto first = uint32_t(asset.objects.size());
    for (format::Object& object : more.objects) {
      if (object.network) object.network->mlp += uint32_t(asset.mlps.size());
      if (object.spherical) object.spherical->network += uint32_t(asset.spherical_networks.size());
      if (object.holes)
        for (kernels::AlphaPatch& patch : object.holes->patches)
          patch.map += uint32_t(asset.alpha_maps.size());
      asset.objects.push_back(std::move(object));
    }
    const auto placed = uint32_t(asset.instances.size());
    for (format::Instance& instance : more.instances) {
      instance.object += first;
      if (instance.parent != format::kNoParent) instance.parent += placed;
      asset.instances.push_back(std::move(instance));
    }
    asset.places_nothing = asset.places_nothing && more.places_nothing && asset.instances.empty();
    for (format::Mlp& network : more.mlps) asset.mlps.push_back(std::move(network));
    for (format::SphericalNetworks& networks : more.spherical_networks)
      asset.spherical_networks.push_back(std::move(networks));
    for (size_t i = 0; i < more.alpha_maps.size(); ++i)
      asset.alpha_maps.add(more.alpha_maps[i], more.alpha_maps.tiles(i));
    return format::encode(asset);
  } catch (const Error&) {
    return {};
  }
}

}  // namespace nif::test
