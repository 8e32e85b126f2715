// Places objects of some kinds in a scene, as the city and the forest do.
#pragma once

#include <cstdint>
#include <numeric>
#include <span>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "formats/base/random.hpp"
#include "formats/base/vector.hpp"
#include "formats/mesh/mesh_scene.hpp"

namespace nif::generate {

/// Where an object of a kind stands.
template <class Kind>
struct PlaceOf {
  Kind kind;
  Double3 position;
  double turns = 0;  ///< about the vertical axis; after a quarter turn, +z becomes +x
  double scale = 1;
};

/// Deals the variants of a kind like playing cards: all of them once in random order, then all again in
/// another order.
class Deck {
 public:
  Deck(uint64_t seed, size_t kind, uint32_t variants);
  uint32_t next();

 private:
  Random random_;
  std::vector<uint32_t> cards_;
  size_t dealt_ = 0;
};

mesh::Transform transform_of(const Double3& position, double turns, double scale);
mesh::Camera camera(const char* name, const Double3& position, const Double3& target, double degrees);

/// `count` places of the smallest plan that has as many. `plan(size)` gives a planner with the places that a plan of this
/// size needs, and with optional ones, of which random ones are dropped, so that no part is bare.
template <class Place, class Plan>
std::vector<Place> smallest_plan(uint32_t count, Random random, const Plan& plan) {
  for (uint32_t size = 1;; ++size) {
    auto planner = plan(size);
    std::vector<Place> places = planner.needed();
    std::vector<Place>& wanted = planner.wanted();
    if (places.size() + wanted.size() < count) continue;
    for (size_t i = 0; i + 1 < wanted.size(); ++i)
      std::swap(wanted[i], wanted[i + random.below(uint32_t(wanted.size() - i))]);
    places.insert(places.end(), wanted.begin(), wanted.end());
    places.resize(count, places.front());
    return places;
  }
}

/// Adds an instance for each place. The meshes of the scene are the variants of the first kind, then those of the second,
/// and so on.
template <class Kind>
void place_all(const std::vector<PlaceOf<Kind>>& places, std::span<const uint32_t> variants, uint64_t seed,
               mesh::Scene& scene) {
  std::vector<Deck> decks;
  std::vector<uint32_t> first(variants.size()), placed(scene.meshes.size());
  std::exclusive_scan(variants.begin(), variants.end(), first.begin(), 0u);
  for (size_t kind = 0; kind < variants.size(); ++kind) decks.emplace_back(seed, kind, variants[kind]);
  for (const PlaceOf<Kind>& place : places) {
    const uint32_t mesh = first[size_t(place.kind)] + decks[size_t(place.kind)].next();
    scene.instances.push_back({fmt::format("{}.{}", scene.meshes[mesh].name, ++placed[mesh]), mesh,
                               transform_of(place.position, place.turns, place.scale)});
  }
}

}  // namespace nif::generate
