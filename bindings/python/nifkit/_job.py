"""Queries in the background."""
from __future__ import annotations

import atexit
import ctypes
import os
from typing import Any, Callable, ClassVar, Generic, TypeVar

from ._library import check, lib

Result = TypeVar("Result")


class Work:
    """A job of the library, with all that it reads and writes; `scene` is the handle of what it queries."""

    # All that may be at work: it must not go away, nor be forgotten, before it is done, and `Job`s in a cycle of garbage may.
    # Without a lock, which a collection of garbage could meet: each change of it is one step.
    running: ClassVar[set[Work]] = set()
    # Its own, because at exit the module's names may be gone first.
    _wait, _release, _process_id = lib.nifWaitJob, lib.nifReleaseJob, staticmethod(os.getpid)

    def __init__(self, scene: int, keeps: Any) -> None:
        self.value = ctypes.c_void_p()  # null: not begun
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
        """Waits, unless it is the parent's of a forked process, which has none of the threads that are at work on it."""
        if self.value and self._process == self._process_id():
            self.wait()

    def __del__(self) -> None:
        self.end()
        if self.value and self._process == self._process_id():
            self._release(self.value)


os.register_at_fork(after_in_child=Work.running.clear)


@atexit.register
def _wait_for_all() -> None:
    """While all that they write to is still there."""
    for work in list(Work.running):
        work.end()


def is_at_work(scene: int) -> bool:
    """Whether a job of this scene is not done. While none can be started."""
    return any(work.scene == scene and work.value and not work.done() for work in list(Work.running))


def start(scene: int, query: Callable[[Any], int], result: Result, keeps: Any) -> Job[Result]:
    """What `query` starts, given a pointer to the handle that it sets. It writes `result`, and reads what `keeps` has."""
    work = Work(scene, (result, keeps))
    Work.running.add(work)
    try:
        check(query(ctypes.byref(work.value)))
        return Job(work, result)
    except BaseException:  # also an interrupt after it has begun
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
        """Waits until the job is done, and helps with what nobody has started on.

        Returns:
            what `query()` or `intersect()` would have returned.

        Raises:
            Error: as these; CANCELLED after a `cancel()`.
        """
        check(self._work.wait())
        return self._result

    def done(self) -> bool:
        """Whether it is done. Does not wait."""
        return self._work.done()

    def cancel(self) -> None:
        """Stops it early, without waiting for that: rays that nobody has started on are left as they are, and `wait()` then
        raises an Error with CANCELLED. A job that is done, and one on a GPU, is not stopped."""
        self._work.cancel()

    def __reduce__(self) -> Any:
        raise TypeError("a Job cannot be copied or pickled")

    def __del__(self) -> None:
        if hasattr(self, "_work"):
            self._work.end()
