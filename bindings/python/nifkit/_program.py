"""Runs the program `nif`, which bakes. It is a separate program because it needs libraries that the runtime does not."""
from __future__ import annotations

import os
import re
import shutil
import signal
import subprocess
import tempfile
import threading
from pathlib import Path
from typing import Callable, Optional, Sequence

from ._abi import ErrorCode
from ._library import Error

# Called with the fraction that is done, 0 to 1, and the current step. Returning False cancels.
Progress = Callable[[float, str], Optional[bool]]

_PROGRESS = re.compile(r"^ *(\d+) %  .{15}(.*)$")  # the time that is left, then the text
_INTERRUPTED = 130  # exit code
_INTERVAL = 0.1  # seconds between two calls of a Progress


def find_program() -> str:
    """The path of `nif`: what the environment variable NIF_PROGRAM names, else `bin/nif` in the package's folder, else what
    is found on PATH.

    Raises:
        Error: NOT_AVAILABLE, with what to do about it.
    """
    chosen = os.environ.get("NIF_PROGRAM")
    if chosen:
        if os.access(chosen, os.X_OK) and os.path.isfile(chosen):
            return os.path.abspath(chosen)
        raise Error(ErrorCode.NOT_AVAILABLE, f"NIF_PROGRAM names {chosen}, which is no program; it has to be nifkit's `nif`")
    beside = Path(__file__).parent / "bin" / "nif"
    if beside.exists():
        return str(beside)
    found = shutil.which("nif")
    if found:
        return os.path.abspath(found)
    raise Error(
        ErrorCode.NOT_AVAILABLE,
        "only the runtime is installed here; baking needs nifkit's program `nif`, which is neither what NIF_PROGRAM names, "
        f"nor {beside}, nor on PATH: install nifkit, or build its target `nif`",
    )


def run(arguments: Sequence[str], progress: Optional[Progress] = None, hidden: str = "") -> str:
    """Runs `nif`, and returns what it wrote to standard output. `hidden` is left out of what it says: a temporary folder.
    Where it is cancelled, or `progress` raises, `nif` is interrupted, and removes what it has begun to write.

    Raises:
        Error: with `nif`'s exit code and sentence; CANCELLED if `progress` said so.
    """
    command = [find_program(), *arguments]
    # A file, unlike a pipe, takes any amount of output without a reader.
    with tempfile.TemporaryFile() as output:
        try:
            process = subprocess.Popen(
                command, stdin=subprocess.DEVNULL, stdout=output, stderr=subprocess.PIPE,
                encoding="utf-8", errors="backslashreplace", env={**os.environ, "NIF_PROGRESS": "all"},
            )
        except OSError as error:
            raise Error(ErrorCode.NOT_AVAILABLE, f"cannot run {command[0]}: {error}") from None
        messages = _Messages(process, hidden)
        try:
            cancelled = _wait(process, messages, progress)
        finally:
            _end(process)
            messages.finish()
        if process.returncode == 0:
            output.seek(0)
            return output.read().decode("utf-8", "backslashreplace")
    if cancelled and process.returncode == _INTERRUPTED:
        raise Error(ErrorCode.CANCELLED, "the bake was cancelled")
    if process.returncode < 0:
        raise Error(ErrorCode.UNKNOWN, f"nif was ended by signal {-process.returncode}")
    raise Error(process.returncode, messages.error() or f"nif ended with {process.returncode}")


class _Messages:
    """Reads what `nif` writes to standard error, on a thread of its own: lines of progress, notes, and an error."""

    def __init__(self, process: "subprocess.Popen[str]", hidden: str) -> None:
        assert process.stderr is not None
        self._hidden = hidden
        self._stream = process.stderr
        self._others: list[str] = []
        self.fraction, self.text = 0.0, "starting"
        self._thread = threading.Thread(target=self._read, daemon=True)
        self._thread.start()

    def _read(self) -> None:
        for line in self._stream:
            if self._hidden:
                line = line.replace(self._hidden, "")
            found = _PROGRESS.match(line)
            if found:
                self.fraction, self.text = int(found[1]) / 100, found[2]
            else:
                self._others.append(line.rstrip("\n"))

    def finish(self) -> None:
        self._thread.join()
        self._stream.close()

    def error(self) -> str:
        """The error's sentence."""
        lines = [line for line in self._others if line and not line.startswith("nif: note: ")]
        return "\n".join(lines[-1:]).removeprefix("nif: ")


def _wait(process: "subprocess.Popen[str]", messages: _Messages, progress: Optional[Progress]) -> bool:
    """Waits for the end. Returns whether it was cancelled."""
    if progress is None:
        process.wait()
        return False
    while True:
        if progress(messages.fraction, messages.text) is False:
            return True
        try:
            process.wait(_INTERVAL)
        except subprocess.TimeoutExpired:
            continue
        return False


def _end(process: "subprocess.Popen[str]") -> None:
    """Interrupts it if it still runs: the first time to end soon, the second time at once."""
    for _ in range(2):
        if process.poll() is not None:
            return
        process.send_signal(signal.SIGINT)
        try:
            process.wait(10)
        except subprocess.TimeoutExpired:
            continue
    process.kill()
    process.wait()
