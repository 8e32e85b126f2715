#include "formats/mesh/alike.hpp"

#include <algorithm>
#include <map>
#include <utility>

namespace nif::mesh {

std::vector<uint32_t> first_alike(std::span<const Mesh> meshes, bool looks) {
  std::map<std::pair<size_t, size_t>, std::vector<uint32_t>> by_size;  // one of each content
  std::vector<uint32_t> firsts;
  for (uint32_t m = 0; m < meshes.size(); ++m) {
    const Mesh& mesh = meshes[m];
    std::vector<uint32_t>& candidates = by_size[{mesh.positions.size(), mesh.triangles.size()}];
    const auto found = std::ranges::find_if(candidates, [&](uint32_t other) {
      return mesh.positions == meshes[other].positions && mesh.triangles == meshes[other].triangles &&
             (!looks || mesh.look == meshes[other].look);
    });
    firsts.push_back(found == candidates.end() ? m : *found);
    if (found == candidates.end()) candidates.push_back(m);
  }
  return firsts;
}

}  // namespace nif::mesh
