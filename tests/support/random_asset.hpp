// Makes a small valid asset from a seed, without the baker: random voxels, features and networks, several
// objects and instances, some with triangles, some with a decision threshold. For tests of the format and the
// runtime, and for the fuzzers' seeds.
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <limits>
#include <string>

#include "formats/nif/asset.hpp"
#include "formats/nif/planes/cell_sides.hpp"
#include "kernels/reference/encodings/reference_segment.hpp"
#include "tests/support/coded.hpp"
#include "tests/support/random_bvh.hpp"
#include "tests/support/random_exact.hpp"
#include "tests/support/random_spherical.hpp"

namespace nif::test {

struct RandomAssetOptions {
  uint32_t objects = 3;
  uint32_t instances = 4;
  uint32_t max_voxels = 14;  ///< along an axis
  uint32_t bvhs = 0;         ///< objects of the `bvh` encoding, after the others
  uint32_t sphericals =
      0;                   ///< objects of the `spherical` encoding, after those; the first two share networks
  uint32_t exacts = 0;     ///< objects of the `exact` encoding, after those
  uint32_t proofs = 0;     ///< objects of the `proof` encoding, after those
  uint32_t cutouts = 0;    ///< objects of the `cutout` encoding, after those
  uint32_t primaries = 0;  ///< objects with a field for primary rays, the first so many of all
  uint32_t features = 0;   ///< of each corner; 0: any number
  uint32_t colors = 0;     ///< objects with colours of surface voxels, the first with a grid
  uint32_t skins = 0;      ///< `bvh` objects with vertices of a source and a skin, the first ones
  uint32_t sources = 0;    ///< objects with numbers of triangles in a source mesh, the first with a BVH
  /// Which payloads a file has coded, bits of kCodedAll. Features and planes are then less random, because coding
  /// could not shorten them otherwise. Objects with an even number state all proven sides.
  uint32_t coded = 0;
  bool translations = false;  ///< instances are so far away that floats cannot hold their translations
  bool odd_corners = false;  ///< as no baker would: some at the surface have no features, some beside it have
  bool places_nothing = false;  ///< where it has no instances
  // These do not change what seeds give otherwise.
  bool numbers = false;         ///< of all kinds, of objects with triangles
  bool settings = false;        ///< instances have masks, flags, values and parents
  bool proves_nothing = false;  ///< the file states that
  uint32_t levels = 0;          ///< about as many objects more, which are coarser stand-ins
};

inline format::Mlp random_network(Random& random, uint32_t inputs) {
  format::Mlp network;
  network.logit_scale = random.between(1e-4f, 1e-2f);
  const uint32_t hidden = random.below(3);
  for (uint32_t l = 0; l <= hidden; ++l) {
    format::Layer layer;
    layer.inputs = inputs;
    layer.outputs = l == hidden ? 1 : 4 * (1 + random.below(4));
    layer.shift = l == hidden ? 0 : 5 + random.below(4);
    for (uint32_t i = 0; i < layer.outputs; ++i) layer.biases.push_back(random.between(-3000, 3000));
    for (uint32_t i = 0; i < layer.outputs * layer.inputs; ++i)
      layer.weights.push_back(int8_t(random.between(-127, 127)));
    inputs = layer.outputs;
    network.layers.push_back(std::move(layer));
  }
  return network;
}

/// The sides in a random field: if it has both, most segments through it are blocked.
enum class RandomSides : uint8_t { outside, inside, both };

/// A solid ball in a box.
struct RandomBall {
  float centre[3], radius;

