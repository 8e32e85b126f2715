// Defines the ways to answer visibility that `nif study` compares.
#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "bake/bake.hpp"
#include "bake/ground_truth/embree_scene.hpp"
#include "bake/ground_truth/evaluate.hpp"
#include "bake/ground_truth/prepare.hpp"

namespace nif::tools {

/// The mesh under study. Immutable once made.
struct StudiedMesh {
  /// `scene` has one mesh and one instance. Throws as prepare() does.
  explicit StudiedMesh(mesh::Scene one)
      : scene(std::move(one)), prepared(bake::prepare(scene.meshes.front())), truth(prepared) {}
  StudiedMesh(const StudiedMesh&) = delete;
  StudiedMesh& operator=(const StudiedMesh&) = delete;

  mesh::Scene scene;
  bake::Prepared prepared;
  bake::GroundTruth truth;
};

/// Queries some rays on the calling thread, and returns the seconds that it took, without the time for laying
/// out the rays.
using TimedWay = std::function<double()>;

/// A way to answer, ready for queries. Any number of threads may query it.
class Rival {
 public:
  virtual ~Rival() = default;
  /// Bytes in memory of everything that answering needs.
  virtual uint64_t resident_bytes() const = 0;
  /// Bytes of the file that it is loaded from; 0 if it has no file of its own.
  virtual uint64_t file_bytes() const { return 0; }
  /// Must not outlive the rival.
  virtual bake::Answerer answerer() const = 0;
  /// Every way to query these rays, of which the fastest counts. The ways must not outlive the rival or the
  /// rays.
  virtual std::vector<TimedWay> ways(const bake::RaysWithTruth& rays, bake::RaySet set) const = 0;
};

/// Reports progress while a rival is made; may throw Error(interrupted).
using RivalProgress = std::function<void(double fraction, const std::string& text)>;

/// One size of a family of rivals, to be made later.
struct RivalPlan {
  std::string family;  ///< "segment", "OpenMesh: Embree"
  std::string size;    ///< "scale 0.5", "10,000 triangles"
  /// Throws nif::Error with the reason if it cannot be made of this mesh.
  std::function<std::unique_ptr<Rival>(const RivalProgress&)> make;
  /// In bytes of memory: it is skipped if the size before it takes as much.
  double while_below = std::numeric_limits<double>::infinity();
};

struct StudyScale {
  bool quick = false;  ///< two sizes of each family, preset `fast`, and little training of `spherical`
  uint64_t seed = 1;
};

// The families, in the order of display. The mesh must outlive the plans and the rivals.
/// nifkit's encodings, `proof` in front of Embree, and the published `spherical`.
std::vector<RivalPlan> asset_rivals(const StudiedMesh& mesh, const StudyScale& scale);
/// Embree on the whole mesh; and meshes simplified by OpenMesh and by meshoptimizer, queried through Embree
/// and as nifkit's exact objects. Sizes are below 0.9 of the mesh's own.
std::vector<RivalPlan> mesh_rivals(const StudiedMesh& mesh, const StudyScale& scale);
/// Signed distances and voxels, with OpenVDB.
std::vector<RivalPlan> volume_rivals(const StudiedMesh& mesh, const StudyScale& scale);

/// An asset of the scene's one object; `progress` reports its bake.
std::unique_ptr<Rival> make_asset_rival(const mesh::Scene& scene, const bake::BakeOptions& options,
                                        const RivalProgress& progress);

}  // namespace nif::tools
