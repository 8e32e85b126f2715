// What the materials of an OBJ let through: "d", "Tr" and "map_d" with its options, polygons, objects, and files that are
// missing or hostile.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "formats/mesh/read.hpp"
#include "tests/support/pictures.hpp"
#include "tests/support/temp_dir.hpp"
#include "tests/support/triangle_alpha.hpp"

namespace nif::test {
namespace {

using mesh::AlphaOptions;
using mesh::NoteKind;
using mesh::Scene;

class ObjAlpha : public testing::Test {
 protected:
  Scene read(const std::string& obj, AlphaOptions alpha = {}) const {
    alpha.read = true;
    mesh::ReadLimits limits;
    limits.alpha = alpha;
    return mesh::read(folder_.write("a.obj", obj), limits);
  }
  /// What becomes of the triangles of a file with one object and this library.
  Alphas alphas(const std::string& obj, const std::string& mtl, const AlphaOptions& options = {}) const {
    folder_.write("a.mtl", mtl);
    return read(obj, options).meshes.at(0).alpha;
  }
  /// A row of texels with these values of alpha.
  void write_row(const std::string& name, const std::vector<uint8_t>& values) const {
    std::vector<std::array<uint8_t, 4>> pixels;
    for (const uint8_t value : values) pixels.push_back({9, 9, 9, value});
    folder_.write(name, png(uint32_t(values.size()), 1, pixels));
  }

