// Rays are converted a few thousand at a time, so that a race needs no second copy of them.
#include "tools/bench/race_data.hpp"

#include <fmt/format.h>
#define XXH_INLINE_ALL
#include <xxhash.h>

#include <algorithm>
#include <array>
#include <bit>
#include <memory>
#include <new>

namespace nif::tools {
namespace {

static_assert(std::endian::native == std::endian::little);

class RaceHash {
 public:
  RaceHash() : state_(XXH3_createState(), &XXH3_freeState) {
    if (!state_) throw std::bad_alloc();
    XXH3_64bits_reset(state_.get());
  }
  void add(std::span<const std::byte> bytes) { XXH3_64bits_update(state_.get(), bytes.data(), bytes.size()); }
  void add(uint64_t number) { add(std::as_bytes(std::span(&number, 1))); }
  uint64_t digest() const { return XXH3_64bits_digest(state_.get()); }

 private:
  std::unique_ptr<XXH3_state_t, XXH_errorcode (*)(XXH3_state_t*)> state_;
};

}  // namespace

size_t RaceData::instances() const {
  size_t sum = 0;
  for (const RacedScene& scene : scenes) sum += scene.instances.size();
  return sum;
}

size_t RaceData::positions() const {
  size_t sum = 0;
  for (const bake::Prepared* object : objects) sum += object->surface.positions.size();
  return sum;
}

size_t RaceData::triangles() const {
  size_t sum = 0;
  for (const bake::Prepared* object : objects) sum += object->surface.triangles.size();
  return sum;
}

size_t RaceData::rays(size_t set) const {
  size_t sum = 0;
  for (const RacedScene& scene : scenes) sum += (*scene.rays)[set].segments.size();
  return sum;
}

RaceData race_of_objects(std::vector<const bake::Prepared*> objects, std::vector<bake::RaySet> sets,
                         const std::vector<const std::vector<bake::RaysWithTruth>*>& rays) {
  RaceData race{std::move(objects), std::move(sets), {}, false};
  for (uint32_t i = 0; i < race.objects.size(); ++i) race.scenes.push_back({{{i, mesh::kIdentity}}, rays[i]});
  return race;
}

RaceData race_of_scene(std::vector<const bake::Prepared*> objects, std::vector<bake::Placed> instances,
                       std::vector<bake::RaySet> sets, const std::vector<bake::RaysWithTruth>& rays) {
  RaceData race{std::move(objects), std::move(sets), {}, true};
  race.scenes.push_back({std::move(instances), &rays});
  return race;
}

void put_positions(const RaceData& race, const ByteSink& to) {
  for (const bake::Prepared* object : race.objects) to(std::as_bytes(std::span(object->surface.positions)));
}

void put_triangles(const RaceData& race, const ByteSink& to) {
  for (const bake::Prepared* object : race.objects) to(std::as_bytes(std::span(object->surface.triangles)));
}

void put_transforms(const RaceData& race, const ByteSink& to) {
  for (const RacedScene& scene : race.scenes)
    for (const bake::Placed& placed : scene.instances) to(std::as_bytes(std::span(placed.transform)));
}

void put_placed(const RaceData& race, const ByteSink& to) {
  for (const RacedScene& scene : race.scenes)
    for (const bake::Placed& placed : scene.instances) to(std::as_bytes(std::span(&placed.object, 1)));
}

void put_rays(const RaceData& race, size_t set, const ByteSink& to) {
  constexpr size_t kPiece = 4096;
  std::vector<std::array<float, 8>> piece;
  for (const RacedScene& scene : race.scenes) {
    const std::vector<kernels::Segment>& segments = (*scene.rays)[set].segments;
    for (size_t first = 0; first < segments.size(); first += kPiece) {
      piece.clear();
      for (size_t i = first; i < std::min(first + kPiece, segments.size()); ++i) {
        const kernels::Segment& s = segments[i];
        piece.push_back({s.origin[0], s.origin[1], s.origin[2], s.tmin, s.direction[0], s.direction[1],
                         s.direction[2], s.tmax});
      }
      to(std::as_bytes(std::span(piece)));
    }
  }
}

std::vector<std::string> hashes_of(const RaceData& race) {
  RaceHash geometry;
  const ByteSink to_geometry = [&](std::span<const std::byte> bytes) { geometry.add(bytes); };
  geometry.add(race.instanced);
  geometry.add(race.objects.size());
  for (const bake::Prepared* object : race.objects) {
    geometry.add(object->surface.positions.size());
    geometry.add(object->surface.triangles.size());
  }
  for (const RacedScene& scene : race.scenes) geometry.add(scene.instances.size());
  put_positions(race, to_geometry);
  put_triangles(race, to_geometry);
  put_transforms(race, to_geometry);
  put_placed(race, to_geometry);

  std::vector<std::string> hashes;
  for (size_t set = 0; set < race.sets.size(); ++set) {
    RaceHash hash;
    hash.add(geometry.digest());
    for (const RacedScene& scene : race.scenes) hash.add((*scene.rays)[set].segments.size());
    put_rays(race, set, [&](std::span<const std::byte> bytes) { hash.add(bytes); });
    hashes.push_back(fmt::format("xxh3-64:{:016x}", hash.digest()));
  }
  return hashes;
}

}  // namespace nif::tools
