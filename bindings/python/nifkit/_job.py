"""Queries in the background."""
from __future__ import annotations

import ctypes
from typing import Any, Generic, Optional, TypeVar

from ._library import check, lib

Result = TypeVar("Result")


class Job(Generic[Result]):
    """A query that runs in the background, made by `Scene.query_async()` or `Scene.intersect_async()`. Thread-safe.

    Until it is done, its arrays must not change, and its scene cannot. It keeps both alive; a job that is dropped before it
    is done is waited for.
    """

    def __init__(self, value: int, result: Result, keeps: Any) -> None:
        self._value: Optional[int] = value
        self._result = result
        self._keeps = keeps  # what the library reads and writes

    def wait(self) -> Result:
        """Waits until the job is done, and helps with what nobody has started on.

        Returns:
            what `query()` or `intersect()` would have returned.

        Raises:
            Error: as these.
        """
        check(lib.nifWaitJob(self._value))
        return self._result

    def done(self) -> bool:
        """Whether it is done. Does not wait."""
        done = ctypes.c_uint32()
        check(lib.nifIsJobDone(self._value, ctypes.byref(done)))
        return bool(done.value)

    def __reduce__(self) -> Any:
        raise TypeError("a Job cannot be copied or pickled")

    def __del__(self) -> None:
        if getattr(self, "_value", None) is not None:
            lib.nifWaitJob(self._value)
            lib.nifReleaseJob(self._value)
            self._value = None
