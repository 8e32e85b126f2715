// --strict refuses every kind of note that says that something of a file was not read or not kept.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <functional>
#include <map>

#include "bake/oracle/prepare.hpp"
#include "formats/mesh/read.hpp"
#include "tests/mesh/encode.hpp"
#include "tests/support/shapes.hpp"

namespace nif::test {
namespace {

using mesh::NoteKind;
using nlohmann::json;

const std::string kTriangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";

mesh::Scene read_with_colors(const std::string& glb) {
  mesh::ReadLimits limits;
  limits.colors = true;
  return mesh::read("a.glb", glb, limits);
}

/// A cube in a file to which `change` does something.
mesh::Scene changed(const std::function<void(Gltf&)>& change) {
  Gltf gltf = gltf_of(cube());
  change(gltf);
  return read_with_colors(gltf.glb());
}
json& first_primitive(Gltf& gltf) { return gltf.json["meshes"][0]["primitives"][0]; }

/// A triangle under two joints, the second of them moved out of the bind pose by so much.
mesh::Scene skinned(float moved) {
  Gltf gltf;
  const int shape = gltf.mesh(gltf.positions({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}), gltf.indices({0, 1, 2}));
  std::vector<float> identities;
  for (int i = 0; i < 2; ++i)
    identities.insert(identities.end(), {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1});
  gltf.json["skins"] = {
      {{"joints", {1, 2}}, {"inverseBindMatrices", gltf.accessor(raw(identities), 5126, "MAT4", 2)}}};
  gltf.scene({gltf.node({{"mesh", shape}, {"skin", 0}}), gltf.node(json::object()),
              gltf.node({{"translation", {moved, 0, 0}}})});
  return mesh::read("a.glb", gltf.glb());
}

mesh::Scene with_morphs(bool draco_data) {
  return changed([&](Gltf& gltf) {
    const size_t count = cube().positions.size();
    json& primitive = first_primitive(gltf);
    primitive["targets"] = {{{"POSITION", gltf.positions(std::vector<mesh::Float3>(count))}}};
    if (!draco_data) return;
    gltf.json["meshes"][0]["weights"] = {1};
    gltf.json["extensionsUsed"] = {"KHR_draco_mesh_compression"};
    const int view = gltf.view(draco(cube()));
    first_primitive(gltf)["extensions"]["KHR_draco_mesh_compression"] = {{"bufferView", view},
                                                                         {"attributes", {{"POSITION", 0}}}};
  });
}

/// A scene that each kind of note is from.
std::map<NoteKind, mesh::Scene> examples() {
  std::map<NoteKind, mesh::Scene> all;
  all[NoteKind::short_faces] = mesh::read("a.obj", kTriangle + "f 1 2\n");
  all[NoteKind::curves] = mesh::read("a.obj", kTriangle + "l 1 2\n");
  all[NoteKind::bytes_after_end] = mesh::read("a.stl", stl_binary(cube()) + stl_binary(cube()));
  all[NoteKind::points_and_lines] = changed([](Gltf& gltf) {
    json points = first_primitive(gltf);
    points["mode"] = 0;
    gltf.json["meshes"][0]["primitives"].push_back(points);
  });
  all[NoteKind::loose_indices] = changed([](Gltf& gltf) {
    json more = first_primitive(gltf);
    more["indices"] = gltf.indices({0, 1, 2, 3});
    gltf.json["meshes"][0]["primitives"].push_back(more);
  });
  all[NoteKind::colors] = changed([](Gltf& gltf) {
    const int colors = gltf.positions({{1, 0, 0}});
    first_primitive(gltf)["attributes"]["COLOR_0"] = colors;
  });
  all[NoteKind::draco_morphs] = with_morphs(true);
  all[NoteKind::posed_skin] = skinned(1);
  all[NoteKind::hidden_mesh] = changed([](Gltf& gltf) {
    gltf.mesh(gltf.positions({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}), -1, "unused");
  });
  all[NoteKind::gpu_instances] =
      changed([](Gltf& gltf) { gltf.json["extensionsUsed"] = {"EXT_mesh_gpu_instancing"}; });
  all[NoteKind::pictures] = changed([](Gltf& gltf) {
    const int places =
        gltf.accessor(std::string(8 * cube().positions.size(), '\0'), 5126, "VEC2", cube().positions.size());
    first_primitive(gltf)["attributes"]["TEXCOORD_0"] = places;
    first_primitive(gltf)["material"] = 0;
    gltf.json["images"] = {{{"uri", "missing.png"}}};
    gltf.json["textures"] = {{{"source", 0}}};
    gltf.json["materials"] = {{{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}}}}};
  });
  all[NoteKind::fixtures] = changed([](Gltf& gltf) {
    gltf.camera({{"type", "orthographic"}, {"orthographic", json::object()}});
  });
  // OpenVDB's reader runs in another process, and a bake does not accept volumes.
  all[NoteKind::volumes] = mesh::read("a.obj", kTriangle);
  all[NoteKind::volumes].notes.push_back({NoteKind::volumes, "a.vdb: a grid was left out"});
  all[NoteKind::bind_pose] = skinned(0);
  all[NoteKind::morphs] = with_morphs(false);
  return all;
}

TEST(Strict, RefusesEveryKindOfLoss) {
  const std::map<NoteKind, mesh::Scene> all = examples();
  for (size_t number = 0; number < mesh::kNoteKinds; ++number) {
    const auto kind = NoteKind(number);
    SCOPED_TRACE(fmt::format("kind {}", number));
    ASSERT_TRUE(all.contains(kind)) << "a kind of note without an example here";
    const mesh::Scene& scene = all.at(kind);
    ASSERT_EQ(scene.notes.size(), 1u) << fmt::format("{}", fmt::join(mesh::texts_of(scene.notes), "\n"));
    EXPECT_EQ(scene.notes[0].kind, kind) << scene.notes[0].text;
    EXPECT_NO_THROW(bake::prepare(scene, false));
    try {
      bake::prepare(scene, true);
      EXPECT_FALSE(is_loss(kind)) << "is not refused: " << scene.notes[0].text;
    } catch (const Error& error) {
      EXPECT_TRUE(is_loss(kind)) << error.what();
      EXPECT_EQ(error.status(), Status::needs_repair);
      EXPECT_EQ(error.what(), scene.notes[0].text);
    }
  }
}

}  // namespace
}  // namespace nif::test
