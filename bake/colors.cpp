// Computes voxel colours. Clips each triangle to the voxel, cuts the rest into a fan, and looks up colours
// there, in linear light. Where triangles have holes, only what blocks counts: nothing else is ever hit.
// They are stored in 16 bits as square roots, so that dark colours keep more steps.
#include "bake/colors.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "bake/encoder.hpp"
#include "bake/ground_truth/holes_filter.hpp"
#include "bake/planes/clipped_polygon.hpp"
#include "bake/planes/voxelize.hpp"
#include "kernels/reference/planes/voxel_colors.hpp"

namespace nif::bake {
namespace {

using Weights = std::array<double, 3>;  ///< of a triangle's corners

/// A texel's index along an axis.
uint32_t wrapped(int64_t at, uint32_t size, mesh::Wrap wrap) {
  const auto n = int64_t{size};
  switch (wrap) {
    case mesh::Wrap::clamp:
      return uint32_t(std::clamp<int64_t>(at, 0, n - 1));
    case mesh::Wrap::mirror: {
      const int64_t m = ((at % (2 * n)) + 2 * n) % (2 * n);
      return uint32_t(m < n ? m : 2 * n - 1 - m);
    }
    case mesh::Wrap::repeat:
      break;
  }
  return uint32_t(((at % n) + n) % n);
}

/// Bilinear, in linear light.
Double3 look_up(const mesh::Texture& texture, const std::array<mesh::Wrap, 2>& wrap, double u, double v) {
  static const std::array<double, 256> linear = [] {
    std::array<double, 256> values;
    for (size_t i = 0; i < values.size(); ++i) values[i] = mesh::linear_of(double(i) / 255);
    return values;
  }();
  // A file may have any coordinates; beyond this, no precision is left for a texel's position.
  constexpr double kFarthest = 1e6;
  if (!(std::abs(u) <= kFarthest) || !(std::abs(v) <= kFarthest)) u = v = 0;
  const double x = u * texture.width - 0.5, y = v * texture.height - 0.5;
  const auto column = int64_t(std::floor(x)), row = int64_t(std::floor(y));
  const double right = x - double(column), down = y - double(row);
  Double3 sum{};
  for (int k = 0; k < 4; ++k) {
    const uint32_t i = wrapped(column + k % 2, texture.width, wrap[0]),
                   j = wrapped(row + k / 2, texture.height, wrap[1]);
    const double share = (k % 2 ? right : 1 - right) * (k / 2 ? down : 1 - down);
    const uint8_t* texel = texture.texels.data() + 3 * (size_t(j) * texture.width + i);
    for (size_t c = 0; c < 3; ++c) sum[c] += share * linear[texel[c]];
  }
  return sum;
}

/// The base colours of a mesh's triangles.
class Look {
 public:
  Look(const mesh::Scene& scene, const mesh::Mesh& mesh) : scene_(scene), mesh_(mesh) {}

  const mesh::Material& material(uint32_t triangle) const {
    static const mesh::Material kWhite;
    const std::vector<uint32_t>& materials = mesh_.look.materials;
    return materials.empty() ? kWhite : scene_.materials[materials[triangle]];
  }

  /// Linear, 0 to 1, at a point of a triangle.
  Double3 color(uint32_t triangle, const Weights& weights) const {
    const mesh::Triangle& corners = mesh_.triangles[triangle];
    const mesh::Material& material = this->material(triangle);
    Double3 color{double(material.factor[0]), double(material.factor[1]), double(material.factor[2])};
    const auto mix = [&](const auto& values, size_t c) {
      double sum = 0;
      for (size_t k = 0; k < 3; ++k) sum += weights[k] * double(values[corners[k]][c]);
      return sum;
    };
    if (!mesh_.look.colors.empty())
      for (size_t c = 0; c < 3; ++c) color[c] *= mix(mesh_.look.colors, c);
    if (material.texture == mesh::kNoTexture) return color;
    const bool placed = !mesh_.look.coordinates.empty();
    const double u = placed ? mix(mesh_.look.coordinates, 0) : 0,
                 v = placed ? mix(mesh_.look.coordinates, 1) : 0;
    const auto& m = material.transform;
    const Double3 texel = look_up(scene_.textures[material.texture], material.wrap,
                                  double(m[0]) * u + double(m[1]) * v + double(m[2]),
                                  double(m[3]) * u + double(m[4]) * v + double(m[5]));
    for (size_t c = 0; c < 3; ++c) color[c] *= texel[c];
    return color;
  }

