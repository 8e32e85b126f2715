// One mesh in every form that the product has for it, asked in every way.
#pragma once

#include <nif/nif.hpp>

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "formats/base/random.hpp"
#include "formats/mesh/mesh_scene.hpp"
#include "tests/exact/generators.hpp"
#include "tests/exact/ways.hpp"

namespace nif::test {

/// The encodings, and the objects of an asset.
enum class Kind : uint32_t { bvh, exact, proof, segment };
inline constexpr uint32_t kKinds = 4;

/// Kinds of scenes.
enum class Placed {
  bvh,
  exact,
  proof,
  segment,
  all,        ///< untransformed
  moved_bvh,  ///< these four through a transform
  moved_exact,
  moved_proof,
  moved_segment,
  crowd,   ///< several of any kind, with slightly different transforms
  changed  ///< a crowd with origins, of which rays meet only some
};
inline constexpr uint32_t kPlaced = 11;
const char* name_of(Placed placed);
inline bool is_moved(Placed placed) { return placed >= Placed::moved_bvh; }

using Origin = std::array<double, 3>;

/// An object in a scene.
struct Instance {
  Kind kind;
  Transform transform;
  Origin origin{};
  uint32_t mask = 0xffffffffu;
  enum class State { enabled, disabled, removed } state = State::enabled;
  bool met = true;  ///< by rays of the scene's mask

  /// Its exact position by its origin and the scene's: a translation of up to 48 bits.
  Transform placed{};
  std::array<float, 3> remainder{};

  bool has_triangles() const { return kind == Kind::bvh || kind == Kind::exact; }
  bool in_place() const { return placed == mesh::kIdentity && remainder == std::array<float, 3>{}; }
};

/// Options of the planes' grid.
struct GridShape {
  uint32_t levels, resolution;
};
GridShape draw_grid(Random& random);

class Subject {
 public:
  /// A mesh too large or too small for planes only has a BVH, with or without slivers. Throws nif::Error if
  /// that is not possible either.
  Subject(const mesh::Mesh& mesh, const Transform& transform, Random& random);

  nifkit::Asset load(const Way& way) const;
  /// The answers of a scene, with at most `way.most` rays per call. Throws std::runtime_error if a query for
  /// some of the outputs differs.
  Said ask(const Way& way, const nifkit::Asset& asset, Placed placed, const std::vector<NifRay>& rays) const;
  /// The corners of the triangle that a hit refers to.
  void corners_of(uint32_t triangle, mesh::Float3 corners[3]) const;
  /// In the scene's order; empty if the mesh has no such objects.
  const std::vector<Instance>& instances(Placed placed) const { return scenes_[size_t(placed)]; }

 private:
  void place(const Transform& transform, bool planes, const mesh::Box& box, Random& random);
  void draw_changed(const Transform& transform, bool planes, const mesh::Box& box, Random& random);
  nifkit::Scene make_scene(const Way& way, const nifkit::Asset& asset, Placed placed) const;

  std::vector<std::byte> plain_, coded_;
  std::vector<Instance> scenes_[kPlaced];
  // For the scene with changes.
  Origin origin_{};
  uint32_t ray_mask_ = 0;                               ///< for all rays; 0: no mask
  bool committed_before_ = false;                       ///< instances are changed after a commit
  std::vector<std::array<mesh::Float3, 3>> triangles_;  ///< in the order of the object
};

}  // namespace nif::test
