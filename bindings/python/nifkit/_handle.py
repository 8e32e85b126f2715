"""Lifetimes: what devices, assets and scenes have in common."""
from __future__ import annotations

import contextlib
import threading
from types import TracebackType
from typing import Any, Callable, Iterator, Optional, Type, TypeVar

from ._abi import ErrorCode
from ._library import Error

Self = TypeVar("Self", bound="Handle")


class Handle:
    """Owns one reference of a handle of the library.

    The library forbids that the last reference goes while another thread is in a call with the handle, and that a scene
    changes while it is queried. Calls release the GIL, so Python has to see to both: each call borrows the handle.
    """

    _kind = "object"
    _release: Callable[[int], Any]  # of the library; set by each class

    def __init__(self, value: int) -> None:
        self._value: Optional[int] = value
        self._lock = threading.Lock()
        self._users = 0
        self._changing = False
        self._closed = False

    def close(self) -> None:
        """Releases it. A call that is at work on another thread is finished first. Closing twice does nothing."""
        with self._lock:
            self._closed = True
            value = self._unused_value()
        if value is not None:
            type(self)._release(value)

    @property
    def closed(self) -> bool:
        """True once `close()` was called."""
        return self._closed

    def __enter__(self: Self) -> Self:
        if self._closed:
            raise Error(ErrorCode.INVALID_ARGUMENT, f"the {self._kind} is closed")
        return self

    def __exit__(
        self, kind: Optional[Type[BaseException]], error: Optional[BaseException], trace: Optional[TracebackType]
    ) -> None:
        self.close()

    def __del__(self) -> None:
        # An object whose construction failed has no lock.
        if hasattr(self, "_closed"):
            self.close()

    def __reduce__(self) -> Any:
        raise TypeError(f"a {type(self).__name__} cannot be copied or pickled")

    @contextlib.contextmanager
    def _using(self, change: bool = False) -> Iterator[int]:
        """The handle, for one call. `change`: no other call may be at work meanwhile."""
        value = self._borrow(change)
        try:
            yield value
        finally:
            self._give_back()

    def _borrow(self, change: bool) -> int:
        with self._lock:
            if self._closed or self._value is None:
                raise Error(ErrorCode.INVALID_ARGUMENT, f"the {self._kind} is closed")
            if self._changing or (change and self._users):
                what = "is being changed" if self._changing else "is in use"
                raise Error(ErrorCode.INVALID_OPERATION, f"the {self._kind} {what} by another thread")
            self._users += 1
            self._changing = change
            return self._value

    def _give_back(self) -> None:
        with self._lock:
            self._users -= 1
            self._changing = False
            value = self._unused_value()
        if value is not None:
            type(self)._release(value)

    def _unused_value(self) -> Optional[int]:
        """Takes the handle away if it is closed and nobody uses it. With the lock held."""
        if not self._closed or self._users:
            return None
        value, self._value = self._value, None
        return value