 private:
  const mesh::Scene& scene_;
  const mesh::Mesh& mesh_;
};

/// Weights of a triangle's corners at points of its plane.
class Places {
 public:
  explicit Places(const Double3 (&corners)[3])
      : origin_(corners[0]),
        first_(corners[1] - corners[0]),
        second_(corners[2] - corners[0]),
        normal_(cross(first_, second_)),
        square_(dot(normal_, normal_)) {}

  Weights at(const Double3& point) const {
    const Double3 from = point - origin_;
    if (!(square_ > 0)) return {1.0 / 3, 1.0 / 3, 1.0 / 3};
    const double v = std::clamp(dot(cross(from, second_), normal_) / square_, 0.0, 1.0),
                 w = std::clamp(dot(cross(first_, from), normal_) / square_, 0.0, 1.0 - v);
    return {1 - v - w, v, w};
  }

 private:
  Double3 origin_, first_, second_, normal_;
  double square_;
};

/// What a triangle's colour counts at a point.
class Opacity {
 public:
  Opacity(const mesh::CleanMesh& surface, uint32_t triangle) {
    if (surface.holes.empty() || !surface.holes[triangle].any()) return;
    holes_ = &surface.holes[triangle];
    map_ = surface.alpha_maps[holes_->map].get();
  }

  bool has_holes() const { return holes_ != nullptr; }
  double at(const Weights& weights) const {
    return !holes_ || blocks(*holes_, *map_, {weights[1], weights[2]}) ? 1 : 0;
  }

 private:
  const mesh::TriangleHoles* holes_ = nullptr;
  const mesh::AlphaMap* map_ = nullptr;
};

struct Sum {
  Double3 color{};
  double weight = 0;

  void add(const Double3& one, double by) {
    color = color + one * by;
    weight += by;
  }
};

/// How often the sides of a part are halved before it is sampled: a triangle with holes needs more samples, because
/// only some of them count.
constexpr int kHalved = 1, kHalvedWithHoles = 4;

/// The mean colour of voxels: of what blocks, and of everything.
struct Sums {
  Sum blocking, whole;
};

/// A triangle whose colours are averaged.
struct Part {
  const Look& look;
  const Places& places;
  const Opacity& opacity;
  uint32_t triangle;

