"""Baking in Blender's window, on a screen that nobody sees: it shows how far it is, leaves Blender usable, and stops at Esc and
when Blender closes. Blender runs it (run.sh does): --enable-event-simulate -P window.py -- ADDON.zip FOLDER"""
import importlib.util
import os
import sys
import time
import traceback
from pathlib import Path
from typing import Iterator

import bpy

package, folder = sys.argv[sys.argv.index("--") + 1 :]
output = Path(folder) / "out.nif"
shown: list[tuple[float, str]] = []
left: list[bool] = []
LONG = {"encoding": "segment", "preset": "high"}


def watch() -> None:
    """Notes what the operator shows, and that it has left the window as it was."""
    from nifkit_blender.long_operator import LongOperator

    show, leave = LongOperator._show, LongOperator._leave

    def watched_show(self, context, fraction, text):
        shown.append((fraction, text))
        show(self, context, fraction, text)

    def watched_leave(self, context):
        left.append(True)
        leave(self, context)

    LongOperator._show, LongOperator._leave = watched_show, watched_leave


def start(operator=None, **arguments) -> None:
    shown.clear()
    left.clear()
    window = bpy.context.window_manager.windows[0]
    area = next(area for area in window.screen.areas if area.type == "VIEW_3D")
    with bpy.context.temp_override(window=window, area=area):
        if operator is None:
            operator, arguments["filepath"] = bpy.ops.nifkit.bake, str(output)
        assert operator(**arguments) == {"RUNNING_MODAL"}


def until(what, seconds: float = 120) -> Iterator[None]:
    """Lets the window work until `what()` holds."""
    end = time.monotonic() + seconds
    while not what():
        assert time.monotonic() < end, "it took too long"
        yield


def press_escape(window: bpy.types.Window) -> None:
    window.event_simulate(type="ESC", value="PRESS", x=0, y=0)
    window.event_simulate(type="ESC", value="RELEASE", x=0, y=0)


def torus(major: int, minor: int) -> None:
    bpy.ops.object.select_all(action="DESELECT")
    bpy.ops.mesh.primitive_torus_add(major_segments=major, minor_segments=minor)


def story() -> Iterator[None]:
    window = bpy.context.window_manager.windows[0]
    bpy.ops.preferences.addon_install(filepath=package)
    bpy.ops.preferences.addon_enable(module="nifkit_blender")
    watch()

    torus(48, 12)
    start()
    yield from until(lambda: left)
    assert output.exists() and bpy.context.scene.nifkit.asset == str(output)

    if importlib.util.find_spec("numpy") is not None:
        colors = bpy.context.object.data.color_attributes
        start(bpy.ops.nifkit.show_errors, rays=4)
        yield from until(lambda: left)
        assert list(colors.keys()) == ["nifkit errors"]
        start(bpy.ops.nifkit.show_asset, rays=4096)
        yield from until(lambda: shown and shown[-1][0] > 0)
        press_escape(window)
        yield from until(lambda: left, 20)
        assert list(colors.keys()) == ["nifkit errors"], "Esc leaves colours"
    output.unlink()

    torus(400, 100)
    start(**LONG)
    yield from until(lambda: shown and shown[-1][0] > 0)
    press_escape(window)
    yield from until(lambda: left, 20)
    assert not list(Path(folder).iterdir()), "Esc leaves a file"

    # What goes wrong while it works.
    start(**LONG, options="--max-bytes 100")
    yield from until(lambda: left)
    assert not list(Path(folder).iterdir()), "an error leaves a file"

    start(**LONG)
    yield from until(lambda: shown and shown[-1][0] > 0)
    print("window.py: all is well; closing meanwhile", flush=True)
    bpy.ops.wm.quit_blender()
    yield


steps = story()


def tick() -> float:
    try:
        next(steps)
    except BaseException:
        traceback.print_exc()
        sys.stderr.flush()
        os._exit(1)
    return 0.1


bpy.app.timers.register(tick, first_interval=0.5)
