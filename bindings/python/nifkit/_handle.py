"""Handles: manages the lifetimes of devices, assets and scenes, which work alike."""
from __future__ import annotations

import os
import threading
import weakref
from types import TracebackType
from typing import Any, Callable, Optional, Type, TypeVar

from ._abi import ErrorCode
from ._library import Error

Self = TypeVar("Self", bound="Handle")


class Use:
    """A handle while a call uses it. `change`: no other call may run at the same time.

    Ctrl-C raises a KeyboardInterrupt between any two steps, also at the start of `__exit__`. So a handle has weak references to
    its uses: one that is gone has ended. (A `__del__` would do, but an interrupt in there is lost.)
    """

    def __init__(self, handle: Handle, change: bool) -> None:
        self.change = change
        self._handle = handle

    def __enter__(self) -> int:
        try:
            return self._handle._borrow(self)
        except BaseException:
            self._handle._give_back(self)
            raise

    def __exit__(self, *error: object) -> None:
        self._handle._give_back(self)


class Handle:
    """Owns one reference of a handle of the library.

    The library forbids that the last reference goes while another thread is in a call with the handle, and that a scene
    changes while it is queried. Calls release the GIL, so Python has to see to both: each call borrows the handle.

    A forked process has a copy without the device's threads, and releases nothing of its parent's.
    """

    _kind = "object"
    _release: Callable[[int], Any]  # of the library; set by each class
    _process_id = staticmethod(os.getpid)  # its own, because at exit the module's names may be gone first

    def __init__(self, value: int) -> None:
        self._value: Optional[int] = value
        self._lock = threading.Lock()
        self._process = self._process_id()
        self._uses: list[weakref.ref[Use]] = []
        self._closed = False

    def close(self) -> None:
        """Releases it. A call that runs on another thread is finished first. Closing twice does nothing."""
        if self._process != self._process_id():
            self._closed, self._value = True, None  # without the lock, which a thread may hold that no longer exists
            return
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

    def _using(self, change: bool = False) -> Use:
        """The handle, for one call."""
        return Use(self, change)

    def _borrow(self, use: Use) -> int:
        with self._lock:
            if self._closed or self._value is None:
                raise Error(ErrorCode.INVALID_ARGUMENT, f"the {self._kind} is closed")
            for other in self._users():
                if other.change or use.change:
                    what = "is being changed" if other.change else "is in use"
                    raise Error(ErrorCode.INVALID_OPERATION, f"the {self._kind} {what} by another thread")
            self._uses.append(weakref.ref(use))
            return self._value

    def _give_back(self, use: Use) -> None:
        with self._lock:
            self._uses = [weakref.ref(other) for other in self._users() if other is not use]
            value = self._unused_value()
        if value is not None:
            type(self)._release(value)

    def _users(self) -> list[Use]:
        """Requires the lock."""
        return [use for use in (reference() for reference in self._uses) if use is not None]

    def _unused_value(self) -> Optional[int]:
        """Takes the handle away if it is closed and no call uses it. Requires the lock."""
        if not self._closed or self._users():
            return None
        value, self._value = self._value, None
        return value