  void sample(const Double3& a, const Double3& b, const Double3& c, double area, Sums& sums) const {
    const Weights weights = places.at((a + b + c) * (1.0 / 3));
    const Double3 color = look.color(triangle, weights);
    sums.blocking.add(color, area * opacity.at(weights));
    sums.whole.add(color, area);
  }
  /// Cuts it in four, so often.
  void sample(const Double3& a, const Double3& b, const Double3& c, double area, int halved,
              Sums& sums) const {
    if (halved == 0) return sample(a, b, c, area, sums);
    const Double3 ab = (a + b) * 0.5, bc = (b + c) * 0.5, ca = (c + a) * 0.5;
    sample(a, ab, ca, area / 4, halved - 1, sums);
    sample(ab, b, bc, area / 4, halved - 1, sums);
    sample(ca, bc, c, area / 4, halved - 1, sums);
    sample(ab, bc, ca, area / 4, halved - 1, sums);
  }
};

/// Adds the colour of a triangle of a fan. With a texture or holes it is sampled at the centre of triangles that are made
/// by halving the sides; otherwise the colour is linear, and the centre has the mean.
void add_part(const Part& part, const Double3& a, const Double3& b, const Double3& c, bool textured,
              Sums& sums) {
  const double area = length(cross(b - a, c - a)) / 2;
  if (!(area > 0)) return;
  part.sample(a, b, c, area, part.opacity.has_holes() ? kHalvedWithHoles : textured ? kHalved : 0, sums);
}

uint16_t packed(const Double3& color) {
  const auto step = [](double linear, double steps) {
    return uint32_t(std::lround(std::sqrt(std::clamp(linear, 0.0, 1.0)) * steps));
  };
  return uint16_t(step(color[0], 31) << 11 | step(color[1], 63) << 5 | step(color[2], 31));
}

}  // namespace

void reserve_colors(const Prepared& prepared, Form& form) {
  if (!form.object().planes || !prepared.source->look.known()) return;
  const size_t voxels = form.object().planes->voxel_records.size();
  form.object().colors.emplace(voxels);
  const uint64_t bytes = voxels * sizeof(uint16_t);
  form.cost.bytes += bytes;
  if (form.cost.resident > 0) form.cost.resident += bytes;
  form.sections = format::section_bytes(form.alone);
}

void fill_colors(const mesh::Scene& scene, const Prepared& prepared, Form& form) {
  format::Object& object = form.object();
  if (object.colors) object.colors = mean_colors(scene, prepared, format::field_of(*object.planes));
}

bool has_colors(const mesh::Scene& scene) {
  return std::ranges::any_of(scene.meshes, [](const mesh::Mesh& mesh) { return mesh.look.known(); });
}

format::Colors mean_colors(const mesh::Scene& scene, const Prepared& prepared,
                           const kernels::PlanesField& field) {
  Grid grid;
  std::copy_n(field.origin, 3, grid.origin.begin());
  grid.voxels_per_unit = field.voxels_per_unit;
  grid.levels = field.levels;
  std::copy_n(field.voxels, 3, grid.voxels.begin());
  const mesh::CleanMesh& surface = prepared.surface;
  const SurfaceVoxels voxels = voxelize(grid, surface);
  const std::vector<uint32_t> numbers = mesh::source_triangles(surface);
  const Look look(scene, *prepared.source);
  const double half = 0.5 + kernels::kSurfacePadding / grid.cells();
  format::Colors colors(field.surface_voxels);
  tbb::parallel_for(size_t{0}, voxels.voxels.size(), [&](size_t i) {
    const uint32_t at = voxels.voxels[i];
    const int32_t voxel[3] = {int32_t(at % grid.voxels[0]), int32_t(at / grid.voxels[0] % grid.voxels[1]),
                              int32_t(at / grid.voxels[0] / grid.voxels[1])};
    uint32_t index = 0;
    if (!kernels::surface_voxel(field, voxel, index)) return;
    const Double3 centre{voxel[0] + 0.5, voxel[1] + 0.5, voxel[2] + 0.5};
    Sums sums;
    Sum touching;  // of whole triangles, if none has an area within the voxel
    for (const uint32_t t : voxels.touching_voxel(i)) {
      if (t >= surface.triangles.size()) break;  // slivers
      Double3 corners[3];
      for (size_t k = 0; k < 3; ++k)
        corners[k] = grid.to_grid(surface.positions[surface.triangles[t][k]]) - centre;
      const bool textured = look.material(numbers[t]).texture != mesh::kNoTexture;
      const Places places(corners);
      Polygon polygon(corners);
      polygon.clip(half);
      const auto part = polygon.corners();
      const Opacity opacity(surface, t);
      for (size_t k = 2; k < part.size(); ++k)
        add_part({look, places, opacity, numbers[t]}, part[0], part[k - 1], part[k], textured, sums);
      touching.add(look.color(numbers[t], {1.0 / 3, 1.0 / 3, 1.0 / 3}), 1);
    }
    const Sum& mean = sums.blocking.weight > 0 ? sums.blocking
                      : sums.whole.weight > 0  ? sums.whole
                                               : touching;
    if (mean.weight > 0) colors[index] = packed(mean.color * (1 / mean.weight));
  });
  return colors;
}

}  // namespace nif::bake
