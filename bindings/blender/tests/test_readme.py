"""The script in the README works as it stands, but for its paths."""
import sys
from pathlib import Path

import bpy
from support import AddonTest, torus

README = Path(__file__).parents[1] / "README.md"


class Readme(AddonTest):
    def test_script(self) -> None:
        script = README.read_text(encoding="utf-8").split("```python\n")[1].split("```")[0]
        package = sys.argv[sys.argv.index("--") + 1]
        for path, other in (("build/blender/nifkit_blender.zip", package), ("/tmp/scene.nif", self.output)):
            self.assertIn(path, script)
            script = script.replace(path, other)
        thing = torus(major_segments=12, minor_segments=6)
        exec(compile(script, str(README), "exec"), {})
        self.assertTrue(Path(self.output).exists())
        self.assertIn("nifkit errors", bpy.data.objects[thing.name].data.color_attributes)
