// --strict turns every kind of note about something in a file that was not read or not kept into a refusal.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <functional>
#include <map>

#include "bake/ground_truth/prepare.hpp"
#include "formats/mesh/read.hpp"
#include "tests/mesh/encode.hpp"
#include "tests/support/test_shapes.hpp"

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

/// A cube in a file that `change` modifies.
mesh::Scene changed(const std::function<void(Gltf&)>& change) {
  Gltf gltf = gltf_of(cube());
  change(gltf);
  return read_with_colors(gltf.glb());
}
json& first_primitive(Gltf& gltf) { return gltf.json["meshes"][0]["primitives"][0]; }

/// A cube whose upper half is moved out of the bind pose by a second joint.
Gltf skinned(float moved) {
  Gltf gltf = gltf_of(cube());
  std::vector<uint8_t> joints;
  std::vector<float> weights, identities;
  for (const mesh::Float3& p : cube().positions) {
    joints.insert(joints.end(), {0, 1, 0, 0});
    weights.insert(weights.end(), {p[2] > 0 ? 0.0f : 1.0f, p[2] > 0 ? 1.0f : 0.0f, 0, 0});
  }
  for (int i = 0; i < 2; ++i)
    identities.insert(identities.end(), {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1});
  const size_t count = cube().positions.size();
  const int places = gltf.accessor(raw(joints), 5121, "VEC4", count),
            shares = gltf.accessor(raw(weights), 5126, "VEC4", count),
            inverses = gltf.accessor(raw(identities), 5126, "MAT4", 2);
  json& attributes = first_primitive(gltf)["attributes"];
  attributes["JOINTS_0"] = places;
  attributes["WEIGHTS_0"] = shares;
  gltf.json["nodes"] = {{{"mesh", 0}, {"skin", 0}}, json::object(), {{"translation", {moved, 0, 0}}}};
  gltf.json["scenes"] = {{{"nodes", {0, 1, 2}}}};
  gltf.json["skins"] = {{{"joints", {1, 2}}, {"inverseBindMatrices", inverses}}};
  return gltf;
}
mesh::Scene read(const Gltf& gltf) { return mesh::read("a.glb", gltf.glb()); }

