"""Baking: what is baked, what is refused, and what is left when it is stopped."""
import errno
import math
import os
import tempfile
import time
from array import array
from types import SimpleNamespace
from unittest import mock

import bpy
from support import AddonTest, info, select, torus

from nifkit_blender import bake_job, bake_operator, geometry, glb, long_operator


def selection() -> geometry.Geometry:
    return geometry.collect(bpy.context.evaluated_depsgraph_get(), bpy.context.selected_objects)


class Bake(AddonTest):
    def test_writes_the_asset_and_remembers_it(self) -> None:
        select(torus())
        self.bake()
        asset = info(self.output)
        self.assertEqual([thing["triangles"] for thing in asset["objects"]], [48 * 12 * 2])
        self.assertEqual(bpy.context.scene.nifkit.asset, self.output)

    def test_same_bytes_again(self) -> None:
        select(torus())
        self.bake()
        first = open(self.output, "rb").read()
        self.bake()
        self.assertEqual(open(self.output, "rb").read(), first)

    def test_modifiers_are_applied(self) -> None:
        thing = torus()
        thing.modifiers.new("finer", "SUBSURF").levels = 1
        select(thing)
        self.bake()
        self.assertEqual([thing["triangles"] for thing in info(self.output)["objects"]], [4 * 48 * 12 * 2])

    def test_instances(self) -> None:
        """Three objects of one mesh, one of them mirrored; a collection placed twice, in which is another mesh."""
        first = torus()
        things = [first]
        for x in (5, 10):
            copy = first.copy()
            copy.location.x = x
            bpy.context.collection.objects.link(copy)
            things.append(copy)
        things[2].scale = -1, 1, 2
        bpy.ops.mesh.primitive_cube_add(location=(0, 0, 1))
        cube = bpy.context.object
        group = bpy.data.collections.new("group")
        group.objects.link(cube)
        bpy.context.collection.objects.unlink(cube)
        for y in (5, 10):
            empty = bpy.data.objects.new("empty", None)
            empty.instance_type, empty.instance_collection, empty.location.y = "COLLECTION", group, y
            bpy.context.collection.objects.link(empty)
            things.append(empty)
        bpy.context.view_layer.update()
        select(*things)
        self.bake()
        asset = info(self.output)
        self.assertEqual(len(asset["objects"]), 2)
        places = [instance["transform"] for instance in asset["instances"]]
        self.assertEqual(sorted((row[3], row[7], row[11]) for row in places),
                         [(0, 0, 0), (0, 5, 1), (0, 10, 1), (5, 0, 0), (10, 0, 0)])
        mirrored = next(row for row in places if row[3] == 10)
        self.assertEqual((mirrored[0], mirrored[5], mirrored[10]), (-1, 1, 2))

    def test_geometry_nodes(self) -> None:
        """They place one cube three times."""
        thing = torus()
        group = bpy.data.node_groups.new("cubes", "GeometryNodeTree")
        if hasattr(group, "interface"):
            group.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
        else:
            group.outputs.new("NodeSocketGeometry", "Geometry")
        line, cube, place, output = (
            group.nodes.new(kind)
            for kind in ("GeometryNodeMeshLine", "GeometryNodeMeshCube", "GeometryNodeInstanceOnPoints", "NodeGroupOutput")
        )
        line.inputs["Count"].default_value = 3
        line.inputs["Offset"].default_value = 0, 0, 2
        group.links.new(line.outputs["Mesh"], place.inputs["Points"])
        group.links.new(cube.outputs["Mesh"], place.inputs["Instance"])
        group.links.new(place.outputs["Instances"], output.inputs[0])
        thing.modifiers.new("cubes", "NODES").node_group = group
        bpy.context.view_layer.update()
        select(thing)
        self.bake()
        asset = info(self.output)
        self.assertEqual([part["triangles"] for part in asset["objects"]], [12])
        self.assertEqual(sorted(instance["transform"][11] for instance in asset["instances"]), [0, 2, 4])

    def test_copies_with_modifiers_of_their_own(self) -> None:
        """One mesh, but not one shape."""
        first = torus()
        second = first.copy()
        second.location.x = 5
        second.modifiers.new("finer", "SUBSURF").levels = 1
        bpy.context.collection.objects.link(second)
        bpy.context.view_layer.update()
        select(first, second)
        self.bake("--rays 0 --no-merge")
        self.assertEqual(sorted(thing["triangles"] for thing in info(self.output)["objects"]), [1152, 4608])
        self.bake()
        self.assertEqual([thing["triangles"] for thing in info(self.output)["objects"]], [5760])

    def test_what_is_not_selected_is_left_out(self) -> None:
        thing = torus()
        torus(location=(5, 0, 0))
        select(thing)
        self.bake()
        self.assertEqual(len(info(self.output)["instances"]), 1)

    def test_other_kinds_of_objects(self) -> None:
        bpy.ops.object.text_add()
        text = bpy.context.object
        text.data.extrude = 0.1
        bpy.ops.object.metaball_add(location=(5, 0, 0))
        ball = bpy.context.object
        bpy.ops.surface.primitive_nurbs_surface_sphere_add(location=(10, 0, 0))
        sphere = bpy.context.object
        bpy.ops.object.light_add()
        select(text, ball, sphere, bpy.context.object)
        self.bake()
        self.assertEqual(len(info(self.output)["objects"]), 3)

    def test_names_that_are_no_text(self) -> None:
        part = geometry.Part("a\udcff", array("f", (0, 0, 0, 1, 0, 0, 0, 1, 0)), array("i", range(3)))
        placed = geometry.Geometry([part], [geometry.Placement(0, "b\udcff", torus().matrix_world.copy())])
        bake_job.BakeJob(os.environ["NIF_PROGRAM"], placed, self.output, ["--encoding", "bvh", "--rays", "0"]).result()
        self.assertEqual([thing["name"] for thing in info(self.output)["objects"]], ["a?"])

    def test_another_scene_meanwhile(self) -> None:
        """The one that was baked has the asset."""
        select(torus())
        scene = bpy.context.scene
        operator = SimpleNamespace(
            filepath=self.output, options="--rays 0", encoding="bvh", preset="fast", report=lambda kind, text: None
        )
        # In a window, bpy.context has another scene after that.
        context = SimpleNamespace(
            scene=scene,
            evaluated_depsgraph_get=bpy.context.evaluated_depsgraph_get,
            selected_objects=bpy.context.selected_objects,
            preferences=bpy.context.preferences,
        )
        steps = bake_operator.NIFKIT_OT_bake.work(operator, context)
        next(steps)
        next(steps)
        context.scene = bpy.data.scenes.new("other")
        for _ in steps:
            pass
        self.assertEqual((scene.nifkit.asset, context.scene.nifkit.asset), (self.output, ""))

    def test_options_are_passed_on(self) -> None:
        select(torus())
        self.bake(encoding="segment", preset="fast", options="--seed 7 --rays 1000")
        self.assertEqual(info(self.output)["objects"][0]["encoding"], "segment")


