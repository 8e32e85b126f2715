// What all sides of a race are asked: meshes, instances and rays, as arrays of bytes. `nif bench --export`
// writes these arrays, and hashes of them tell whether another program was asked the same.
#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "bake/ground_truth/prepare.hpp"

namespace nif::tools {

/// Instances that are queried together, and their rays.
struct RacedScene {
  std::vector<bake::Placed> instances;
  const std::vector<bake::RaysWithTruth>* rays;  ///< by ray set; not owned
};

struct RaceData {
  std::vector<const bake::Prepared*> objects;  ///< not owned
  std::vector<bake::RaySet> sets;
  std::vector<RacedScene> scenes;
  bool instanced;  ///< false: each scene is one object in its own space

  size_t instances() const;
  size_t positions() const;
  size_t triangles() const;
  size_t rays(size_t set) const;
};

/// Each object is a scene of its own, or all instances are one scene. `rays` is by scene, then by ray set.
RaceData race_of_objects(std::vector<const bake::Prepared*> objects, std::vector<bake::RaySet> sets,
                         const std::vector<const std::vector<bake::RaysWithTruth>*>& rays);
RaceData race_of_scene(std::vector<const bake::Prepared*> objects, std::vector<bake::Placed> instances,
                       std::vector<bake::RaySet> sets, const std::vector<bake::RaysWithTruth>& rays);

/// Takes the bytes of an array piece by piece.
using ByteSink = std::function<void(std::span<const std::byte>)>;

// The arrays, little-endian (docs/benchmark.md).
void put_positions(const RaceData& race, const ByteSink& to);         ///< float32 [positions][3]
void put_triangles(const RaceData& race, const ByteSink& to);         ///< uint32 [triangles][3]
void put_transforms(const RaceData& race, const ByteSink& to);        ///< float32 [instances][3][4]
void put_placed(const RaceData& race, const ByteSink& to);            ///< uint32 [instances]: their objects
void put_rays(const RaceData& race, size_t set, const ByteSink& to);  ///< float32 [rays][8]

/// "xxh3-64:" and 16 digits, by ray set: of the set's rays, and of everything that they may meet.
std::vector<std::string> hashes_of(const RaceData& race);

}  // namespace nif::tools
