// A study, not a test: the work of an object's rays in the fast kernels, as the baker counts it to compare
// encodings (bake/work.hpp). docs/results/work.sh compares it with measured times.
//
//   ray_counts ASSET MESH RAYS
//
// ASSET has one object, `segment`, `exact` or `bvh`, baked from MESH. Prints a tab-separated line for each ray
// set of nif bench: the set, the first and the second count per ray (cells and rays that query the network, cells
// and nodes, or nodes and 0), and the nanoseconds that the baker estimates from them. The rays are those of nif
// bench.
#include <fmt/format.h>

#include <cstdlib>

#include "bake/bake_encodings.hpp"
#include "bake/ground_truth/prepare.hpp"
#include "formats/base/status.hpp"
#include "formats/mesh/read.hpp"
#include "formats/nif/file_memory.hpp"
#include "formats/nif/reader.hpp"

namespace {

using namespace nif;

void print(bake::RaySet set, size_t rays, uint64_t first, uint64_t second, double nanoseconds) {
  const auto each = [&](double sum) { return sum / double(rays); };
  fmt::print("{}\t{}\t{}\t{}\n", bake::name_of(set), each(double(first)), each(double(second)),
             each(nanoseconds));
}

void run(const std::string& path, const std::string& mesh, uint64_t count) {
  const format::FileMemory memory = format::FileMemory::load(path, format::FileMemory::Mode::read);
  const format::AssetView view = format::read_asset(memory.bytes(), path);
  const mesh::Scene scene = mesh::read(mesh);
  const bake::PreparedScene prepared = bake::prepare(scene);
  if (view.objects.size() != 1 || prepared.objects.size() != 1)
    throw Error(Status::usage, path + ": needs exactly one object");
  const bake::GroundTruth truth(prepared.objects.front());
  for (const bake::RaySet set : bake::kRaySets) {
    const auto rays = bake::draw_ray_set(truth.source(), set, count, 2).segments;
    if (rays.empty()) continue;
    const format::ObjectView& object = view.objects.front();
    if (object.is<kernels::SegmentField>()) {
      const bake::SegmentCounts counts = bake::count_work(object.as<kernels::SegmentField>(), rays);
      print(set, rays.size(), counts.cubes, counts.open, counts.nanoseconds());
    } else if (object.is<kernels::ExactField>()) {
      const bake::ExactCounts counts = bake::count_work(object.as<kernels::ExactField>(), rays);
      print(set, rays.size(), counts.traversal.cubes, counts.triangles.nodes, counts.nanoseconds());
    } else {
      const bake::BvhCounts counts = bake::count_work(object.as<kernels::TrianglesField>(), rays);
      print(set, rays.size(), counts.nodes, 0, counts.nanoseconds());
    }
  }
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4) {
    fmt::print(stderr, "usage: ray_counts ASSET MESH RAYS\n");
    return int(Status::usage);
  }
  try {
    run(argv[1], argv[2], std::strtoull(argv[3], nullptr, 10));
  } catch (const Error& error) {
    fmt::print(stderr, "{}\n", error.what());
    return int(error.status());
  }
}