class Refused(AddonTest):
    def test_nothing_selected(self) -> None:
        torus()
        select()
        self.assertFalse(bpy.ops.nifkit.bake.poll())

    def test_edit_mode(self) -> None:
        torus()
        bpy.ops.object.mode_set(mode="EDIT")
        self.assertFalse(bpy.ops.nifkit.bake.poll())
        bpy.ops.object.mode_set(mode="OBJECT")

    def test_no_faces(self) -> None:
        bpy.ops.object.light_add()
        light = bpy.context.object
        mesh = bpy.data.meshes.new("edge")
        mesh.from_pydata([(0, 0, 0), (1, 0, 0)], [(0, 1)], [])
        edge = bpy.data.objects.new("edge", mesh)
        bpy.context.collection.objects.link(edge)
        bpy.ops.curve.primitive_bezier_curve_add()
        select(light, edge, bpy.context.object)
        self.fails("no faces", bpy.ops.nifkit.bake, filepath=self.output)

    def test_faces_without_area(self) -> None:
        mesh = bpy.data.meshes.new("flat")
        mesh.from_pydata([(0, 0, 0), (1, 0, 0), (2, 0, 0)], [], [(0, 1, 2)])
        flat = bpy.data.objects.new("flat", mesh)
        bpy.context.collection.objects.link(flat)
        select(flat)
        self.fails("the selection", bpy.ops.nifkit.bake, filepath=self.output)

    def test_vertex_that_is_no_number(self) -> None:
        thing = torus()
        thing.data.vertices[3].co.x = math.nan
        select(thing)
        self.fails("the selection", bpy.ops.nifkit.bake, filepath=self.output)

    def test_place_that_is_no_number(self) -> None:
        for matrix in ((math.inf, 0, 0, 0), (math.nan, 0, 0, 0)), ((1, 0, 0, math.inf), (0, 1, 0, 0)):
            part = geometry.Part("part", array("f", range(9)), array("i", range(3)))
            placed = geometry.Geometry([part], [geometry.Placement(0, "far", [*matrix, (0, 0, 1, 0), (0, 0, 0, 1)])])
            with self.assertRaises(bake_job.BakeError) as caught:
                bake_job.BakeJob(os.environ["NIF_PROGRAM"], placed, self.output, [])
            self.assertIn("far: its place, turn or scale in the world is not finite", str(caught.exception))

    def test_folder_that_is_not_there(self) -> None:
        select(torus())
        self.fails(str(self.folder / "no_such"), bpy.ops.nifkit.bake, filepath=str(self.folder / "no_such" / "out.nif"))
        self.assertEqual(bpy.context.scene.nifkit.asset, "")

    def test_options(self) -> None:
        select(torus())
        self.fails("--no-such", bpy.ops.nifkit.bake, filepath=self.output, options="--no-such")
        self.fails("More: No closing quotation", bpy.ops.nifkit.bake, filepath=self.output, options="'")

    def test_program(self) -> None:
        select(torus())
        path = str(self.folder / "nif")
        with mock.patch.dict(os.environ, {"NIF_PROGRAM": path}):
            self.fails("is not a program", bpy.ops.nifkit.bake, filepath=self.output)
        open(path, "w").write("what?")
        os.chmod(path, 0o755)
        with mock.patch.dict(os.environ, {"NIF_PROGRAM": path}):
            self.fails(path, bpy.ops.nifkit.bake, filepath=self.output)
        with mock.patch.dict(os.environ, {"PATH": "", "NIF_PROGRAM": ""}):
            self.fails("is not installed", bpy.ops.nifkit.bake, filepath=self.output)

    def test_program_of_the_preferences(self) -> None:
        select(torus())
        preferences = bpy.context.preferences.addons["nifkit_blender"].preferences
        preferences.program = str(self.folder)
        self.addCleanup(setattr, preferences, "program", "")
        self.fails("the add-on's preferences", bpy.ops.nifkit.bake, filepath=self.output)
        preferences.program = os.environ["NIF_PROGRAM"]
        with mock.patch.dict(os.environ, {"NIF_PROGRAM": "/no/such"}):
            self.bake()


