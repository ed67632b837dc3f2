"""Memory for large arrays: what dies is kept for the next ones, as fresh memory costs more than a batch does.

The system gives memory page by page, each at its first touch, and for results that a program makes and drops at every
step this is one half to four fifths of the time. NumPy lets arrays be allocated by others (NEP 49): allocator.py has
the functions that it is given, compiled, as it calls them whenever such an array dies, up to the interpreter's end. An
array that they have made is like any other, and NumPy itself says when nobody can look at its memory any more, through
whatever view or buffer (tests/pairs/test_fresh.py). An owner in Python under views of it would notice its own end as
well; but arrays that are views cannot be resized.

What is kept: the memory of the arrays that died last, so many of them at most and so many bytes; the oldest goes first.
"""

from __future__ import annotations

import contextvars
import ctypes
import math
import sys
import time
from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy._core import _multiarray_umath as numpy_core  # type: ignore[attr-defined]

from .._system import memory, settings
from .._typing import Array
from . import allocator
from .arrays import address_of

_APART = 21 * memory.CACHE_LINE  # four arrays, and those of the caller at one place, are then far from each other


class _Keeper:
    """The state of the functions, and the context in which NumPy allocates by them.

    NumPy has its allocator in a context variable. It is set in a context of our own, in a copy of which each array is
    made by a single step: nothing else, a signal handler say, ever runs there.
    """

    def __init__(self) -> None:
        self.state = np.zeros(allocator.END, np.int64)
        self.state[allocator.LIMIT] = get_spare_memory()
        self.context = contextvars.Context()
        pointer_of = ctypes.PYFUNCTYPE(ctypes.c_void_p, ctypes.py_object, ctypes.c_char_p)(
            ("PyCapsule_GetPointer", ctypes.pythonapi)
        )
        capsule_of = ctypes.PYFUNCTYPE(ctypes.py_object, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_void_p)(
            ("PyCapsule_New", ctypes.pythonapi)
        )
        # Where import_array() of NumPy's C interface finds it.
        table = (ctypes.c_void_p * 306).from_address(pointer_of(numpy_core._ARRAY_API, None))
        set_handler = ctypes.PYFUNCTYPE(ctypes.py_object, ctypes.py_object)(table[304] or 0)
        get_handler = ctypes.PYFUNCTYPE(ctypes.py_object)(table[305] or 0)
        numpys = allocator.Handler.from_address(pointer_of(self.context.run(get_handler), b"mem_handler"))
        self.state[allocator.ALLOCATE], self.state[allocator.RELEASE] = numpys.functions[0], numpys.functions[3]
        self._trim = ctypes.PYFUNCTYPE(None, *[ctypes.c_int64] * 2)(allocator.TRIM.compiled)
        # The capsule keeps neither alive, not even its name.
        self._name = ctypes.create_string_buffer(b"mem_handler")
        self._handler = allocator.Handler(
            b"collide", 1, address_of(self.state), tuple(f.compiled for f in allocator.FUNCTIONS)
        )
        capsule = capsule_of(ctypes.addressof(self._handler), ctypes.addressof(self._name), None)
        self.context.run(set_handler, capsule)
        self.seen = -math.inf

    def arrays(self, count: int, shape: tuple[int, ...], dtype: np.dtype[Any], place: int) -> list[Array]:
        now = time.monotonic()
        if now - self.seen > _LOOK_EVERY:
            self.set_limit(0 if memory.free() < memory.installed() // _SHARE else get_spare_memory())
            self.seen = now
        arrays = []
        for _ in range(count):
            place += _APART
            self.state[allocator.PLACE] = place
            arrays.append(self.context.copy().run(np.empty, shape, dtype))
        return arrays

    def set_limit(self, limit: int) -> None:
        if limit != self.state[allocator.LIMIT]:
            self.state[allocator.LIMIT] = limit
            self._trim(address_of(self.state), 0)


_SHARE = 16  # of the memory that may be kept; and nothing is where less than such a share is free
_LOOK_EVERY = 0.25  # seconds: to ask what is free takes 0.05 ms
_the: dict[str, _Keeper] = {}  # by "keeper", the one: whoever comes first, all others take it
_limit: int | None = None


def _keeper() -> _Keeper:
    if "keeper" not in _the:
        made = _Keeper()
        if _the.setdefault("keeper", made) is made:
            # Arrays may die after this module, at the end of the interpreter: what they need never does.
            ctypes.PYFUNCTYPE(None, ctypes.py_object)(("Py_IncRef", ctypes.pythonapi))([made, allocator.FUNCTIONS])
    return _the["keeper"]


def _is_ours_to_choose() -> bool:
    """Whether we may allocate: the user has no allocator, and NumPy frees under the GIL, as our functions need it."""
    return numpy_core.get_handler_name() == "default_allocator" and getattr(sys, "_is_gil_enabled", lambda: True)()


def fresh(count: int, shape: tuple[int, ...], dtype: np.dtype[Any], inputs: Iterable[Array] = ()) -> list[Array]:
    """New arrays. Large ones have the offset from a cache line that the first of the inputs of this dtype has.

    Streaming stores need outputs that agree, and a step's loads are then whole lines as well: inputs at an odd 16
    bytes, NumPy's usual, under outputs on a line cost a sixth of the speed, a quarter in polar form. And they lie at
    different places of a page, as columns at the same place would throw each other out of the nearest cache: to NumPy's
    large arrays, the usual inputs, that happens.
    """
    if math.prod(shape) * dtype.itemsize < allocator.LARGE or not _is_ours_to_choose():
        return [np.empty(shape, dtype) for _ in range(count)]
    near = next((address_of(a) for a in inputs if a.size and a.dtype == dtype), 0)
    return _keeper().arrays(count, shape, dtype, near)


def get_spare_memory() -> int:
    """Get how many bytes of results that are no longer in use may be kept for the next ones.

    Returns
    -------
    int
        What `set_spare_memory` was given last. At first it is the environment variable COLLIDE_SPARE_MEMORY, else a
        sixteenth of the memory that the process may use.

    Raises
    ------
    ValueError
        If the environment variable is no integer, or below 0.

    See Also
    --------
    set_spare_memory : Change it.

    Notes
    -----
    Of large results only, the last 16 at most; nothing when a call finds that memory is short.

    Examples
    --------
    >>> collide.get_spare_memory() >= 0
    True
    """
    global _limit
    if _limit is None:
        given = settings.of_environment("COLLIDE_SPARE_MEMORY", least=0)
        _limit = memory.installed() // _SHARE if given is None else given
    return _limit


def set_spare_memory(n_bytes: int) -> None:
    """Set how many bytes of results that are no longer in use may be kept for the next ones; what is beyond is freed.

    Parameters
    ----------
    n_bytes : int
        At least 0, which keeps nothing.

    Raises
    ------
    TypeError
        If it is no integer.
    ValueError
        If it is below 0.

    See Also
    --------
    get_spare_memory : What it is now.

    Examples
    --------
    >>> kept = collide.get_spare_memory()
    >>> collide.set_spare_memory(0)
    >>> collide.set_spare_memory(kept)
    """
    global _limit
    _limit = min(settings.integer("n_bytes", n_bytes, least=0), allocator.MOST)
    if "keeper" in _the:
        _the["keeper"].set_limit(_limit)


class Scratch:
    """One piece of memory for many arrays, each on a cache line."""

    def __init__(self, size: int) -> None:
        (self._memory,) = fresh(1, (size + memory.CACHE_LINE,), np.dtype(np.uint8))
        self._at = -address_of(self._memory) % memory.CACHE_LINE

    def take(self, n: int, dtype: Any) -> Array:
        size = n * np.dtype(dtype).itemsize
        array: Array = self._memory[self._at : self._at + size].view(dtype)
        self._at += -(-size // memory.CACHE_LINE) * memory.CACHE_LINE
        return array
