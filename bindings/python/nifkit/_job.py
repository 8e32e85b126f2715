"""Queries in the background."""
from __future__ import annotations

import atexit
import ctypes
import os
from typing import Any, Callable, ClassVar, Generic, TypeVar

from ._library import check, lib

Result = TypeVar("Result")


class Work:
    """A job of the library, with everything that it reads and writes; `scene` is the handle of the scene that it queries."""

    # All jobs that may be running: they must stay alive until they are done, but a `Job` may be garbage-collected earlier.
    # Without a lock, which the garbage collector could run into: each change is one step.
    running: ClassVar[set[Work]] = set()
    # Its own, because at exit the module's names may be gone first.
    _wait, _release, _process_id = lib.nifWaitJob, lib.nifReleaseJob, staticmethod(os.getpid)

    def __init__(self, scene: int, keeps: Any) -> None:
        self.value = ctypes.c_void_p()  # null: not started
        self.scene = scene
        self._keeps = keeps
        self._process = self._process_id()

    def wait(self) -> int:
        """Returns the query's code."""
        code = self._wait(self.value)
        self.running.discard(self)
        return int(code)

    def done(self) -> bool:
        done = ctypes.c_uint32()
        check(lib.nifIsJobDone(self.value, ctypes.byref(done)))
        if done.value:
            self.running.discard(self)
        return bool(done.value)

    def cancel(self) -> None:
        if self._process == self._process_id():
            check(lib.nifCancelJob(self.value))

    def end(self) -> None:
        """Waits, unless this is a forked process and the job its parent's: then no thread here works on it."""
        if self.value and self._process == self._process_id():
            self.wait()

    def __del__(self) -> None:
        self.end()
        if self.value and self._process == self._process_id():
            self._release(self.value)


os.register_at_fork(after_in_child=Work.running.clear)


@atexit.register
def _wait_for_all() -> None:
    """Waits for jobs while the memory that they write to still exists."""
    for work in list(Work.running):
        work.end()


def is_at_work(scene: int) -> bool:
    """Is some job of this scene not done? Call it while none can be started."""
    return any(work.scene == scene and work.value and not work.done() for work in list(Work.running))


def start(scene: int, query: Callable[[Any], int], result: Result, keeps: Any) -> Job[Result]:
    """Starts a job by `query`, which gets a pointer to the handle to set. The job writes `result`, and reads from `keeps`."""
    work = Work(scene, (result, keeps))
    Work.running.add(work)
    try:
        check(query(ctypes.byref(work.value)))
        return Job(work, result)
    except BaseException:  # also an interrupt after it has started
        work.end()
        Work.running.discard(work)
        raise


class Job(Generic[Result]):
    """A query that runs in the background, made by `Scene.query_async()` or `Scene.intersect_async()`. Thread-safe.

    Until it is done, its arrays must not change, and its scene cannot. It keeps both alive; a job that is dropped before it
    is done is waited for, and so is one that is at work when Python ends.
    """

    def __init__(self, work: Work, result: Result) -> None:
        self._work = work
        self._result = result

    def wait(self) -> Result:
        """Waits until the job is done, and helps with rays that no thread has started.

        Returns:
            what `query()` or `intersect()` would have returned.

        Raises:
            Error: as these; CANCELLED after a `cancel()`.
        """
        check(self._work.wait())
        return self._result

    def done(self) -> bool:
        """Is it done? Does not wait."""
        return self._work.done()

    def cancel(self) -> None:
        """Stops it early, without waiting for that: rays that no thread has started are not answered, and `wait()` then
        raises an Error with CANCELLED. A job that is done, or runs on a GPU, is not stopped."""
        self._work.cancel()

    def __reduce__(self) -> Any:
        raise TypeError("a Job cannot be copied or pickled")

    def __del__(self) -> None:
        if hasattr(self, "_work"):
            self._work.end()