class Job(AddonTest):
    def start(self) -> bake_job.BakeJob:
        """A bake that takes some time."""
        thing = torus(major_segments=400, minor_segments=100)
        select(thing)
        options = ["--encoding", "segment", "--preset", "high"]
        return bake_job.BakeJob(os.environ["NIF_PROGRAM"], selection(), self.output, options)

    def test_progress(self) -> None:
        job = self.start()
        self.addCleanup(job.cancel)
        end = time.monotonic() + 60
        while job.fraction == 0 and time.monotonic() < end:
            time.sleep(0.1)
        self.assertGreater(job.fraction, 0)
        self.assertLessEqual(job.fraction, 1)
        self.assertTrue(job.text)

    def test_cancel(self) -> None:
        job = self.start()
        end = time.monotonic() + 60
        while job.fraction == 0 and time.monotonic() < end:
            time.sleep(0.1)
        self.assertFalse(job.done())
        job.cancel()
        self.assertTrue(job.done())
        with self.assertRaises(bake_job.BakeError) as caught:
            job.result()
        self.assertEqual(caught.exception.code, bake_job.INTERRUPTED)
        self.assertEqual(list(self.folder.iterdir()), [])
        self.assertFalse(job._folder.exists())

    def test_cancel_at_once(self) -> None:
        job = self.start()
        job.cancel()
        self.assertRaises(bake_job.BakeError, job.result)
        self.assertEqual(list(self.folder.iterdir()), [])

    def test_cancel_afterwards(self) -> None:
        """What is done is done."""
        select(torus())
        job = bake_job.BakeJob(os.environ["NIF_PROGRAM"], selection(), self.output, [])
        while not job.done():
            time.sleep(0.01)
        job.cancel()
        self.assertTrue(os.path.exists(self.output))

    def test_nothing_is_left_if_it_does_not_start(self) -> None:
        """A full disk is that of the temporary mesh, not of the program; and whatever happens, no folder stays."""
        select(torus())
        with mock.patch.object(tempfile, "tempdir", str(self.folder)):
            for error, wanted in (
                (OSError(errno.ENOSPC, os.strerror(errno.ENOSPC)), "selection.glb: No space left on device"),
                (MemoryError("memory"), "memory"),
            ):
                with mock.patch.object(glb, "open", side_effect=error, create=True):
                    with self.assertRaises((bake_job.BakeError, MemoryError)) as caught:
                        bake_job.BakeJob("/no/such/nif", selection(), self.output, [])
                self.assertIn(wanted, str(caught.exception))
                self.assertNotIn("/no/such/nif", str(caught.exception))
                self.assertEqual(list(self.folder.iterdir()), [])
        with mock.patch.object(tempfile, "tempdir", str(self.folder / "no_such")):
            with self.assertRaises(bake_job.BakeError) as caught:
                bake_job.BakeJob(os.environ["NIF_PROGRAM"], selection(), self.output, [])
        self.assertIn("No temporary folder can be made: ", str(caught.exception))

    def test_killed(self) -> None:
        job = self.start()
        job._process.kill()
        with self.assertRaises(bake_job.BakeError) as caught:
            job.result()
        self.assertIn("nif bake ended with", str(caught.exception))


class Defect(AddonTest):
    def test_undoes(self) -> None:
        """What nobody has thought of: nothing goes on in the background, and the window is as it was."""
        context = mock.MagicMock()
        for run in (lambda operator: operator.modal(context, SimpleNamespace(type="TIMER", value="NOTHING")),
                    lambda operator: operator._run_to_end()):
            class Operator(long_operator.LongOperator):
                bl_label, _timer = "Defect", None
                undo = mock.Mock()

                def work(self, context):
                    yield 0, "work"
                    raise ReferenceError("removed")

            operator = Operator()
            operator._steps = operator.work(context)
            with self.assertRaises(ReferenceError):
                run(operator)
            operator.undo.assert_called_once()
        context.workspace.status_text_set.assert_called_with(None)
