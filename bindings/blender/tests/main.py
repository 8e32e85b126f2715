"""Installs the add-on from its zip and runs the tests. Blender runs it (run.sh does): ... -P main.py -- ADDON.zip [TEST...]"""
import faulthandler
import importlib.util
import sys
import unittest
from pathlib import Path

import bpy

package, *wanted = sys.argv[sys.argv.index("--") + 1 :]
sys.path.insert(0, str(Path(__file__).parent))
sys.dont_write_bytecode = True
faulthandler.enable()

bpy.ops.preferences.addon_install(filepath=package)
if bpy.ops.preferences.addon_enable(module="nifkit_blender") != {"FINISHED"}:
    sys.exit("main.py: the add-on does not start")
names = wanted or sorted(path.stem for path in Path(__file__).parent.glob("test_*.py"))
if importlib.util.find_spec("numpy") is None:
    print("Skipped: showing assets in Blender, because its Python has no numpy (tools/setup.sh blender)")
    names = [name for name in names if name == "test_bake"]
suite = unittest.defaultTestLoader.loadTestsFromNames(names)
result = unittest.TextTestRunner(verbosity=2).run(suite)
for test, reason in result.skipped:
    print(f"Skipped: {test.id()}: {reason}")
bpy.ops.preferences.addon_disable(module="nifkit_blender")
sys.exit(0 if result.wasSuccessful() and result.testsRun else 1)
