"""Locks for which a thread can wait without being interrupted.

An interrupt may come between any two steps of the interpreter, and every wait of Python's own ends with it. But a call
that is interrupted has to wait for its helpers, whatever else comes. The locks below Python's, of
its C interface, are waited for in one step that raises nothing. They are used again, never freed.
"""

from __future__ import annotations

import ctypes
from collections import deque
from collections.abc import Callable, Iterable
from functools import partial
from itertools import filterfalse

Lock = int  # its address

_function = "PyThread_acquire_lock", ctypes.pythonapi
_types = ctypes.c_int, ctypes.c_void_p, ctypes.c_int
# CFUNCTYPE lets go of the GIL while the function runs, PYFUNCTYPE keeps it: to take it again may last 5 ms.
_wait = ctypes.CFUNCTYPE(*_types)(_function, ((1, "lock"), (1, "wait", 1)))
_try = ctypes.PYFUNCTYPE(*_types)(_function, ((1, "lock"), (1, "wait", 0)))
_allocate = ctypes.PYFUNCTYPE(ctypes.c_void_p)(("PyThread_allocate_lock", ctypes.pythonapi))
release: Callable[[Lock], None] = ctypes.PYFUNCTYPE(None, ctypes.c_void_p)(("PyThread_release_lock", ctypes.pythonapi))

_spare: list[Lock] = []


def take() -> Lock:
    """A lock that is free."""
    try:
        return _spare.pop()
    except IndexError:
        lock: Lock | None = _allocate()
        if lock is None:
            raise MemoryError("there is no memory for a lock") from None
        return lock


def give_back(lock: Lock) -> None:
    """A lock that is taken, and that nobody else will touch any more, for others to take."""
    release(lock)
    _spare.append(lock)


def acquire_at_once(lock: Lock) -> bool:
    """Takes the lock if it is free."""
    return bool(_try(lock))


def waiting(locks: Iterable[Lock]) -> Callable[[], object]:
    """A callable, to be called once, that acquires all locks in one step of the interpreter."""
    return partial(deque(maxlen=0).extend, map(_wait, filterfalse(_try, locks)))


def after_fork() -> None:
    """In a child: a thread that it does not have may hold some."""
    _spare.clear()
