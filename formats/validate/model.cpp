// What a file must have for its answers to be those of its mesh, as far as it can be seen without the mesh.
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "formats/base/collinear.hpp"
#include "formats/nif/proof/check.hpp"
#include "formats/validate/validate.hpp"
#include "kernels/reference/instance.hpp"
#include "kernels/reference/parts.hpp"

namespace nif::validate {
namespace {

using kernels::ProofField;

std::string object_place(uint32_t index) { return "section OBJS, record " + std::to_string(index); }
std::string instance_place(uint32_t index) { return "section INST, record " + std::to_string(index); }

/// The grid must surround the bounds: what is beyond its border counts as outside.
void check_clearance(const format::ObjectView& object, const ProofField& grid, const std::string& place,
                     Findings& findings) {
  constexpr double kClearance = 1.0 / 32;
  constexpr double kRounded = 1e-4;  // of a voxel: origin and scale are single precision
  for (size_t a = 0; a < 3; ++a) {
    const double scale = double(grid.voxels_per_unit), origin = double(grid.origin[a]),
                 low = (double(object.aabb_min[a]) - origin) * scale,
                 high = (double(object.aabb_max[a]) - origin) * scale;
    if (low >= kClearance - kRounded && high <= double(grid.voxels[a]) - kClearance + kRounded) continue;
    findings.add(Advice::grid_too_small, place);
    return;
  }
}

/// Cells that state less than follows from all of them: their proofs are not made use of.
void check_kinds(const ProofField& grid, const std::string& place, Findings& findings) {
  const format::SideRegions sides(grid);
  const auto says_less = [&](uint32_t word, uint32_t record) {
    const uint32_t kind = kernels::word_kind(word);
    return kind != kernels::kLink && format::proven_kind(sides, record, format::separates(kind)) != kind;
  };
  uint64_t count = 0;
  for (uint32_t i = 0; i < grid.surface_voxels; ++i) count += says_less(grid.voxel_records[i], i);
  for (uint32_t i = 0; i < grid.part_count; ++i) count += says_less(grid.parts[i], grid.surface_voxels + i);
  if (count > 0)
    findings.add(Advice::kind_says_less, place,
                 std::to_string(count) + " cells say less than their planes and their neighbours prove");
}

/// Features are there at the corners of surface voxels, and nowhere else.
void check_corners(const kernels::SegmentField& field, const std::string& place, Findings& findings) {
  const uint64_t across = field.bricks[0], down = field.bricks[1], layers = field.bricks[2];
  std::vector<uint64_t> touched(across * down * layers);
  const auto touch = [&](uint64_t x, uint64_t y, uint64_t z) {
    touched[x / 4 + across * (y / 4 + down * (z / 4))] |= uint64_t{1} << (x % 4 + 4 * (y % 4) + 16 * (z % 4));
  };
  for (uint64_t brick = 0; brick < touched.size(); ++brick) {
    const uint16_t entry = field.brick_table[brick];
    if (entry < kernels::kFirstMixedBrick) continue;
    const kernels::BrickStates& states = field.brick_states[entry - kernels::kFirstMixedBrick];
    for (uint64_t left = states.surface & ~states.aux; left != 0; left &= left - 1) {
      const auto bit = uint64_t(std::countr_zero(left));
      const uint64_t x = 4 * (brick % across) + bit % 4, y = 4 * (brick / across % down) + bit / 4 % 4,
                     z = 4 * (brick / across / down) + bit / 16;
      for (uint64_t c = 0; c < 8; ++c) touch(x + (c & 1), y + (c >> 1 & 1), z + (c >> 2));
    }
  }
  uint64_t missing = 0, unused = 0;
  for (size_t brick = 0; brick < touched.size(); ++brick) {
    const uint16_t entry = field.brick_table[brick];
    const uint64_t there =
        entry < kernels::kFirstMixedBrick ? 0 : field.brick_corners[entry - kernels::kFirstMixedBrick];
    missing += uint64_t(std::popcount(touched[brick] & ~there));
    unused += uint64_t(std::popcount(there & ~touched[brick]));
  }
  if (missing > 0)
    findings.add(Advice::corner_without_features, place,
                 std::to_string(missing) + " corners of surface voxels have no features");
  if (unused > 0)
    findings.add(Advice::features_unused, place,
                 std::to_string(unused) + " corners that no surface voxel touches have features");
}

/// Those without one lie on edges of others (docs/encodings/bvh.md, "Slivers"), and no record counts them.
uint64_t triangles_with_area(const kernels::BvhField& tree) {
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

void check_tree(const format::ObjectView& object, const kernels::BvhField& tree, const std::string& place,
                Findings& findings) {
  const auto beyond = [&](const float* vertex) {
    for (size_t a = 0; a < 3; ++a)
      if (vertex[a] < object.aabb_min[a] || vertex[a] > object.aabb_max[a]) return true;
    return false;
  };
  if (std::any_of(tree.vertices, tree.vertices + tree.vertex_count, beyond))
    findings.add(Advice::tree_out_of_bounds, place);
  if (tree.triangle_count > object.triangles && triangles_with_area(tree) > object.triangles)
    findings.add(Advice::triangle_count, place);
}

void check_object(const format::ObjectView& object, uint32_t index, Findings& findings) {
  const std::string place = object_place(index);
  double diagonal = 0;
  for (size_t a = 0; a < 3; ++a) {
    const double side = double(object.aabb_max[a]) - double(object.aabb_min[a]);
    diagonal += side * side;
  }
  diagonal = std::sqrt(diagonal);
  if (double(object.bias) > diagonal / 10) findings.add(Advice::bias_large, place);
  if (const ProofField* grid = format::grid_of(object)) {
    check_clearance(object, *grid, place, findings);
    check_kinds(*grid, place, findings);
  }
  std::visit(
      [&](const auto& view) {
        if (const kernels::BvhField* tree = kernels::tree_of(view.field))
          check_tree(object, *tree, place, findings);
      },
      object.content);
  if (object.is<format::SegmentView>())
    check_corners(object.as<format::SegmentView>().field, place, findings);
}

void check_networks(const format::AssetView& asset, Findings& findings) {
  const auto place = [](const char* section, size_t index) {
    return std::string("section ") + section + ", record " + std::to_string(index);
  };
  std::set<uint32_t> segment, spherical;
  for (const format::ObjectView& object : asset.objects) {
    if (object.is<format::SegmentView>()) segment.insert(object.as<format::SegmentView>().network);
    if (object.is<format::SphericalView>()) spherical.insert(object.as<format::SphericalView>().network);
  }
  for (size_t i = 0; i < asset.networks.size(); ++i) {
    if (!segment.contains(uint32_t(i))) findings.add(Advice::network_unused, place("NETS", i));
    const kernels::Network& network = asset.networks[i].network;
    const kernels::Network::Layer& last = network.layers[network.layer_count - 1];
    if (std::all_of(last.weights, last.weights + last.inputs, [](int8_t w) { return w == 0; }))
      findings.add(Advice::network_constant, place("NETS", i));
  }
  for (size_t i = 0; i < asset.spherical_networks.size(); ++i)
    if (!spherical.contains(uint32_t(i))) findings.add(Advice::network_unused, place("SNET", i));
}

void check_instances(const format::AssetView& asset, Findings& findings) {
  std::vector<bool> placed(asset.objects.size(), asset.instances.empty() && !asset.places_nothing);
  for (uint32_t i = 0; i < asset.instances.size(); ++i) {
    const format::InstanceView& instance = asset.instances[i];
    placed[instance.object] = true;
    kernels::WorldToObject transform;
    bool well_conditioned = false;
    if (!kernels::invert(instance.transform.data(), transform, well_conditioned))
      findings.add(Advice::transform_singular, instance_place(i));
    else if (!well_conditioned)
      findings.add(Advice::transform_skewed, instance_place(i));
  }
  for (uint32_t i = 0; i < placed.size(); ++i)
    if (!placed[i]) findings.add(Advice::object_not_placed, object_place(i));
}

template <class Views, class PlaceOf>
void check_names(const Views& views, const PlaceOf& place_of, Findings& findings) {
  std::set<std::string_view> names;
  for (uint32_t i = 0; i < views.size(); ++i)
    if (!views[i].name.empty() && !names.insert(views[i].name).second)
      findings.add(Advice::same_name, place_of(i),
                   "has the name of one before it, '" + std::string(views[i].name) + "'");
}

void check_sections(const format::AssetView& asset, Findings& findings) {
  std::set<uint32_t> known = {format::kObjects,       format::kInstances,     format::kNames,
                              format::kMetadata,      format::kPrimaries,     format::kPrimaryValues,
                              format::kSourceRecords, format::kSourceNumbers, format::kColorRecords,
                              format::kColorValues,   format::kTranslations};
  format::for_each_encoding([&](auto encoding) {
    for (const uint32_t own : encoding.kSections) known.insert(own);
  });
  for (const format::SectionView& section : asset.sections)
    if (!known.contains(section.type))
      findings.add(Advice::section_skipped, "section " + format::section_name(section.type));
}

}  // namespace

void check_model(const format::AssetView& asset, Findings& findings) {
  check_sections(asset, findings);
  for (uint32_t i = 0; i < asset.objects.size(); ++i) check_object(asset.objects[i], i, findings);
  check_names(asset.objects, object_place, findings);
  check_networks(asset, findings);
  check_instances(asset, findings);
  check_names(asset.instances, instance_place, findings);
}

}  // namespace nif::validate
