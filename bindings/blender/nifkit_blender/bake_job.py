"""A bake in the background: `nif bake` as a process of its own, its progress, and its end. Knows nothing of windows."""
from __future__ import annotations

import json
import os
import re
import shutil
import signal
import subprocess
import tempfile
import threading
from pathlib import Path
from typing import Any, Optional

from . import glb
from .geometry import Geometry

# As `nif` prints it where there is no terminal: " 45 %  12 s left      train".
PROGRESS = re.compile(r"^ *(\d+) %  (.{15})(.*)$")
INTERRUPTED = 130


class BakeError(Exception):
    """What went wrong, in one sentence. `code` is the exit code of `nif`; 130: cancelled."""

    def __init__(self, message: str, code: int = 1) -> None:
        super().__init__(message)
        self.code = code


class BakeJob:
    """Starts when it is made. Then call `done()` now and then, and at the end `result()`; or `cancel()`.

    Args:
        program: the program `nif`.
        geometry: what is baked.
        output: the asset that is written. It is written whole or not at all.
        options: more options of `nif bake`.

    Raises:
        BakeError: there is nothing to bake, the mesh cannot be written, or the program cannot be started.
    """

    def __init__(self, program: str, geometry: Geometry, output: str, options: list[str]) -> None:
        self.fraction = 0.0
        self.text = "start"
        self.left = ""
        self._said: list[str] = []
        self._cancelled = False
        if not geometry.placements:
            raise BakeError("Nothing to bake: the selected objects have no faces")
        try:
            self._folder = Path(tempfile.mkdtemp(prefix="nifkit-"))
        except OSError as error:
            raise BakeError(f"No temporary folder can be made: {error}") from None
        try:
            self._start(program, geometry, output, options)
        except BaseException:
            self._clean()
            raise
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _start(self, program: str, geometry: Geometry, output: str, options: list[str]) -> None:
        """Writes the mesh, and starts the program."""
        part = mesh = self._folder / "selection.glb"
        try:
            glb.write(geometry, mesh)
            part = self._folder / "report.json"
            report = open(part, "wb")
        except glb.Unfit as error:
            raise BakeError(str(error)) from None
        except OSError as error:
            raise BakeError(f"{part}: {error.strerror or error}") from None
        with report:
            try:
                self._process = subprocess.Popen(
                    # Whoever cancels wants nothing to be left, and the selection may be another one the next time.
                    [program, "bake", str(mesh), "-o", output, "--json", "--checkpoint", "0", *options],
                    stdin=subprocess.DEVNULL, stdout=report, stderr=subprocess.PIPE,
                    env={**os.environ, "NIF_PROGRESS": "all"},
                )
            except OSError as error:
                raise BakeError(f"{program}: {error.strerror or error}") from None

    def _read(self) -> None:
        assert self._process.stderr is not None
        with self._process.stderr as pipe:
            for line in pipe:
                text = line.decode("utf-8", "replace").rstrip()
                found = PROGRESS.match(text)
                if found:
                    self.fraction, self.left, self.text = int(found[1]) / 100, found[2].strip(), found[3].strip()
                elif text:
                    self._said.append(text)

    def done(self) -> bool:
        """True once the program has ended. Does not wait."""
        return self._process.poll() is not None

    def cancel(self) -> None:
        """Asks the program to stop, and waits until it has. Then no output is left, and `result()` says that it was cancelled;
        unless the bake was done before."""
        if not self.done():
            self._cancelled = True
            # Where there are no signals, its temporary file may stay.
            self._process.send_signal(signal.SIGINT if os.name == "posix" else signal.SIGTERM)
            try:
                self._process.wait(10)
            except subprocess.TimeoutExpired:
                self._process.kill()
        self._end()

    def result(self) -> dict[str, Any]:
        """Waits for the end. The report of the bake (schema nifkit.bake/2), with what it said beside in "said".

        Raises:
            BakeError: the bake failed, or was cancelled.
        """
        report = self._end()
        code = self._process.returncode
        if code == INTERRUPTED or (self._cancelled and code != 0):
            raise BakeError("The bake was cancelled", INTERRUPTED)
        if code != 0 or report is None:
            # The sentence that counts is the last one; the mesh's name in it is that of a temporary file.
            said = self._said[-1] if self._said else f"nif bake ended with code {code}"
            raise BakeError(said.replace(str(self._folder / "selection.glb"), "the selection"), code or 1)
        return report

    def _end(self) -> Optional[dict[str, Any]]:
        """Waits, reads the report, and removes what is temporary."""
        self._process.wait()
        self._reader.join()
        try:
            report: dict[str, Any] = json.loads((self._folder / "report.json").read_text(encoding="utf-8"))
        except (OSError, ValueError):
            return None
        finally:
            self._clean()
        report["said"] = list(self._said)
        return report

    def _clean(self) -> None:
        shutil.rmtree(self._folder, ignore_errors=True)
