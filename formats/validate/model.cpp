// Checks what a file needs for its answers to be those of its mesh, as far as that is visible without the
// mesh.
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "formats/base/collinear.hpp"
#include "formats/nif/network/network_corners.hpp"
#include "formats/nif/planes/check_planes.hpp"
#include "formats/validate/validate.hpp"
#include "kernels/reference/instance.hpp"

namespace nif::validate {
namespace {

using kernels::PlanesField;

std::string object_place(uint32_t index) { return "section OBJS, record " + std::to_string(index); }
std::string instance_place(uint32_t index) { return "section INST, record " + std::to_string(index); }

/// The grid must surround the bounds: everything beyond its border counts as outside.
void check_clearance(const format::ObjectView& object, const PlanesField& grid, const std::string& place,
                     Findings& findings) {
  constexpr double kClearance = 1.0 / 32;
  constexpr double kRounded = 1e-4;  // of a voxel, because origin and scale are single precision
  for (size_t a = 0; a < 3; ++a) {
    const double scale = double(grid.voxels_per_unit), origin = double(grid.origin[a]),
                 low = (double(object.aabb_min[a]) - origin) * scale,
                 high = (double(object.aabb_max[a]) - origin) * scale;
    if (low >= kClearance - kRounded && high <= double(grid.voxels[a]) - kClearance + kRounded) continue;
    findings.add(Advice::grid_too_small, place);
    return;
  }
}

/// Finds cells that state less than follows from all of them: their proofs are not used.
void check_kinds(const PlanesField& grid, const std::string& place, Findings& findings) {
  const format::SideRegions sides(grid);
  const auto says_less = [&](uint32_t word, uint32_t record) {
    const uint32_t kind = kernels::word_kind(word);
    return kind != kernels::kLink && format::proven_kind(sides, record, format::separates(kind)) != kind;
  };
  uint64_t count = 0;
  for (uint32_t i = 0; i < grid.surface_voxels; ++i) count += says_less(grid.voxel_records[i], i);
  for (uint32_t i = 0; i < grid.child_count; ++i)
    count += says_less(grid.children[i], grid.surface_voxels + i);
  if (count > 0)
    findings.add(Advice::kind_says_less, place,
                 std::to_string(count) + " cells say less than their planes and their neighbours prove");
}

/// Features must be at the corners of surface voxels, and nowhere else.
void check_corners(const kernels::PlanesField& planes, const kernels::NetworkField& network,
                   const std::string& place, Findings& findings) {
  uint64_t missing = 0, unused = 0;
  format::for_each_brick(planes, [&](uint16_t entry, const format::BrickAt& at) {
    const uint64_t touched = format::corners_around(planes, at),
                   there = entry < kernels::kFirstMixedBrick
                               ? 0
                               : network.brick_corners[entry - kernels::kFirstMixedBrick];
    missing += uint64_t(std::popcount(touched & ~there));
    unused += uint64_t(std::popcount(there & ~touched));
  });
  if (missing > 0)
    findings.add(Advice::corner_without_features, place,
                 std::to_string(missing) + " corners of surface voxels have no features");
  if (unused > 0)
    findings.add(Advice::features_unused, place,
                 std::to_string(unused) + " corners that no surface voxel touches have features");
}

/// Triangles without area lie on edges of others (docs/encodings/bvh.md, "Slivers"), and no record counts
/// them.
uint64_t triangles_with_area(const kernels::TrianglesField& tree) {
  uint64_t count = 0;
  const auto corner = [&](const kernels::BvhNode& node, uint8_t index) {
    const float* p = tree.vertices[node.first_vertex + index];
    return std::array<float, 3>{p[0], p[1], p[2]};
  };
  for (uint32_t n = 0; n < tree.node_count; ++n) {
    const kernels::BvhNode& node = tree.nodes[n];
    for (const uint8_t slot : node.slots) {
      if (kernels::slot_kind(slot) == kernels::kInnerSlot) continue;
      const uint32_t first = node.first_triangle + kernels::slot_rank(slot);
      for (uint32_t t = first; t < first + kernels::slot_kind(slot); ++t) {
        const auto& [a, b, c] = tree.triangles[t];
        count += !collinear(corner(node, a), corner(node, b), corner(node, c));
      }
    }
  }
  return count;
}

void check_tree(const format::ObjectView& object, const kernels::TrianglesField& tree,
                const std::string& place, Findings& findings) {
  const auto beyond = [&](const float* vertex) {
    for (size_t a = 0; a < 3; ++a)
      if (vertex[a] < object.aabb_min[a] || vertex[a] > object.aabb_max[a]) return true;
    return false;
  };
  if (std::any_of(tree.vertices, tree.vertices + tree.vertex_count, beyond))
    findings.add(Advice::tree_out_of_bounds, place);
  if (tree.triangle_count > object.triangle_count && triangles_with_area(tree) > object.triangle_count)
    findings.add(Advice::triangle_count, place);
}

void check_object(const format::ObjectView& object, uint32_t index, Findings& findings) {
  const std::string place = object_place(index);
  if (object.unsupported)
    return findings.add(Advice::object_unsupported, place, std::string("it ") + object.unsupported);
  double diagonal = 0;
  for (size_t a = 0; a < 3; ++a) {
    const double side = double(object.aabb_max[a]) - double(object.aabb_min[a]);
    diagonal += side * side;
  }
  diagonal = std::sqrt(diagonal);
  if (double(object.bias) > diagonal / 10) findings.add(Advice::bias_large, place);
  if (const PlanesField* grid = format::grid_of(object)) {
    check_clearance(object, *grid, place, findings);
    check_kinds(*grid, place, findings);
  }
  if (object.triangles) check_tree(object, object.triangles->field, place, findings);
  if (object.network) check_corners(object.planes->field, object.network->field, place, findings);
}

/// Otherwise something that objects share may belong to one of the others.
bool all_known(const format::AssetView& asset) {
  return std::ranges::none_of(asset.objects,
                              [](const format::ObjectView& object) { return object.unsupported != nullptr; });
}

void check_networks(const format::AssetView& asset, Findings& findings) {
  const auto place = [](const char* section, size_t index) {
    return std::string("section ") + section + ", record " + std::to_string(index);
  };
  std::set<uint32_t> mlps, spherical;
  const bool known = all_known(asset);
  for (const format::ObjectView& object : asset.objects) {
    if (object.network) mlps.insert(object.network->mlp);
    if (object.spherical) spherical.insert(object.spherical->network);
  }
  for (size_t i = 0; i < asset.mlps.size(); ++i) {
    if (known && !mlps.contains(uint32_t(i))) findings.add(Advice::network_unused, place("MLPS", i));
    const kernels::Network& network = asset.mlps[i].network;
    const kernels::Network::Layer& last = network.layers[network.layer_count - 1];
    if (std::all_of(last.weights, last.weights + last.inputs, [](int8_t w) { return w == 0; }))
      findings.add(Advice::network_constant, place("MLPS", i));
  }
  for (size_t i = 0; i < asset.spherical_networks.size(); ++i)
    if (known && !spherical.contains(uint32_t(i))) findings.add(Advice::network_unused, place("SNET", i));
}

void check_alpha_maps(const format::AssetView& asset, Findings& findings) {
  if (!all_known(asset)) return;
  std::vector<bool> used(asset.alpha_maps.size());
  for (const format::ObjectView& object : asset.objects) {
    if (!object.holes) continue;
    const kernels::HolesField& holes = object.holes->field;
    for (uint32_t i = 0; i < holes.patch_count; ++i) used[holes.patches[i].map] = true;
  }
  for (size_t i = 0; i < used.size(); ++i)
    if (!used[i]) findings.add(Advice::alpha_map_unused, "section ALPH, record " + std::to_string(i));
}

void check_instances(const format::AssetView& asset, Findings& findings) {
  std::vector<bool> placed(asset.objects.size());
  asset.for_each_placed([&](uint32_t object, const format::InstanceView*) { placed[object] = true; });
  for (uint32_t i = 0; i < asset.instances.size(); ++i) {
    const format::InstanceView& instance = asset.instances[i];
    kernels::WorldToObject transform;
    bool well_conditioned = false;
    if (!kernels::invert(instance.transform.data(), transform, well_conditioned))
      findings.add(Advice::transform_singular, instance_place(i));
    else if (!well_conditioned)
      findings.add(Advice::transform_skewed, instance_place(i));
  }
  for (uint32_t i = 0; i < placed.size(); ++i)
    if (!placed[i] && asset.objects[i].level == 0) findings.add(Advice::object_not_placed, object_place(i));
}

template <class Views, class PlaceOf>
void check_names(const Views& views, const PlaceOf& place_of, Findings& findings) {
  std::set<std::string_view> names;
  for (uint32_t i = 0; i < views.size(); ++i)
    if (!views[i].name.empty() && !names.insert(views[i].name).second)
      findings.add(Advice::same_name, place_of(i),
                   "has the name of one before it, '" + std::string(views[i].name) + "'");
}

/// What this build does not know, and so did not look at.
void check_unknown(const format::AssetView& asset, Findings& findings) {
  for (const format::SectionView& section : asset.sections) {
    const format::KnownSection* known = format::known_section(section.type);
    if (!known)
      findings.add(Advice::section_skipped, "section " + format::section_name(section.type));
    else if (section.record_size > known->record_bytes && known->record_bytes != 0)
      findings.add(Advice::records_longer, "section " + format::section_name(section.type),
                   "its records have " + std::to_string(section.record_size) +
                       " bytes, of which this build knows " + std::to_string(known->record_bytes));
  }
}

}  // namespace

void check_model(const format::AssetView& asset, Findings& findings) {
  check_unknown(asset, findings);
  for (uint32_t i = 0; i < asset.objects.size(); ++i) check_object(asset.objects[i], i, findings);
  check_names(asset.objects, object_place, findings);
  check_networks(asset, findings);
  check_alpha_maps(asset, findings);
  check_instances(asset, findings);
  check_names(asset.instances, instance_place, findings);
}

}  // namespace nif::validate
