// JSON has every count and lists the largest components; text has a line for each kind of finding. A
// component has a genus and a volume only if it is a solid.
#include "tools/mesh/mesh_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "formats/base/quantities.hpp"

namespace nif::tools {
namespace {

using inspect::Component;
using inspect::Inspection;
using Json = nlohmann::ordered_json;

constexpr size_t kListed = 1000;

Json to_json(const Component& component) {
  return {{"triangles", component.triangles},
          {"boundary_edges", component.boundary_edges},
          {"non_manifold_edges", component.non_manifold_edges},
          {"inconsistent_edges", component.inconsistent_edges},
          {"closed", component.closed()},
          {"genus", component.genus() ? Json(*component.genus()) : Json(nullptr)},
          {"area", component.area},
          {"volume", component.solid() ? Json(component.volume) : Json(nullptr)}};
}

std::string genus_of(const Inspection& inspection) {
  uint64_t solids = 0, sum = 0, most = 0;
  for (const Component& component : inspection.components)
    if (const auto genus = component.genus()) ++solids, sum += *genus, most = std::max(most, *genus);
  if (solids == 0) return "none: no component is closed, manifold and consistently oriented";
  if (solids == 1) return fmt::format("{}", sum);
  return fmt::format("{} in total over {} solids, at most {}", sum, solids, most);
}

}  // namespace

Json to_json(const Inspection& i) {
  Json components = Json::array();
  for (const inspect::Component& component : i.largest(kListed)) components.push_back(to_json(component));
  return {{"triangles", i.triangles},
          {"vertices", i.vertices},
          {"distinct_vertices", i.distinct_vertices},
          {"bounds", {i.low, i.high}},
          {"degenerate", i.degenerate},
          {"duplicate", i.duplicate},
          {"opposite", i.opposite},
          {"edges", i.edges},
          {"boundary_edges", i.boundary_edges},
          {"boundary_loops", i.boundary_loops},
          {"longest_loop", i.longest_loop},
          {"non_manifold_edges", i.non_manifold_edges},
          {"non_manifold_vertices", i.non_manifold_vertices},
          {"inconsistent_edges", i.inconsistent_edges},
          {"components", i.components.size()},
          {"closed_components", i.closed_components()},
          {"solids", i.solids()},
          {"inward_solids", i.inward_solids()},
          {"area", i.area},
          {"volume", i.volume},
          {"largest_components", std::move(components)}};
}

std::string summary_of(const Inspection& i) {
  const uint64_t closed = i.closed_components(), all = i.components.size();
  return fmt::format("{}, {} closed, {}, {}, {}", count_of(all, "component"), closed,
                     count_of(i.boundary_edges, "boundary edge"),
                     count_of(i.non_manifold_edges, "non-manifold edge"),
                     count_of(i.inconsistent_edges, "inconsistent edge"));
}

std::string to_text(const Inspection& i) {
  const uint64_t closed = i.closed_components(), all = i.components.size(), solids = i.solids(),
                 inward = i.inward_solids();
  std::string text;
  const auto line = [&](const char* key, const std::string& value) {
    text += fmt::format("{:<13}{}\n", key, value);
  };
  line("triangles", fmt::format("{}: {} degenerate, {} duplicate, {} opposite to another", i.triangles,
                                i.degenerate, i.duplicate, i.opposite));
  line("vertices", fmt::format("{}: {} different positions used", i.vertices, i.distinct_vertices));
  line("bounds", fmt::format("({:.6g}, {:.6g}, {:.6g}) to ({:.6g}, {:.6g}, {:.6g})", i.low[0], i.low[1],
                             i.low[2], i.high[0], i.high[1], i.high[2]));
  line("components", fmt::format("{}: {} closed, {} open", all, closed, all - closed));
  line("boundary", i.boundary_edges == 0
                       ? "none"
                       : fmt::format("{} in {}, the longest of {}", count_of(i.boundary_edges, "edge"),
                                     count_of(i.boundary_loops, "loop"), count_of(i.longest_loop, "edge")));
  line("non-manifold",
       fmt::format(
           "{}, {}", count_of(i.non_manifold_edges, "edge"),
           i.non_manifold_vertices == 1 ? "1 vertex" : fmt::format("{} vertices", i.non_manifold_vertices)));
  line("orientation",
       (i.inconsistent_edges == 0
            ? std::string("consistent")
            : fmt::format("inconsistent at {}", count_of(i.inconsistent_edges, "edge"))) +
           fmt::format("; of {}, {} outwards, {} inwards",
                       solids == 1 ? "1 solid" : fmt::format("{} solids", solids), solids - inward, inward));
  line("genus", genus_of(i));
  line("area", fmt::format("{:.6g}", i.area));
  line("volume", solids == 0 ? "none" : fmt::format("{:.6g}", i.volume));
  return text;
}

}  // namespace nif::tools
