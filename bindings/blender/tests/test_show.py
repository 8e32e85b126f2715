"""Showing what an asset answers: the answers are Blender's own where the asset is exact, colours say so, and what is wrong or
missing is said."""
import os
import sys
from types import SimpleNamespace
from unittest import mock

import bpy
import numpy as np
from support import AddonTest, select, torus

from nifkit_blender import asset as asset_module
from nifkit_blender import geometry, paint, sampling, show_operators
from nifkit_blender.long_operator import Failure

PAGE = os.sysconf("SC_PAGE_SIZE") if hasattr(os, "sysconf") else 4096


def colors(thing: bpy.types.Object, name: str) -> np.ndarray:
    attribute = thing.data.color_attributes[name]
    values = np.empty((len(thing.data.vertices), 4), np.float32)
    attribute.data.foreach_get("color", values.ravel())
    return values[:, :3]


class Show(AddonTest):
    def baked(self, thing: bpy.types.Object, **arguments) -> bpy.types.Object:
        select(thing)
        self.bake(encoding="exact", **arguments)
        return thing

    def test_an_exact_asset_has_no_errors(self) -> None:
        thing = self.baked(torus(major_segments=24, minor_segments=12))
        self.assertEqual(bpy.ops.nifkit.show_errors(rays=64), {"FINISHED"})
        grey = paint.color_of_share(np.zeros(1))[0]
        wrong = (np.abs(colors(thing, paint.ERRORS) - grey) > 1e-6).any(axis=1)
        # Rays that touch an edge may differ: Blender's own are in single precision.
        self.assertLess(wrong.mean(), 0.02)
        self.assertEqual(thing.data.color_attributes.active_color.name, paint.ERRORS)

    def test_another_asset_has_errors(self) -> None:
        """The heat map shows it: the asset has a hole that the mesh has not."""
        thing = torus(major_segments=24, minor_segments=12)
        whole = thing.data
        faces = [tuple(face.vertices) for face in whole.polygons if face.center.x < 0.5 or face.center.z < 0]
        holed = bpy.data.meshes.new("holed")
        holed.from_pydata([vertex.co for vertex in whole.vertices], [], faces)
        thing.data = holed
        self.baked(thing)
        thing.data = whole
        self.assertEqual(bpy.ops.nifkit.show_errors(rays=64), {"FINISHED"})
        grey = paint.color_of_share(np.zeros(1))[0]
        wrong = (np.abs(colors(thing, paint.ERRORS) - grey) > 1e-6).any(axis=1)
        self.assertGreater(wrong.mean(), 0.1)

    def test_what_the_asset_sees(self) -> None:
        """Inside the hole of a torus it is darker than outside, and Blender's own rays say the same."""
        thing = self.baked(torus(major_segments=48, minor_segments=12))
        before = set(bpy.data.objects)
        self.assertEqual(bpy.ops.nifkit.show_asset(rays=128), {"FINISHED"})
        by_asset, by_blender = colors(thing, paint.ASSET)[:, 0], colors(thing, paint.BLENDER)[:, 0]
        self.assertLess(np.abs(by_asset - by_blender).max(), 0.05)
        radius = np.array([vertex.co.xy.length for vertex in thing.data.vertices])
        self.assertGreater(by_asset[radius > 1.2].min(), 0.95)
        self.assertLess(by_asset[radius < 0.8].max(), 0.9)
        # The copy beside has the colours by Blender.
        (copy,) = set(bpy.data.objects) - before
        self.assertEqual(copy.data.color_attributes.active_color.name, paint.BLENDER)
        self.assertGreater(copy.location.x, thing.dimensions.x)

    def test_placed_scaled_and_mirrored(self) -> None:
        thing = torus(major_segments=24, minor_segments=12)
        thing.location, thing.rotation_euler, thing.scale = (3, -2, 1), (0.3, 0.5, 0.7), (-1, 2, 0.5)
        bpy.context.view_layer.update()
        self.baked(thing)
        bpy.ops.nifkit.show_asset(rays=64, beside=False)
        self.assertLess(np.abs(colors(thing, paint.ASSET) - colors(thing, paint.BLENDER)).max(), 0.05)
        self.assertGreater(colors(thing, paint.ASSET).max(), 0.95)

    def test_modifiers(self) -> None:
        """Their vertices are shown on an object of its own."""
        thing = torus(major_segments=12, minor_segments=6)
        thing.modifiers.new("finer", "SUBSURF").levels = 1
        self.baked(thing)
        before = set(bpy.data.objects)
        bpy.ops.nifkit.show_errors(rays=4)
        (shown,) = set(bpy.data.objects) - before
        self.assertEqual(len(colors(shown, paint.ERRORS)), 4 * len(thing.data.vertices))
        self.assertTrue(thing.hide_get())

    def test_modifiers_and_no_colours(self) -> None:
        """All is as before if it goes wrong while colours are given."""
        thing = torus(major_segments=12, minor_segments=6)
        thing.modifiers.new("finer", "SUBSURF").levels = 1
        self.baked(thing)
        before = set(bpy.data.objects), set(bpy.data.meshes)
        with mock.patch.object(show_operators, "paint", side_effect=MemoryError("no memory")):
            for operator in (bpy.ops.nifkit.show_errors, bpy.ops.nifkit.show_asset):
                self.assertRaisesRegex(RuntimeError, "no memory", operator, rays=4)
        self.assertEqual((set(bpy.data.objects), set(bpy.data.meshes)), before)
        self.assertFalse(thing.hide_get())

    def test_what_the_user_does_meanwhile(self) -> None:
        """In a window, events pass through: the object that is coloured may go away, or become another one."""

        def edit(thing: bpy.types.Object) -> None:
            bpy.ops.object.mode_set(mode="EDIT")

        def remove(thing: bpy.types.Object) -> None:
            bpy.data.objects.remove(thing)

        def change(thing: bpy.types.Object) -> None:
            thing.modifiers.new("finer", "SUBSURF").levels = 1

        def replace(thing: bpy.types.Object) -> None:
            """As an undo step may do it."""
            name, copy = thing.name, thing.copy()
            bpy.data.objects.remove(thing)
            bpy.context.collection.objects.link(copy)
            copy.name = name

        for action, said in (
            (edit, "cannot be coloured in this mode"),
            (remove, "is not there any more"),
            (change, "has other vertices than before"),
            (replace, ""),
        ):
            with self.subTest(action.__name__):
                bpy.ops.wm.read_homefile(use_empty=True)
                thing = self.baked(torus(major_segments=12, minor_segments=6))
                shown = []
                operator = SimpleNamespace(
                    rays=4, distance=0, report=lambda kind, text: None, show=lambda context, thing, shares: shown.append(thing.name)
                )
                steps = show_operators.Measured.work(operator, bpy.context)
                next(steps)
                next(steps)
                action(thing)
                bpy.context.view_layer.update()
                if said:
                    self.assertRaisesRegex(Failure, said, list, steps)
                    self.assertEqual(shown, [])
                    if bpy.context.mode != "OBJECT":
                        bpy.ops.object.mode_set(mode="OBJECT")
                else:
                    list(steps)
                    self.assertEqual(shown, ["Torus"])

    def test_answers_equal_blenders_over_instances(self) -> None:
        """5,000 rays through a scene of three placements."""
        first = torus()
        things = [first]
        for number in (1, 2):
            copy = first.copy()
            copy.location, copy.scale = (3 * number, number, 0), (1, -number, 1)
            bpy.context.collection.objects.link(copy)
            things.append(copy)
        bpy.context.view_layer.update()
        select(*things)
        self.bake(encoding="exact")
        found = geometry.collect(bpy.context.evaluated_depsgraph_get(), bpy.context.selected_objects)
        self.assertEqual((len(found.parts), len(found.placements)), (1, 3))
        random = np.random.default_rng(1)
        origins = random.uniform(-4, 9, (5000, 3)).astype(np.float32)
        ends = random.uniform(-2, 7, (5000, 3)) * (1, 0.4, 0.2)
        directions = ends - origins
        directions = (directions / np.linalg.norm(directions, axis=1, keepdims=True)).astype(np.float32)
        with asset_module.Asset(self.output) as asset:
            answers = asset.visible(origins, directions, 1e30)
        own = sampling.visible(sampling.triangles_of(found), origins, directions, 1e30)
        self.assertLessEqual((answers != own).sum(), 2)
        self.assertTrue(0.1 < own.mean() < 0.9)

    def test_same_colours_again(self) -> None:
        thing = self.baked(torus(major_segments=24, minor_segments=12))
        bpy.ops.nifkit.show_errors(rays=16)
        first = colors(thing, paint.ERRORS)
        bpy.ops.nifkit.show_errors(rays=16)
        self.assertTrue((colors(thing, paint.ERRORS) == first).all())


