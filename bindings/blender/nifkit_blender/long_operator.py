"""An operator that works for long: in a window it leaves Blender usable, shows how far it is in the status bar, and stops at
Esc; without a window it runs to its end."""
from __future__ import annotations

import sys
import time
from typing import Iterator

import bpy

SLICE = 0.05  # seconds of work between two looks at the window
TICK = 0.1  # seconds between two timer events


class Failure(Exception):
    """What went wrong, in one sentence for the user."""


class LongOperator:
    """To be mixed into an operator, which offers `work()` and, where something is to be undone, `undo()`."""

    def work(self, context: bpy.types.Context) -> Iterator[tuple[float, str]]:
        """Does all of it. Yields often: how much is done (0 to 1), and what goes on. Raises Failure."""
        raise NotImplementedError

    def undo(self) -> None:
        """Called if the user stops it, Blender closes, or it fails otherwise than by a Failure."""

    def execute(self, context: bpy.types.Context) -> set[str]:
        self._steps = self.work(context)
        if bpy.app.background or context.window is None:
            return self._run_to_end()
        manager = context.window_manager
        self._timer = manager.event_timer_add(TICK, window=context.window)
        manager.progress_begin(0, 100)
        manager.modal_handler_add(self)
        self._show(context, 0, self.bl_label)
        return {"RUNNING_MODAL"}

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        if event.type == "ESC" and event.value == "PRESS":
            self.cancel(context)
            self.report({"WARNING"}, f"{self.bl_label}: stopped")
            return {"CANCELLED"}
        if event.type != "TIMER":
            return {"PASS_THROUGH"}
        end = time.perf_counter() + SLICE
        while time.perf_counter() < end:
            try:
                fraction, text = next(self._steps)
                self._show(context, fraction, text)
            except StopIteration:
                self._leave(context)
                return {"FINISHED"}
            except Failure as failure:
                self._leave(context)
                self.report({"ERROR"}, str(failure))
                return {"CANCELLED"}
            except BaseException:  # a defect; the window must not stay as it is, nor anything go on in the background
                self.cancel(context)
                raise
        return {"RUNNING_MODAL"}

    def cancel(self, context: bpy.types.Context) -> None:
        """Blender calls this, too, when it closes meanwhile."""
        try:
            self._steps.close()
            self.undo()
        finally:
            self._leave(context)

    def _run_to_end(self) -> set[str]:
        last = time.perf_counter()
        try:
            for fraction, text in self._steps:
                if time.perf_counter() - last > 1:
                    last = time.perf_counter()
                    print(f"{100 * fraction:3.0f} %  {text}", file=sys.stderr)
        except KeyboardInterrupt:
            self.undo()
            return {"CANCELLED"}
        except Failure as failure:
            self.report({"ERROR"}, str(failure))
            return {"CANCELLED"}
        except BaseException:  # a defect
            self.undo()
            raise
        return {"FINISHED"}

    def _show(self, context: bpy.types.Context, fraction: float, text: str) -> None:
        context.window_manager.progress_update(int(100 * fraction))
        context.workspace.status_text_set(f"{self.bl_label}: {100 * fraction:.0f} %   {text}   Esc: stop")

    def _leave(self, context: bpy.types.Context) -> None:
        context.window_manager.event_timer_remove(self._timer)
        context.window_manager.progress_end()
        context.workspace.status_text_set(None)
