// One mesh in every form that the product has for it, asked in every way.
#pragma once

#include <nif/nif.hpp>

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "formats/base/random.hpp"
#include "formats/mesh/scene.hpp"
#include "tests/exact/generators.hpp"
#include "tests/support/first_hits.hpp"

namespace nif::test {

/// The encodings, and the objects of an asset.
enum class Kind : uint32_t { bvh, exact, proof, segment };
inline constexpr uint32_t kKinds = 4;

/// What a scene has.
enum class Placed {
  bvh,
  exact,
  proof,
  segment,
  all,        ///< in the same place
  moved_bvh,  ///< these four through a transform
  moved_exact,
  moved_proof,
  moved_segment,
  crowd,   ///< several of any kinds, by transforms that differ a little
  changed  ///< such a crowd with origins, of which rays do not meet all
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

  /// Where it must be, as its origin and the scene's have it: a translation of up to 48 bits.
  Transform placed{};
  std::array<float, 3> remainder{};

  bool has_triangles() const { return kind == Kind::bvh || kind == Kind::exact; }
  bool in_place() const { return placed == mesh::kIdentity && remainder == std::array<float, 3>{}; }
};

/// Calls that a ray is asked by: a query of all outputs, one of visibility alone, first hits, what is open,
/// and a query with a fallback. They must agree.
inline constexpr uint32_t kCalls = 5;

/// All that one scene says of some rays.
struct Said {
  explicit Said(size_t count)
      : visible(count, 0xcc),
        certain(count, 0xcc),
        listed(count, 0),
        open(count, NIF_NONE),
        logit(count),
        begin(count),
        end(count),
        hits(count) {}
  bool operator==(const Said&) const = default;

  std::vector<uint8_t> visible, certain;
  std::vector<uint8_t> listed;  ///< 1: it is among the open rays, from `begin` to `end`
  std::vector<uint32_t> open;   ///< the instance that alone leaves it open, or NIF_NONE
  std::vector<int32_t> logit;
  std::vector<float> begin, end;
  FirstHits hits;
};

/// A device, and how it is asked.
struct Way {
  std::string name;
  nifkit::Device device;
  bool coded;     ///< the file that it loads
  uint64_t most;  ///< rays at a time
  bool gpu = false, mapped = false;
};

/// Those of this machine; the first is the reference's. `module`: a GPU's, or empty.
std::vector<Way> make_ways(const std::string& module);

/// Of the grid that planes lie in.
struct GridShape {
  uint32_t levels, resolution;
};
GridShape draw_grid(Random& random);

class Subject {
 public:
  /// A mesh too large or too small for planes has a BVH alone, with or without slivers. Throws nif::Error
  /// where it cannot have that.
  Subject(const mesh::Mesh& mesh, const Transform& transform, Random& random);

  nifkit::Asset load(const Way& way) const;
  /// What a scene of it says. `way.most` or fewer rays at a time; a query of a part of the outputs, too, must
  /// say the same: else throws std::runtime_error.
  Said ask(const Way& way, const nifkit::Asset& asset, Placed placed, const std::vector<NifRay>& rays) const;
  /// Of the triangle that a hit has named.
  void corners_of(uint32_t triangle, mesh::Float3 corners[3]) const;
  /// In the scene's order; none where the mesh has no such objects.
  const std::vector<Instance>& instances(Placed placed) const { return scenes_[size_t(placed)]; }

 private:
  void place(const Transform& transform, bool planes, const mesh::Box& box, Random& random);
  void draw_changed(const Transform& transform, bool planes, const mesh::Box& box, Random& random);
  nifkit::Scene make_scene(const Way& way, const nifkit::Asset& asset, Placed placed) const;

  std::vector<std::byte> plain_, coded_;
  std::vector<Instance> scenes_[kPlaced];
  // Of the scene that is changed.
  Origin origin_{};
  uint32_t ray_mask_ = 0;                               ///< of all rays; 0: they have none
  bool committed_before_ = false;                       ///< instances are changed after a commit
  std::vector<std::array<mesh::Float3, 3>> triangles_;  ///< in the order of the object
};

}  // namespace nif::test