class Version(AddonTest):
    def test_is_that_of_nifkit(self) -> None:
        version = sys.modules["nifkit_blender"].bl_info["version"]
        self.assertEqual(".".join(map(str, version)), asset_module.package().__version__)


class Update(AddonTest):
    def test_installed_again_while_it_is_used(self) -> None:
        """That writes into the library's file."""
        thing = torus(major_segments=12, minor_segments=6)
        select(thing)
        self.bake()
        bpy.ops.nifkit.show_errors(rays=4)
        bpy.ops.preferences.addon_install(filepath=sys.argv[sys.argv.index("--") + 1])
        bpy.ops.preferences.addon_enable(module="nifkit_blender")
        bpy.context.scene.nifkit.asset = self.output
        self.assertEqual(bpy.ops.nifkit.show_errors(rays=4), {"FINISHED"})


class Directions(AddonTest):
    def test_cosine(self) -> None:
        """Of length 1, above the surface, and with the mean height of a cosine, 2/3, about any normal."""
        normals = np.array([(0, 0, 1), (0, 0, -1), (1, 0, 0), (0.6, -0.8, 0), (0, -0.6, -0.8)])
        directions = sampling.hemispheres(normals, 1000, 0)
        height = np.einsum("nkc,nc->nk", directions, normals)
        self.assertTrue(np.allclose(np.linalg.norm(directions, axis=2), 1))
        self.assertGreater(height.min(), 0)
        self.assertTrue(np.allclose(height.mean(axis=1), 2 / 3, atol=0.001))
        sideways = np.linalg.norm(directions.mean(axis=1) - normals * height.mean(axis=1)[:, None], axis=1)
        self.assertLess(sideways.max(), 0.01)


