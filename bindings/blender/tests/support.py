"""What the tests share: an empty scene, a folder, objects, and what `nif info` says of an asset."""
import json
import os
import subprocess
import tempfile
import unittest
from pathlib import Path

import bpy


class AddonTest(unittest.TestCase):
    def setUp(self) -> None:
        bpy.ops.wm.read_homefile(use_empty=True)
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)
        self.output = str(self.folder / "out.nif")

    def fails(self, text: str, operator, **arguments) -> None:
        """The operator ends with an error that has this text, and leaves no file."""
        before = sorted(self.folder.iterdir())
        with self.assertRaises(RuntimeError) as caught:
            operator(**arguments)
        self.assertIn(text, str(caught.exception))
        self.assertNotIn("Traceback", str(caught.exception))
        self.assertEqual(sorted(self.folder.iterdir()), before)

    def bake(self, options: str = "--rays 0", **arguments) -> None:
        """Bakes the selection to `output`, and measures nothing."""
        self.assertEqual(bpy.ops.nifkit.bake(filepath=self.output, options=options, **arguments), {"FINISHED"})


def select(*things: bpy.types.Object) -> None:
    for thing in bpy.context.scene.objects:
        thing.select_set(thing in things)
    bpy.context.view_layer.objects.active = things[0] if things else None


def info(path: str) -> dict:
    """Of an asset, by `nif info --json`."""
    said = subprocess.run([os.environ["NIF_PROGRAM"], "info", path, "--json"], check=True, capture_output=True)
    return json.loads(said.stdout)


def torus(**arguments) -> bpy.types.Object:
    bpy.ops.mesh.primitive_torus_add(**arguments)
    return bpy.context.object