  const TempDir folder_;
};

/// Two triangles: of the material "m", and of none.
const std::string kTwo =
    "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nusemtl m\nf 1 2 3\nusemtl other\nf 2 4 3\n";

TEST_F(ObjAlpha, OpacityOfMaterials) {
  EXPECT_EQ(alphas(kTwo, "newmtl m\nd 0.4\n"), (Alphas{kClear, kSolid}));
  EXPECT_EQ(alphas(kTwo, "newmtl m\r\n\td 0.5\r\n"), Alphas());
  EXPECT_EQ(alphas(kTwo, "newmtl m\nTr 0.6\n"), (Alphas{kClear, kSolid}));
  EXPECT_EQ(alphas(kTwo, "newmtl m\nTr 0.4\n"), Alphas());
  EXPECT_EQ(alphas(kTwo, "newmtl m\nd -halo 0\n"), (Alphas{kClear, kSolid}));
  EXPECT_EQ(alphas(kTwo, "newmtl x\nd 0\nnewmtl m\nKd 1 1 1\nnewmtl other\nd 0.2"), (Alphas{kSolid, kClear}));
  EXPECT_EQ(alphas(kTwo, "newmtl m\nd 1\nTr 1\n"), Alphas()) << "d counts";
  EXPECT_EQ(alphas(kTwo, "newmtl m\nTr 1\nd 1\n"), Alphas());
  EXPECT_EQ(alphas(kTwo, "newmtl m\nd 1\nnewmtl m\nd 0\n"), Alphas()) << "the first of two";
  EXPECT_EQ(alphas(kTwo, "newmtl m\nd nan\nd\nd x\n"), Alphas());
  EXPECT_EQ(alphas(kTwo, "d 0\nmap_d x.png\n"), Alphas()) << "of no material";
  EXPECT_EQ(alphas(kTwo, "newmtl m\nd 0.4\n", {.cutoff = 0.3}), Alphas());
  EXPECT_EQ(alphas(kTwo, "newmtl m\nd 0.4\n", {.blend = AlphaOptions::Blend::opaque}), Alphas());
  EXPECT_EQ(alphas(kTwo, "newmtl m\nd 0.9\n", {.blend = AlphaOptions::Blend::ignore}),
            (Alphas{kClear, kSolid}));
  folder_.write("a.mtl", "newmtl m\nd 0\n");
  EXPECT_EQ(mesh::read(folder_.write("a.obj", kTwo)).meshes[0].alpha, Alphas()) << "alpha is not read";
}

/// Four quads: quad k is over texel k of a row of four.
std::string quads(const std::string& head) {
  std::string obj = head;
  for (int k = 0; k < 4; ++k) {
    const double left = 0.25 * k + 0.05, right = left + 0.15;
    obj += fmt::format("v {0} 0 0\nv {1} 0 0\nv {1} 1 0\nv {0} 1 0\n", k, k + 1);
    obj += fmt::format("vt {0} 0.1\nvt {1} 0.1\nvt {1} 0.9\nvt {0} 0.9\n", left, right);
    obj += "f -4/-4 -3/-3 -2/-2 -1/-1\n";
  }
  return obj;
}

TEST_F(ObjAlpha, PicturesOfMaterials) {
  write_row("row.png", {255, 0, 255, 255});
  write_row("a row.png", {255, 0, 255, 255});
  folder_.write("grey.png", png(4, 1,
                                std::vector<std::array<uint8_t, 3>>{
                                    {255, 255, 255}, {0, 0, 0}, {200, 100, 90}, {128, 128, 128}}));
  const std::string obj = quads("mtllib a.mtl\nusemtl m\n");
  const auto at = [&](const std::string& map) { return alphas(obj, "newmtl m\nmap_d " + map + "\n"); };
  const Alphas second{kSolid, kSolid, kClear, kClear, kSolid, kSolid, kSolid, kSolid};
  EXPECT_EQ(at("row.png"), second);
  EXPECT_EQ(at("a row.png  "), second) << "a name with a space";
  EXPECT_EQ(at("grey.png"), second) << "130 is the mean of the third";
  EXPECT_EQ(at(".\\row.png"), second);
  EXPECT_EQ(at("-bm 1 -blendu on -mm 0 1 -imfchan m row.png"), second);
  for (const char* unknown : {"-mm 1 -1 row.png", "-t 0.1 0.1 0.1 row.png", "-imfchan r row.png"})
    EXPECT_EQ(at(unknown), Alphas()) << unknown << ": counts as opaque, with a note";
  const Alphas third{kSolid, kSolid, kSolid, kSolid, kClear, kClear, kSolid, kSolid};
  EXPECT_EQ(at("-o -0.25 0 0 row.png"), third);
  EXPECT_EQ(at("-o -0.25 row.png"), third);
  EXPECT_EQ(at("-o 0.75 -clamp on row.png"), Alphas());
  EXPECT_EQ(at("-o 0.75 -clamp off row.png"), third);
  EXPECT_EQ(at("-s 0.25 1 1 -o 0.25 row.png"), (Alphas(8, kClear)));
  write_row("row.png", {0, 255});
  EXPECT_EQ(alphas(obj, "newmtl m\nmap_d row.png\nd 0.4\n"), Alphas(8, kClear)) << "0.4 times 1";
  EXPECT_EQ(at("row.png"), (Alphas{kClear, kClear, kClear, kClear, kSolid, kSolid, kSolid, kSolid}));
  write_row("row.png", {0, 255, 255, 0, 0, 255, 255, 0, 255, 0, 0, 255, 255, 0, 0, 255});
  EXPECT_EQ(at("row.png"), Alphas(8, kCut));
}

TEST_F(ObjAlpha, FromTheLowerLeftCorner) {
  folder_.write("column.png", png(1, 2, std::vector<std::array<uint8_t, 4>>{{9, 9, 9, 0}, {9, 9, 9, 255}}));
  const std::string obj =
      "mtllib a.mtl\nusemtl m\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0.1 0.6\nvt 0.9 0.6\nvt 0.1 0.9\n"
      "vt 0.1 0.1\nvt 0.9 0.1\nvt 0.1 0.4\nf 1/1 2/2 3/3\nf 1/4 3/6 2/5\n";
  EXPECT_EQ(alphas(obj, "newmtl m\nmap_d column.png\n"), (Alphas{kClear, kSolid}));
}

/// Concave polygons are cut anew once all positions are known, and corners keep their places.
TEST_F(ObjAlpha, PolygonsAndObjects) {
  write_row("row.png", {255, 0});
  const std::string obj =
      "mtllib a.mtl\no wall\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
      "o leaf\nusemtl m\nv 0 0 5\nv 4 0 5\nv 4 4 5\nv 2 1 5\nv 0 4 5\n"
      "vt 0.6 0\nvt 0.9 0\nvt 0.9 1\nvt 0.7 0.2\nvt 0.6 1\n"
      "f 4/1 5/2 6/3 7/4 8/5\nf -5/-5 -4/-4 -1/-1\n";
  folder_.write("a.mtl", "newmtl m\nmap_d row.png\n");
  const Scene scene = read(obj);
  ASSERT_EQ(scene.meshes.size(), 2u);
  EXPECT_EQ(scene.meshes[0].alpha, Alphas{kSolid});
  EXPECT_EQ(scene.meshes[1].alpha, Alphas(4, kClear));
  ASSERT_EQ(scene.see_through.size(), 1u);
  EXPECT_EQ(scene.see_through[0].name, "m");
  EXPECT_EQ(scene.see_through[0].clear, 4u);
  EXPECT_EQ(scene.files.size(), 3u) << "the mesh, its materials and its picture";
  // Without places, or with some that do not exist, the picture does not count.
  EXPECT_EQ(
      alphas("mtllib a.mtl\nusemtl m\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0.8 0.5\nf 1/1 2/1 3/1\nf 1/1 2/9 3/1\n"
             "f 1 2 3\nf 1/1 2/-7 3/1\n",
             "newmtl m\nmap_d row.png\n"),
      (Alphas{kClear, kSolid, kSolid, kSolid}));
  const Scene bare = read("mtllib a.mtl\nusemtl m\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  ASSERT_EQ(bare.notes.size(), 1u);
  EXPECT_EQ(bare.notes[0].kind, NoteKind::pictures);
  EXPECT_NE(bare.notes[0].text.find("'m' has no texture coordinates on some triangles"), std::string::npos)
      << bare.notes[0].text;
  // A vertex that is used twice, with two places: either may count.
  const Alphas twice = alphas(
      "mtllib a.mtl\nusemtl m\nv 0 0 0\nv 1 0 0\nv 1 .5 0\nv .5 1 0\nv 0 1 0\nvt .8 .5\nvt .2 .5\n"
      "f 1/1 2/1 3/1 1/2 4/1 5/1\n",
      "newmtl m\nmap_d row.png\n");
  EXPECT_EQ(std::ranges::count(twice, kSolid), 0);
  EXPECT_GT(std::ranges::count(twice, kCut), 0);
}

/// Holes follow the triangles of concave polygons and of objects; where it is not known what is shown, they are filled.
TEST_F(ObjAlpha, Holes) {
  write_row("row.png", {255, 0});
  folder_.write("a.mtl", "newmtl m\nmap_d row.png\nnewmtl n\nmap_d -clamp on row.png\n");
  const Scene scene = read(
      "mtllib a.mtl\no one\nusemtl m\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nvt .25 .5\nf 1/1 "
      "2/2 3/3\n"
      "o two\nusemtl n\nf 1/2 2/1 3/3\nusemtl m\nf 3/3 1/1 2/2\nf 1/4 2/4 3/4\n");
  ASSERT_EQ(scene.meshes.size(), 2u);
  const mesh::Mesh &one = scene.meshes[0], &two = scene.meshes[1];
  EXPECT_TRUE(scene.notes.empty());
  EXPECT_EQ(scene.see_through[0].cut, 2u);
  EXPECT_EQ(scene.see_through[1].cut, 1u);
  ASSERT_EQ(one.alpha_maps.size(), 1u);
  EXPECT_EQ(*one.alpha_maps[0], (mesh::AlphaMap{2, 1, {mesh::Wrap::repeat, mesh::Wrap::repeat}, {0b01}}));
  EXPECT_EQ(one.holes[0].places,
            (std::array<std::array<int32_t, 2>, 3>{{{0, 1 << 16}, {2 << 16, 1 << 16}, {0, 0}}}));
  ASSERT_EQ(two.alpha_maps.size(), 2u);
  EXPECT_EQ(two.alpha_maps[1], one.alpha_maps[0]);
  EXPECT_EQ(two.alpha_maps[0]->wrap[0], mesh::Wrap::clamp);
  ASSERT_EQ(two.holes.size(), 3u);
  EXPECT_EQ(two.holes[0].map, 0u);
  EXPECT_EQ(two.holes[1].map, 1u);
  EXPECT_EQ(two.holes[1].places[0], one.holes[0].places[2]);
  EXPECT_FALSE(two.holes[2].any());

  const Scene twice = read(
      "mtllib a.mtl\nusemtl m\nv 0 0 0\nv 1 0 0\nv 1 .5 0\nv .5 1 0\nv 0 1 0\nvt .8 .5\nvt .2 .5\n"
      "f 1/1 2/1 3/1 1/2 4/1 5/1\n");
  EXPECT_TRUE(twice.meshes[0].holes.empty());
  EXPECT_EQ(twice.see_through[0].filled, uint64_t(std::ranges::count(twice.meshes[0].alpha, kCut)));
  ASSERT_FALSE(twice.notes.empty());
  EXPECT_EQ(twice.notes[0].kind, NoteKind::see_through);
  EXPECT_NE(twice.notes[0].text.find("(polygons have several texture coordinates at one vertex)"),
            std::string::npos);
}

TEST_F(ObjAlpha, FilesThatCannotBeReadCostOnlyAlpha) {
  const auto note_of = [](const Scene& scene) {
    return scene.notes.empty() ? mesh::Note{} : scene.notes.back();
  };
  const Scene missing = read(kTwo);
  EXPECT_EQ(note_of(missing).kind, NoteKind::materials);
  EXPECT_NE(note_of(missing).text.find("'a.mtl'"), std::string::npos);
  EXPECT_FALSE(mesh::is_loss(NoteKind::materials));
  folder_.write("a.mtl", "newmtl m\nmap_d gone.png\nnewmtl other\nmap_d a.mtl\n");
  const Scene no_picture = read(kTwo);
  EXPECT_EQ(no_picture.meshes[0].alpha, Alphas());
  ASSERT_EQ(no_picture.notes.size(), 2u);
  EXPECT_NE(no_picture.notes[0].text.find("'m' is at 'gone.png', which is missing"), std::string::npos);
  EXPECT_NE(no_picture.notes[1].text.find("'other' is neither PNG nor JPEG"), std::string::npos);
  folder_.write("b.mtl", "newmtl m\nd 0\n");
  EXPECT_EQ(read("mtllib none.mtl b.mtl\n" + kTwo.substr(13)).meshes[0].alpha, (Alphas{kClear, kSolid}))
      << "several names";
  folder_.write("two words.mtl", "newmtl m\nd 0\n");
  EXPECT_EQ(read("mtllib two words.mtl\n" + kTwo.substr(13)).meshes[0].alpha, (Alphas{kClear, kSolid}));
  EXPECT_EQ(read(kTwo.substr(13) + "mtllib b.mtl\n").meshes[0].alpha, (Alphas{kClear, kSolid}))
      << "at the end";
  EXPECT_EQ(read(" \tmtllib b.mtl\n#mtllib none\n" + kTwo.substr(13)).meshes[0].alpha,
            (Alphas{kClear, kSolid}));
  const Scene latin = read("mtllib \xE9.mtl\n" + kTwo.substr(13));
  EXPECT_EQ(note_of(latin).kind, NoteKind::materials) << "JSON cannot hold this name";
  std::string repeated;
  for (int i = 0; i < 200; ++i) repeated += "mtllib gone.mtl\n";
  EXPECT_EQ(read(repeated + "mtllib b.mtl\n" + kTwo.substr(13)).meshes[0].alpha, (Alphas{kClear, kSolid}));
  folder_.write("b.mtl", "\xEF\xBB\xBFnewmtl m\nd 0\n");
  EXPECT_EQ(read("mtllib b.mtl\n" + kTwo.substr(13)).meshes[0].alpha, (Alphas{kClear, kSolid}))
      << "a mark at the start";
  // Neither a device nor a folder is read, and not every name of a long line is tried.
  EXPECT_EQ(note_of(read("mtllib /dev/zero\n" + kTwo.substr(13))).kind, NoteKind::materials);
  std::string names = "mtllib";
  for (int i = 0; i < 100'000; ++i) names += fmt::format(" x{}", i);
  EXPECT_EQ(note_of(read(names + " b.mtl\n" + kTwo.substr(13))).kind, NoteKind::materials);
}

}  // namespace
}  // namespace nif::test
