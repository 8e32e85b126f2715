// Uses OpenMesh's decimater with error quadrics, a check that no triangle flips, and, if an error is given, a
// bound on the distance. Vertices at the boundary are locked beforehand.
#include "mesh/halfedge/decimate.hpp"

#include <OpenMesh/Tools/Decimater/DecimaterT.hh>
#include <OpenMesh/Tools/Decimater/ModHausdorffT.hh>
#include <OpenMesh/Tools/Decimater/ModNormalFlippingT.hh>
#include <OpenMesh/Tools/Decimater/ModQuadricT.hh>

#include "mesh/halfedge/half_edges.hpp"

namespace nif::halfedge {
namespace {

namespace decimater = OpenMesh::Decimater;

class Watch : public decimater::Observer {
 public:
  Watch(double collapses, const std::function<void(double)>& progress, const std::atomic<bool>& cancel)
      : Observer(1000), collapses_(collapses), progress_(progress), cancel_(cancel) {}
  void notify(size_t step) override { progress_(std::min(1.0, double(step) / collapses_)); }
  bool abort() const override { return cancel_; }

 private:
  double collapses_;
  const std::function<void(double)>& progress_;
  const std::atomic<bool>& cancel_;
};

}  // namespace

mesh::Mesh decimate(const mesh::Mesh& mesh, const DecimateOptions& options,
                    const std::function<void(double)>& progress, const std::atomic<bool>& cancel) {
  TriMesh half_edges = to_half_edges<TriMesh>(mesh);
  half_edges.request_vertex_status();
  half_edges.request_edge_status();
  half_edges.request_halfedge_status();
  half_edges.request_face_status();
  half_edges.request_face_normals();
  half_edges.update_face_normals();
  if (!options.move_boundary)
    for (const auto v : half_edges.vertices())
      if (half_edges.is_boundary(v)) half_edges.status(v).set_locked(true);
  {
    decimater::DecimaterT<TriMesh> work(half_edges);
    decimater::ModQuadricT<TriMesh>::Handle quadric;
    work.add(quadric);
    work.module(quadric).unset_max_err();
    decimater::ModNormalFlippingT<TriMesh>::Handle flipping;
    work.add(flipping);
    decimater::ModHausdorffT<TriMesh>::Handle distance;
    if (options.max_error) {
      work.add(distance);
      work.module(distance).set_tolerance(float(*options.max_error));
    }
    const double collapses =
        double(half_edges.n_faces() - std::min(half_edges.n_faces(), options.triangles)) / 2;
    Watch watch(std::max(1.0, collapses), progress, cancel);
    work.set_observer(&watch);
    if (!work.initialize())
      throw Error(Status::internal, "OpenMesh cannot decimate mesh '" + mesh.name + "'");
    work.decimate_to_faces(0, options.triangles);
  }
  if (cancel) throw Error(Status::interrupted, "the decimation was cancelled");
  half_edges.garbage_collection();
  return to_mesh(half_edges, mesh.name);
}

}  // namespace nif::halfedge