  /// Of a voxel from the centre, as a share of the radius, squared.
  float distance(uint32_t x, uint32_t y, uint32_t z) const {
    const float dx = static_cast<float>(x) - centre[0], dy = static_cast<float>(y) - centre[1],
                dz = static_cast<float>(z) - centre[2];
    return (dx * dx + dy * dy + dz * dz) / (radius * radius);
  }
};

inline RandomBall random_ball(Random& random, const format::PlanesData& object) {
  RandomBall ball;
  for (size_t a = 0; a < 3; ++a)
    ball.centre[a] = random.between(0.2f, 0.8f) * static_cast<float>(object.voxels[a]);
  ball.radius = random.between(0.3f, 0.7f) *
                static_cast<float>(std::max({object.voxels[0], object.voxels[1], object.voxels[2]}));
  return ball;
}

/// Voxels inside the ball, outside and between, some of them unknown, and so all of a side that is not to be.
inline void fill_occupancy(Random& random, const RandomAssetOptions& options, const RandomBall& ball,
                           RandomSides sides, format::PlanesData& object, format::NetworkData& network) {
  using kernels::VoxelState;
  const uint32_t nx = object.voxels[0], ny = object.voxels[1], nz = object.voxels[2];
  const auto state = [&](uint32_t x, uint32_t y, uint32_t z) {
    const float distance = ball.distance(x, y, z);
    if (distance > 1.5f)
      return sides == RandomSides::inside || (x * 7 + y * 3 + z) % 31 == 0 ? VoxelState::unknown
                                                                           : VoxelState::outside;
    if (distance >= 0.5f) return VoxelState::surface;
    return sides == RandomSides::outside ? VoxelState::unknown : VoxelState::inside;
  };
  const auto is_surface = [&](uint32_t x, uint32_t y, uint32_t z) {
    return x < nx && y < ny && z < nz && state(x, y, z) == VoxelState::surface;
  };
  const uint32_t bricks[3] = {format::bricks_for(nx), format::bricks_for(ny), format::bricks_for(nz)};
  for (uint32_t b = 0; b < bricks[0] * bricks[1] * bricks[2]; ++b) {
    const uint32_t low[3] = {b % bricks[0] * 4, b / bricks[0] % bricks[1] * 4, b / bricks[0] / bricks[1] * 4};
    kernels::BrickStates states{};
    uint64_t corners = 0;
    uint32_t seen = 0;  // a bit for each state
    for (uint32_t bit = 0; bit < 64; ++bit) {
      const uint32_t x = low[0] + (bit & 3), y = low[1] + (bit >> 2 & 3), z = low[2] + (bit >> 4);
      for (uint32_t c = 0; c < 8; ++c)
        if (is_surface(x - (c & 1), y - (c >> 1 & 1), z - (c >> 2))) corners |= uint64_t{1} << bit;
      if (x >= nx || y >= ny || z >= nz) continue;
      const VoxelState s = state(x, y, z);
      seen |= 1u << uint32_t(s);
      if (s == VoxelState::surface || s == VoxelState::unknown) states.surface |= uint64_t{1} << bit;
      if (s == VoxelState::inside || s == VoxelState::unknown) states.aux |= uint64_t{1} << bit;
    }
    if (corners == 0 && std::popcount(seen) <= 1) {
      object.brick_table.push_back(uint16_t(seen == 0 ? 0 : std::countr_zero(seen)));
      continue;
    }
    if (options.odd_corners)
      for (uint32_t n = random.below(8); n > 0; --n) corners ^= uint64_t{1} << random.below(64);
    object.brick_table.push_back(uint16_t(kernels::kFirstMixedBrick + object.brick_states.size()));
    object.brick_states.push_back(states);
    network.brick_corners.push_back(corners);
    network.corner_base.push_back(network.corners);
    network.corners += uint32_t(std::popcount(corners));
  }
}

/// Planes at random, close together as a rule; `similar`: and in similar directions.
inline uint32_t random_planes(Random& random, bool similar = false) {
  if (random.below(16) == 0) return kernels::kBareCell;
  const int32_t middle = similar ? random.between(120, 136) : random.between(80, 176),
                half = random.between(1, random.below(4) ? 12 : 80);
  const uint32_t normals = similar ? 8 : kernels::kNormalSum + 1, first = similar ? 20 : 0;
  return kernels::make_planes(0, first + random.below(normals), first + random.below(normals),
                              uint32_t(std::clamp(middle - half, 0, 255)),
                              uint32_t(std::clamp(middle + half, 1, 256)));
}

/// Records of surface voxels and their children. Bare voxels, which join nothing, separate what is outside
/// from what is inside.
inline void fill_cells(Random& random, const RandomBall& ball, RandomSides sides, bool all_proven, bool coded,
                       format::PlanesData& object) {
  using kernels::VoxelState;
  object.voxel_base.clear();
  object.voxel_records.clear();
  object.children.clear();
  const kernels::PlanesField field = format::field_of(object);
  const auto in_grid = [&](const int32_t(&at)[3]) {
    for (size_t a = 0; a < 3; ++a)
      if (at[a] < 0 || at[a] >= int32_t(field.voxels[a])) return false;
    return true;
  };
  // SeenBits of what a voxel may be joined to.
  const auto side_of = [&](const int32_t(&at)[3]) -> uint32_t {
    if (!in_grid(at)) return kernels::kSeenOutside;
    const VoxelState state = kernels::voxel_state(field, at);
    if (state != VoxelState::surface) return kernels::seen_in(state);
    if (sides == RandomSides::outside) return kernels::kSeenOutside;
    const bool inside = sides == RandomSides::inside ||
                        ball.distance(uint32_t(at[0]), uint32_t(at[1]), uint32_t(at[2])) < 0.9f;
    return inside ? kernels::kSeenInside : kernels::kSeenOutside;
  };
  const auto is_bare = [&](const int32_t(&at)[3]) {
    const uint32_t side = side_of(at);
    for (size_t a = 0; a < 3; ++a)
      for (const int32_t step : {-1, 1}) {
        int32_t beside[3] = {at[0], at[1], at[2]};
        beside[a] += step;
        if ((side | side_of(beside)) != kernels::kSeenBoth) continue;
        // One of the two will do, if it is not an empty one.
        if (side == kernels::kSeenInside || kernels::voxel_state(field, beside) == VoxelState::inside)
          return true;
      }
    return false;
  };

  std::vector<bool> bare;  // of records, then children
  uint32_t brick = 0;
  for (uint32_t b = 0; b < uint32_t(object.brick_table.size()); ++b) {
    if (object.brick_table[b] < kernels::kFirstMixedBrick) continue;
    object.voxel_base.push_back(uint32_t(bare.size()));
    const kernels::BrickStates& states = object.brick_states[brick++];
    for (uint64_t bits = states.surface & ~states.aux; bits != 0; bits &= bits - 1) {
      const uint32_t bit = uint32_t(std::countr_zero(bits));
      const int32_t at[3] = {
          int32_t(b % field.bricks[0] * 4 + (bit & 3)),
          int32_t(b / field.bricks[0] % field.bricks[1] * 4 + (bit >> 2 & 3)),
          int32_t(b / field.bricks[0] / field.bricks[1] * 4 + (bit >> 4)),
      };
      bare.push_back(is_bare(at));
    }
  }
  object.voxel_records.resize(bare.size());

  // Voxels first, then children of these, and so on.
  size_t next = 0, level_end = object.voxel_records.size();
  for (uint32_t level = 0;; ++level, level_end = bare.size()) {
    for (; next < level_end; ++next) {
      uint32_t word = bare[next] ? kernels::kBareCell : random_planes(random, coded);
      if (level < object.levels && object.children.size() + 8 <= kernels::kMaxChildren &&
          random.below(bare[next] ? 16 : 3) == 0) {
        // A part that is not there joins what is around it.
        const uint32_t mask = bare[next] ? 255 : 1 + random.below(255);
        word = kernels::make_link(mask, uint32_t(object.children.size()));
        object.children.resize(object.children.size() + size_t(std::popcount(mask)));
        bare.resize(object.voxel_records.size() + object.children.size(), bare[next]);
      }
      const size_t part = next - object.voxel_records.size();
      (next < object.voxel_records.size() ? object.voxel_records[next] : object.children[part]) = word;
    }
    if (bare.size() == level_end) break;
  }

  // Kinds, now that it is clear which sides are proven; not all that is proven need be said.
  const format::SideRegions regions(format::field_of(object));
  uint32_t record = 0;
  for (std::vector<uint32_t>* words : {&object.voxel_records, &object.children})
    for (uint32_t& word : *words) {
      const kernels::CellKind known = {random.below(8) || all_proven ? regions.above(record) : 0,
                                       random.below(8) || all_proven ? regions.below(record) : 0,
                                       random.below(24) == 0};
      ++record;
      if (kernels::word_kind(word) != kernels::kLink && word != kernels::kBareCell)
        word |= kernels::kind_of(known);
    }
}

/// Everything of an object except its content.
inline format::Object object_of(const format::TrianglesData& bvh, const std::string& name) {
  format::Object object;
  object.name = name;
  object.aabb_min = object.aabb_max = bvh.vertices[0];
  for (const auto& p : bvh.vertices)
    for (size_t a = 0; a < 3; ++a) {
      object.aabb_min[a] = std::min(object.aabb_min[a], p[a]);
      object.aabb_max[a] = std::max(object.aabb_max[a], p[a]);
    }
  object.bias = 1e-3f * (object.aabb_max[0] - object.aabb_min[0]);
  object.triangle_count = uint32_t(bvh.triangles.size());
  return object;
}

inline format::Object random_bvh_object(Random& random, const std::string& name) {
  format::TrianglesData bvh =
      random_bvh(random, 1 + random.below(60), random.between(-2.0f, 2.0f), random.between(0.5f, 3.0f));
  format::Object object = object_of(bvh, name);
  object.triangles = std::move(bvh);
  return object;
}

/// A map of any shape; sometimes all of one kind, or with a wide margin.
inline void add_random_alpha_map(Random& random, format::AlphaMaps& maps) {
  kernels::AlphaMap map;
  map.width = 1 + random.below(random.below(4) ? 20 : 70);
  map.height = 1 + random.below(random.below(4) ? 20 : 70);
  for (uint32_t& wrap : map.wrap) wrap = random.below(kernels::kAlphaWraps);
  const uint32_t columns = kernels::alpha_tiles(map.width), grain = 1 + random.below(4);
  const uint32_t of = random.below(4) ? 4 : 200,
                 share = random.below(5);  // of these blocks of texels, so many are solid
  uint32_t margin[2][2] = {};              // before and after, along x and y
  if (random.below(3) == 0)
    for (uint32_t a = 0; a < 2; ++a)
      for (uint32_t& side : margin[a]) side = random.below(a == 0 ? map.width : map.height);
  auto tiles = std::make_shared<std::vector<uint64_t>>(kernels::alpha_tiles(map.width, map.height));
  std::vector<bool> blocks(size_t{map.width} * map.height);
  for (uint32_t y = 0; y < map.height; ++y)
    for (uint32_t x = 0; x < map.width; ++x) {
      const bool first = x % grain == 0 && y % grain == 0;
      bool solid = first ? random.below(of) < share
                         : blocks[size_t{y / grain * grain} * map.width + x / grain * grain];
      blocks[size_t{y} * map.width + x] = solid;
      solid = solid && x >= margin[0][0] && x + margin[0][1] < map.width && y >= margin[1][0] &&
              y + margin[1][1] < map.height;
      const size_t tile = size_t{y / kernels::kAlphaTile} * columns + x / kernels::kAlphaTile;
      (*tiles)[tile] |= uint64_t{solid}
                        << (x % kernels::kAlphaTile + kernels::kAlphaTile * (y % kernels::kAlphaTile));
    }
  maps.add(map, std::move(tiles));
}

/// Holes of most triangles, in maps of the asset, of which there must be one.
inline format::HolesData random_holes(Random& random, uint32_t triangles, const format::AlphaMaps& maps) {
  format::HolesData holes;
  holes.patches.resize(1 + random.below(triangles));
  for (kernels::AlphaPatch& patch : holes.patches) {
    patch.map = random.below(uint32_t(maps.size()));
    patch.shift = random.below(3) ? 0 : random.below(kernels::kAlphaFraction + 1);
    const float size = random.below(3) ? 1.0f : random.between(0.0f, 40.0f);
    for (auto& place : patch.places)
      for (int a = 0; a < 2; ++a) {
        const float side = static_cast<float>(a == 0 ? maps[patch.map].width : maps[patch.map].height);
        place[a] = random.below(50) == 0 ? std::numeric_limits<int32_t>::min()
                                         : static_cast<int32_t>(random.between(-size, 2 * size) * side *
                                                                static_cast<float>(65536 >> patch.shift));
      }
  }
  std::vector<uint32_t> numbers(triangles);
  for (uint32_t& number : numbers)
    number = random.below(4) ? 1 + random.below(uint32_t(holes.patches.size())) : 0;
  holes.set_numbers(numbers);
  return holes;
}

inline format::Object random_cutout_object(Random& random, const std::string& name,
                                           const format::AlphaMaps& maps) {
  format::Object object = random_bvh_object(random, name);
  object.holes = random_holes(random, uint32_t(object.triangles->triangles.size()), maps);
  return object;
}

/// Takes no random numbers of what else an asset has.
inline void add_cutouts(uint64_t seed, uint32_t count, format::Asset& asset) {
  if (count == 0) return;
  Random random(seed + 0x686f6c65);
  for (uint32_t maps = 1 + random.below(3); maps-- > 0;) add_random_alpha_map(random, asset.alpha_maps);
  for (uint32_t i = 0; i < count; ++i)
    asset.objects.push_back(random_cutout_object(random, "cutout " + std::to_string(i), asset.alpha_maps));
}

inline format::Object random_exact_object(Random& random, const RandomAssetOptions& options,
                                          const std::string& name) {
  RandomExact exact = random_exact(random, options.max_voxels);
  format::Object object = object_of(exact.triangles, name);
  object.planes = std::move(exact.planes);
  object.triangles = std::move(exact.triangles);
  set_coded(options.coded, object);
  return object;
}

inline format::Object random_proof_object(Random& random, const RandomAssetOptions& options,
                                          const std::string& name) {
  format::Object object = random_exact_object(random, options, name);
  object.triangles.reset();
  return object;
}

/// Numbers in a source mesh with more triangles, in any order.
inline format::Numbers random_source(Random& random, size_t triangles) {
  format::Numbers source;
  source.below = uint32_t(triangles) + (random.below(3) ? random.below(2000) : 0);
  source.values.resize(source.below);
  for (uint32_t i = 0; i < source.below; ++i) source.values[i] = i;
  for (size_t i = 0; i < triangles; ++i)
    std::swap(source.values[i], source.values[i + random.below(uint32_t(source.below - i))]);
  source.values.resize(triangles);
  return source;
}

/// Takes no random numbers of what else an asset has.
inline void add_sources(uint64_t seed, uint32_t count, format::Asset& asset) {
  Random random(seed + 0x736f7572);
  for (format::Object& object : asset.objects) {
    if (!object.triangles || count == 0) continue;
    object.numbers[format::kSourceTriangles] = random_source(random, object.triangles->triangles.size());
    --count;
  }
}

/// By up to 2^20, with remainders that keep a 1024th.
inline void move_far_away(uint64_t seed, format::Asset& asset) {
  Random random(seed + 0x7472616e);
  for (format::Instance& instance : asset.instances)
    for (size_t a = 0; a < 3; ++a) {
      const double exact = std::ldexp(double(1 + 2 * random.below(1u << 30)), -10) - std::ldexp(1.0, 20);
      instance.transform[4 * a + 3] = static_cast<float>(exact);
      instance.remainder[a] = static_cast<float>(exact - double(instance.transform[4 * a + 3]));
    }
}

/// Numbers of all other kinds.
inline void add_numbers(uint64_t seed, format::Asset& asset) {
  Random random(seed + 0x6e756d73);
  for (format::Object& object : asset.objects) {
    if (!object.triangles) continue;
    for (const uint32_t kind : {format::kMaterials, format::kUserValues, format::kSourceVertices}) {
      if (random.below(3) == 0) continue;
      format::Numbers& numbers = object.numbers[kind];
      const uint32_t bits = random.below(33);
      numbers.below =
          bits == 32 ? 0 : (1u << bits) - (random.below(2) && bits > 0 ? random.below(1u << (bits - 1)) : 0);
      numbers.values.resize(kind == format::kSourceVertices ? object.triangles->vertices.size()
                                                            : object.triangles->triangles.size());
      for (uint32_t& value : numbers.values)
        value = numbers.below ? random.below(numbers.below) : random.below(0xffffffff);
    }
  }
}

/// Coarser stand-ins for some objects, which instances do not name: copies of others.
inline void add_levels(uint64_t seed, uint32_t count, format::Asset& asset) {
  Random random(seed + 0x6c657665);
  for (; count > 0; --count) {
    const uint32_t at = random.below(uint32_t(asset.objects.size()));
    if (asset.objects[at].level == format::kMaxLevel) continue;
    if (at > 0 && asset.objects[at - 1].level != 0) continue;  // it has one already
    format::Object coarser = asset.objects[at];
    coarser.name += " coarser";
    coarser.primary.reset();
    ++coarser.level;
    coarser.error = random.between(0.0f, 0.1f);
    asset.objects.insert(asset.objects.begin() + at, std::move(coarser));
    for (format::Instance& instance : asset.instances) instance.object += instance.object >= at;
  }
}

/// Masks, flags, values and parents, each of some instances.
inline void add_settings(uint64_t seed, format::Asset& asset) {
  Random random(seed + 0x73657474);
  for (uint32_t i = 0; i < asset.instances.size(); ++i) {
    format::Instance& instance = asset.instances[i];
    if (random.below(3) == 0) instance.mask = random.below(16);
    if (random.below(4) == 0) instance.flags = format::kDisabled;
    if (random.below(2)) instance.user = uint64_t{random.below(0xffffffff)} << random.below(33);
    if (i > 0 && random.below(2)) instance.parent = random.below(i);
  }
}

/// As sources.
inline void add_colors(uint64_t seed, uint32_t count, format::Asset& asset) {
  Random random(seed + 0x636f6c6f);
  for (format::Object& object : asset.objects) {
    if (!object.planes || count == 0) continue;
    object.colors.emplace(object.planes->voxel_records.size());
    for (uint16_t& color : *object.colors) color = uint16_t(random.below(0x10000));
    --count;
  }
}

/// Weights, joints and targets for a source of so many vertices.
inline format::Skin random_skin(Random& random, uint32_t vertices, uint32_t influences, uint32_t targets) {
  format::Skin skin{vertices, influences == 0 ? 0 : 1 + random.below(9), influences, targets, {}, {}, {}};
  for (uint32_t v = 0; v < vertices; ++v) {
    std::vector<float> weights;
    float sum = 0;
    for (uint32_t k = 0; k < influences; ++k)
      sum += weights.emplace_back(random.below(3) ? random.unit() : 0.0f);
    for (uint32_t k = 0; k < influences; ++k) {
      skin.weights.push_back(sum > 0 ? weights[k] / sum : k == 0 ? 1.0f : 0.0f);
      skin.joints.push_back(uint16_t(random.below(skin.joint_count)));
    }
  }
  for (uint32_t i = 0; i < vertices * targets; ++i)
    skin.targets.push_back({random.between(-1.0f, 1.0f), 0, random.between(-0.1f, 0.1f)});
  return skin;
}

/// As sources.
inline void add_skins(uint64_t seed, uint32_t count, format::Asset& asset) {
  Random random(seed + 0x736b696e);
  for (format::Object& object : asset.objects) {
    if (!object.triangles || object.planes || object.holes || count == 0) continue;
    const auto stored = uint32_t(object.triangles->vertices.size());
    const uint32_t vertices = stored + random.below(10);
    format::Numbers& sources = object.numbers[format::kSourceVertices];
    sources.below = vertices;
    sources.values.resize(stored);
    for (uint32_t v = 0; v < stored; ++v) sources.values[v] = v;
    const uint32_t influences = 4 * random.below(3);
    object.skin = random_skin(random, vertices, influences, random.below(3) + (influences == 0));
    --count;
  }
}

inline format::Asset random_asset(uint64_t seed, const RandomAssetOptions& options = {}) {
  Random random(seed);
  format::Asset asset;
  for (uint32_t i = 0; i < options.objects; ++i) {
    format::Object object;
    object.name = "object " + std::to_string(i) + (i % 2 ? " \u00e9" : "");
    format::PlanesData& planes = object.planes.emplace();
    format::NetworkData& network = object.network.emplace();
    for (size_t a = 0; a < 3; ++a) planes.voxels[a] = 1 + random.below(options.max_voxels);
    planes.voxels_per_unit = random.between(0.5f, 20.0f);
    for (size_t a = 0; a < 3; ++a) {
      planes.origin[a] = random.between(-5.0f, 5.0f);
      object.aabb_min[a] = planes.origin[a];
      object.aabb_max[a] = planes.origin[a] + static_cast<float>(planes.voxels[a]) / planes.voxels_per_unit;
    }
    object.bias = 1e-3f * (object.aabb_max[0] - object.aabb_min[0]);
    object.triangle_count = 100 + random.below(1000);
    network.features_per_corner =
        options.features ? options.features : 1 + random.below(kernels::kMaxFeatures);
    network.samples = 4 * (1 + random.below(3));
    network.length_scale = random.between(1.0f, 20.0f);
    planes.levels = random.below(kernels::kMaxLevels + 1);
    while (options.max_voxels << planes.levels > kernels::kMaxCells) --planes.levels;
    const RandomBall ball = random_ball(random, planes);
    const RandomSides sides = random.below(2)   ? RandomSides::both
                              : random.below(2) ? RandomSides::outside
                                                : RandomSides::inside;
    fill_occupancy(random, options, ball, sides, planes, network);
    for (uint32_t f = 0; f < network.corners * network.features_per_corner; ++f)
      network.features.push_back(int8_t(random.between(-127, 127) / (options.coded ? 8 : 1)));
    network.mlp = i;
    asset.mlps.push_back(
        random_network(random, kernels::input_count(network.samples, network.features_per_corner)));
    // Some answers lean to one side or the other, without taking random numbers of what follows.
    if (i % 2) format::move_threshold(asset.mlps.back(), Random(seed + i).between(-4000, 4000));
    set_coded(options.coded, object);
    fill_cells(random, ball, sides, options.coded && i % 2 == 0, options.coded != 0, planes);
    asset.objects.push_back(std::move(object));
  }
  for (uint32_t i = 0; i < options.bvhs; ++i)
    asset.objects.push_back(random_bvh_object(random, "bvh " + std::to_string(i)));
  for (uint32_t i = 0; i < options.sphericals; ++i) {
    format::Object object =
        random_spherical_object(random, "spherical " + std::to_string(i), 2 + options.max_voxels / 4);
    auto& [network, grids] = *object.spherical;
    if (i == 1) {
      grids = asset.objects.back().spherical->grids;
      for (float& value : grids.outer_position) value = -value;
    } else {
      asset.spherical_networks.push_back(random_networks(random, grids, options.max_voxels > 8 ? 24 : 4));
    }
    network = uint32_t(asset.spherical_networks.size() - 1);
    asset.objects.push_back(std::move(object));
  }
  for (uint32_t i = 0; i < options.exacts; ++i)
    asset.objects.push_back(random_exact_object(random, options, "exact " + std::to_string(i)));
  for (uint32_t i = 0; i < options.proofs; ++i)
    asset.objects.push_back(random_proof_object(random, options, "proof " + std::to_string(i)));
  add_cutouts(seed, options.cutouts, asset);
  for (uint32_t i = 0; i < options.instances; ++i) {
    format::Instance instance;
    instance.name = "instance " + std::to_string(i);
    instance.object = random.below(uint32_t(asset.objects.size()));
    for (size_t k = 0; k < 12; ++k)
      instance.transform[k] = random.between(-0.4f, 0.4f) + (k % 5 == 0 ? 1.0f : 0.0f);
    asset.instances.push_back(std::move(instance));
  }
  asset.places_nothing = options.places_nothing && asset.instances.empty();
  for (uint32_t i = 0; i < std::min<uint32_t>(options.primaries, uint32_t(asset.objects.size())); ++i)
    asset.objects[i].primary =
        random_primary(random, 2 + options.max_voxels / 4, options.max_voxels > 8 ? 24 : 4);
  if (options.translations) move_far_away(seed, asset);
  add_sources(seed, options.sources, asset);
  add_colors(seed, options.colors, asset);
  if (options.numbers) add_numbers(seed, asset);
  add_skins(seed, options.skins, asset);
  if (options.settings) add_settings(seed, asset);
  add_levels(seed, options.levels, asset);
  if (options.proves_nothing) asset.prover = 0;
  asset.metadata = R"({"schema":"nifkit.test/1","seed":)" + std::to_string(seed) + "}";
  return asset;
}

/// A segment near the object's grid, mostly through it: lines, short segments, along axes, on voxel faces.
inline kernels::Segment random_segment(Random& random, const kernels::PlanesField& field) {
  kernels::Segment segment;
  const bool on_lattice = random.below(4) == 0, along_axis = random.below(8) == 0,
             line = random.below(3) == 0, aimed = random.below(4) != 0, starts_inside = random.below(2) == 0;
  const uint32_t axis = random.below(3);
  const float lattice = random.below(2) ? 1.0f : 1 / field.voxels_per_cell;
  for (uint32_t a = 0; a < 3; ++a) {
    float at =
        (starts_inside ? random.unit() : random.between(-0.5f, 1.5f)) * static_cast<float>(field.voxels[a]);
    if (on_lattice) at = static_cast<float>(static_cast<int32_t>(at * lattice)) / lattice;
    segment.origin[a] = field.origin[a] + at / field.voxels_per_unit;
    const float towards = random.unit() * static_cast<float>(field.voxels[a]) - at;
    segment.direction[a] = along_axis ? (a == axis ? 1.0f : 0.0f)
                           : aimed    ? towards / static_cast<float>(field.voxels[0])
                                      : random.between(-1.0f, 1.0f);
  }
  segment.tmin = line ? -std::numeric_limits<float>::infinity() : 0.0f;
  segment.tmax = random.below(2)
                     ? std::numeric_limits<float>::infinity()
                     : random.unit() * static_cast<float>(field.voxels[0]) / field.voxels_per_unit;
  return segment;
}

inline kernels::Segment random_segment(Random& random, const kernels::CutoutField& field) {
  return random_segment(random, field.triangles);
}

inline kernels::Segment random_segment(Random& random, const kernels::ExactField& field) {
  return random.below(4) ? random_segment(random, field.planes) : random_segment(random, field.triangles);
}

}  // namespace nif::test