/// A cube placed by two nodes; `members` are added to the second.
mesh::Scene twice(const json& members) {
  Gltf gltf = gltf_of(cube());
  gltf.json["nodes"] = {{{"mesh", 0}}, {{"mesh", 0}}};
  gltf.json["nodes"][1].update(members);
  gltf.json["scenes"] = {{{"nodes", {0, 1}}}};
  return read(gltf);
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

/// Removes the notes of this kind, where a file causes notes of two kinds.
mesh::Scene without(NoteKind kind, mesh::Scene scene) {
  std::erase_if(scene.notes, [&](const mesh::Note& note) { return note.kind == kind; });
  return scene;
}

/// For each kind of note, a scene that causes it.
std::map<NoteKind, mesh::Scene> examples() {
  std::map<NoteKind, mesh::Scene> all;
  all[NoteKind::short_faces] = mesh::read("a.obj", kTriangle + "f 1 2\n");
  all[NoteKind::curves] = mesh::read("a.obj", kTriangle + "l 1 2\n");
  mesh::ReadLimits dropping;
  dropping.drop_non_finite = true;
  all[NoteKind::non_finite_faces] = mesh::read("a.obj", kTriangle + "v nan 0 0\nf 1 2 4\n", dropping);
  all[NoteKind::rounding] = mesh::read(
      "a.obj",
      "o near\n" + kTriangle +
          "o far\nv 5000000.20000001 0 0\nv 5000000.20000002 0 0\nv 5000000.20000001 1.1e-8 0\nf 4 5 6\n");
  all[NoteKind::crossing_polygons] =
      mesh::read("a.obj", kTriangle + "v 4 0 0\nv 6 2 0\nv 6 0 0\nv 4 2 0\nf 4 5 6 7\n");
  all[NoteKind::bent_polygons] =
      mesh::read("a.obj", "v 0 0 0\nv 2 0 1\nv 3 2 0\nv 1 3 1\nv -1 2 -1\nf 1 2 3 4 5\n");
  all[NoteKind::bytes_after_end] = mesh::read("a.stl", stl_binary(cube()) + std::string(70, 'x'));
  all[NoteKind::counted_by_length] = mesh::read("a.stl", [] {
    std::string bytes = stl_binary(cube());
    bytes[80] = 0;
    return bytes;
  }());
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
  all[NoteKind::draco_morphs] = without(NoteKind::morphs, with_morphs(true));
  Gltf lost_joints = skinned(1);
  lost_joints.json["skins"][0]["joints"] = {99};
  all[NoteKind::posed_skin] = read(lost_joints);
  all[NoteKind::pose] = read(skinned(1));
  all[NoteKind::hidden_mesh] = changed([](Gltf& gltf) {
    gltf.mesh(gltf.positions({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}), -1, "unused");
  });
  Gltf many = skinned(0);
  const int places = many.positions({{0, 0, 0}, {3, 0, 0}});
  many.json["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"] = {
      {"attributes", {{"TRANSLATION", places}}}};
  many.json["extensionsUsed"] = {"EXT_mesh_gpu_instancing"};
  all[NoteKind::gpu_instances] = without(NoteKind::bind_pose, read(many));
  all[NoteKind::flattened] = twice({{"scale", {0, 0, 0}}});
  all[NoteKind::hidden] = twice({{"extensions", {{"KHR_node_visibility", {{"visible", false}}}}}});
  all[NoteKind::helpers] = twice({{"name", "UCX_wall"}});
  all[NoteKind::empty_primitives] = changed([](Gltf& gltf) {
    json more = first_primitive(gltf);
    more["indices"] = gltf.json["accessors"].size();
    gltf.json["accessors"].push_back({{"componentType", 5123}, {"type", "SCALAR"}, {"count", 0}});
    gltf.json["meshes"][0]["primitives"].push_back(more);
  });
  const auto half_clear = [](Gltf& gltf) {
    first_primitive(gltf)["material"] = 0;
    gltf.json["materials"] = {
        {{"alphaMode", "BLEND"}, {"pbrMetallicRoughness", {{"baseColorFactor", {1, 1, 1, 0.4}}}}}};
  };
  all[NoteKind::see_through] = changed(half_clear);
  Gltf pane = gltf_of(cube());
  json wall = first_primitive(pane);
  half_clear(pane);
  pane.json["meshes"][0]["primitives"].push_back(wall);
  all[NoteKind::materials] = mesh::read("a.obj", "mtllib none.mtl\n" + kTriangle, {.alpha = {.read = true}});
  all[NoteKind::clear] = mesh::read("a.glb", pane.glb(), {.alpha = {.read = true}});
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
  all[NoteKind::bind_pose] = read(skinned(0));
  Gltf moved = gltf_of(cube());
  moved.json["animations"] = {
      {{"samplers", {{{"input", 99}, {"output", 99}}}},
       {"channels", {{{"sampler", 0}, {"target", {{"node", 0}, {"path", "scale"}}}}}}}};
  all[NoteKind::clips] = mesh::read("a.glb", moved.glb(), {.clips = true});
  all[NoteKind::morphs] = with_morphs(false);
  return all;
}

/// Meshes that block nothing are left out without a word, because the reader has noted them.
TEST(Strict, AcceptsMeshesThatBlockNothing) {
  mesh::Scene scene = examples().at(NoteKind::clear);
  scene.notes.clear();
  mesh::Mesh pane = scene.meshes[0];
  pane.alpha.assign(pane.triangles.size(), mesh::TriangleAlpha::clear);
  for (uint32_t m = 1; m <= 2; ++m) {
    scene.meshes.push_back(pane);
    scene.instances.push_back({"pane", m});
  }
  const bake::PreparedScene prepared = bake::prepare(scene, true);
  EXPECT_EQ(prepared.objects.size(), 1u);
  EXPECT_EQ(prepared.instances.size(), 1u);
  scene.meshes.erase(scene.meshes.begin());
  scene.instances = {{"pane", 0}, {"pane", 1}};
  EXPECT_THROW(bake::prepare(scene, false), Error) << "nothing is left";
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