class Refused(AddonTest):
    def test_without_numpy(self) -> None:
        """Baking works, showing says what is missing."""
        select(torus(major_segments=8, minor_segments=4))
        gone = [name for name in sys.modules if name.split(".")[0] == "numpy" or name.startswith("nifkit_blender.nifkit")]
        hidden = {name: None for name in gone if name.startswith("numpy")}
        with mock.patch.dict(sys.modules, hidden):
            for name in gone:
                if not name.startswith("numpy"):
                    del sys.modules[name]
            with mock.patch.object(sys.modules["nifkit_blender"], "nifkit", create=True):
                del sys.modules["nifkit_blender"].nifkit
                self.bake()
                for operator in (bpy.ops.nifkit.show_errors, bpy.ops.nifkit.show_asset):
                    self.fails("has no numpy", operator)

    def test_no_asset(self) -> None:
        select(torus())
        self.fails("Choose an asset", bpy.ops.nifkit.show_errors)

    def test_broken_assets(self) -> None:
        select(torus())
        self.bake()
        whole = open(self.output, "rb").read()
        path = str(self.folder / "broken.nif")
        bpy.context.scene.nifkit.asset = path
        self.fails(path, bpy.ops.nifkit.show_errors)
        for content in (b"", b"hello", whole[:1000], whole[:500] + b"?" + whole[501:]):
            open(path, "wb").write(content)
            self.fails(path, bpy.ops.nifkit.show_errors)
            self.fails(path, bpy.ops.nifkit.show_asset)

    def test_asset_of_something_else(self) -> None:
        select(torus())
        self.bake(encoding="exact")
        bpy.context.object.location.x = 1
        bpy.context.view_layer.update()
        self.fails("not baked from the selected objects", bpy.ops.nifkit.show_errors)
        bpy.context.object.location.x = 0
        bpy.context.object.scale = 0.5, 0.5, 0.5
        bpy.context.view_layer.update()
        self.fails("not baked from the selected objects", bpy.ops.nifkit.show_errors)

    def test_asset_of_proofs_alone(self) -> None:
        select(torus())
        bpy.context.scene.nifkit.asset = os.environ["NIF_PROOF"]
        self.fails("leaves rays open", bpy.ops.nifkit.show_errors)

    def test_light(self) -> None:
        bpy.ops.object.light_add()
        select(bpy.context.object)
        self.assertFalse(bpy.ops.nifkit.show_errors.poll())

    def test_mesh_without_faces(self) -> None:
        select(torus())
        self.bake()
        mesh = bpy.data.meshes.new("point")
        mesh.from_pydata([(0, 0, 0)], [], [])
        point = bpy.data.objects.new("point", mesh)
        bpy.context.collection.objects.link(point)
        select(point)
        self.fails("no faces", bpy.ops.nifkit.show_errors)


class Memory(AddonTest):
    def test_ten_thousand_loads_are_flat(self) -> None:
        select(torus(major_segments=12, minor_segments=6))
        self.bake(encoding="bvh")

        def load(times: int) -> int:
            for _ in range(times):
                with asset_module.Asset(self.output):
                    pass
            with open("/proc/self/statm") as file:
                return int(file.read().split()[1]) * PAGE

        before = load(1000)
        after = load(10000)
        self.assertLess(after - before, 2_000_000)
        self.assertFalse(asset_module.package().default_device().closed)
