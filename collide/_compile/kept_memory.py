"""Memory for large arrays: what dies is kept for the next ones, as fresh memory costs more than a batch does.

The system gives memory page by page, each at its first touch, and for results that a program makes and drops at every
step this is one half to four fifths of the time. NumPy lets arrays be allocated by others (NEP 49): here are the
functions that it is given, compiled, as it calls them whenever such an array dies, up to the interpreter's end. An
array that they have made is like any other, and NumPy itself says when nobody can look at its memory any more, through
whatever view or buffer (tests/pairs/test_fresh.py). An owner in Python under views of it would notice its own end as
well; but arrays that are views cannot be resized.

What is kept: the memory of the arrays that died last, SLOTS of them at most and so many bytes; the oldest goes first.
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
from numba import types
from numba.core import cgutils
from numpy._core import _multiarray_umath as numpy_core  # type: ignore[attr-defined]

from .._system import memory, settings
from .._typing import Array
from .arrays import address_of
from .kernel import Callback
from .lanes import I64
from .options import formula, intrinsic
from .words import words

LARGE = 1 << 17  # bytes: what is smaller comes from the heap, which keeps it itself
SLOTS = 16
_PAGE = 4096  # arrays at the same place of a page share the sets of a cache
_APART = 21 * memory.CACHE_LINE  # four arrays, and those of the caller at one place, are then far from each other
_MOST = 1 << 60  # bytes of an array: sums of some sizes are no overflow
_HEADER = 16  # bytes before an array: where its piece of memory begins, and the size of that
# What the functions find at the address that NumPy hands them, as words of 64 bits: how many bytes may be kept, how
# many are, the place in a page where the next array shall begin, a clock, and NumPy's own functions. Then of each piece
# that is kept its address, or 0, its size, and when it came.
_LIMIT, _KEPT, _PLACE, _CLOCK, _ALLOCATE, _RELEASE, _FIRST = range(7)
_END = _FIRST + 3 * SLOTS


@intrinsic
def _call(typingctx: Any, function: Any, x: Any, y: Any, z: Any) -> Any:
    """The C function at an address, of pointers and sizes; it takes the first it needs."""

    def codegen(context: Any, b: Any, sig: Any, args: Any) -> Any:
        kind = cgutils.ir.FunctionType(I64, [I64] * 3)
        return b.call(b.inttoptr(args[0], kind.as_pointer()), args[1:])

    return types.int64(*[types.int64] * 4), codegen


@intrinsic
def _copy(typingctx: Any, target: Any, source: Any, size: Any) -> Any:
    def codegen(context: Any, b: Any, sig: Any, args: Any) -> Any:
        byte = cgutils.voidptr_t
        cgutils.raw_memcpy(b, b.inttoptr(args[0], byte), b.inttoptr(args[1], byte), args[2], 1)
        return context.get_dummy_value()

    return types.void(*[types.int64] * 3), codegen


@intrinsic
def _clear(typingctx: Any, target: Any, size: Any) -> Any:
    def codegen(context: Any, b: Any, sig: Any, args: Any) -> Any:
        cgutils.memset(b, b.inttoptr(args[0], cgutils.voidptr_t), args[1], 0)
        return context.get_dummy_value()

    return types.void(*[types.int64] * 2), codegen


@formula
def _oldest(state: Any) -> int:
    """The slot of the piece that came first; -1 where nothing is kept."""
    oldest = -1
    for s in range(_FIRST, _END, 3):
        if state[s] != 0 and (oldest < 0 or state[s + 2] < state[oldest + 2]):
            oldest = s
    return oldest


@formula
def _let_go(state: Any, slot: int) -> None:
    _call(state[_RELEASE], 0, state[slot], state[slot + 1])
    state[_KEPT] -= state[slot + 1]
    state[slot] = 0


def _trim(context: int, room: int) -> None:
    """The oldest pieces go until so many bytes more may be kept."""
    state = words(context)
    slot = _oldest(state)
    while slot >= 0 and state[_KEPT] + room > state[_LIMIT]:
        _let_go(state, slot)
        slot = _oldest(state)


def _malloc(context: int, size: int) -> int:
    if size < 0 or size > _MOST:  # it has no sign where it comes from
        return 0
    state, needed, chosen = words(context), size + _HEADER + _PAGE, -1
    for s in range(_FIRST, _END, 3):
        # Not one that is much larger: an array would hold memory that nothing counts.
        fits = state[s] != 0 and needed <= state[s + 1] <= needed + needed // 8
        if fits and (chosen < 0 or state[s + 1] < state[chosen + 1]):
            chosen = s
    if chosen >= 0:
        piece, size = state[chosen], state[chosen + 1]
        state[_KEPT] -= size
        state[chosen] = 0
    else:
        piece, size = _call(state[_ALLOCATE], 0, needed, 0), needed
        if piece == 0:
            _trim(context, _MOST)
            piece = _call(state[_ALLOCATE], 0, needed, 0)
            if piece == 0:
                return 0
    array = piece + _HEADER
    # Aligned for whatever we make, though another call may have asked for another place meanwhile.
    array = (array + (state[_PLACE] - array) % _PAGE) // 8 * 8
    header = words(array - _HEADER)
    header[0], header[1] = piece, size
    return int(array)


def _free(context: int, array: int, size: int) -> None:
    if array == 0:
        return
    state, header = words(context), words(array - _HEADER)
    piece, size = header[0], header[1]
    if not LARGE <= size <= state[_LIMIT]:
        _call(state[_RELEASE], 0, piece, size)
        return
    _trim(context, size)
    slot = -1
    for s in range(_FIRST, _END, 3):
        if state[s] == 0:
            slot = s
    if slot < 0:
        slot = _oldest(state)
        _let_go(state, slot)
    state[_CLOCK] += 1
    state[_KEPT] += size
    state[slot], state[slot + 1], state[slot + 2] = piece, size, state[_CLOCK]


def _calloc(context: int, n: int, item: int) -> int:
    if n < 0 or item < 0 or (item > 0 and n > _MOST // item):
        return 0
    array = _malloc(context, n * item)
    if array != 0:
        _clear(array, n * item)
    return array


def _realloc(context: int, array: int, size: int) -> int:
    again = _malloc(context, size)
    if array != 0 and again != 0:
        header = words(array - _HEADER)
        _copy(again, array, min(size, header[0] + header[1] - array))
        _free(context, array, 0)
    return again


for _function in (_trim, _malloc, _free):
    formula(_function)
_WORD = types.int64
_FUNCTIONS = (  # in NumPy's order
    Callback(_malloc, _WORD(_WORD, _WORD), "kept_malloc"),
    Callback(_calloc, _WORD(_WORD, _WORD, _WORD), "kept_calloc"),
    Callback(_realloc, _WORD(_WORD, _WORD, _WORD), "kept_realloc"),
    Callback(_free, types.void(_WORD, _WORD, _WORD), "kept_free"),
)
_TRIM = Callback(_trim, types.void(_WORD, _WORD), "kept_trim")


class _Handler(ctypes.Structure):
    """NumPy's PyDataMem_Handler."""

    _fields_ = (
        ("name", ctypes.c_char * 127),
        ("version", ctypes.c_uint8),
        ("context", ctypes.c_void_p),
        ("functions", ctypes.c_void_p * 4),
    )


class _Keeper:
    """The state of the functions, and the context in which NumPy allocates by them.

    NumPy has its allocator in a context variable. It is set in a context of our own, in a copy of which each array is
    made by a single step: nothing else, a signal handler say, ever runs there.
    """

    def __init__(self) -> None:
        self.state = np.zeros(_END, np.int64)
        self.state[_LIMIT] = get_spare_memory()
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
        numpys = _Handler.from_address(pointer_of(self.context.run(get_handler), b"mem_handler"))
        self.state[_ALLOCATE], self.state[_RELEASE] = numpys.functions[0], numpys.functions[3]
        self._trim = ctypes.PYFUNCTYPE(None, *[ctypes.c_int64] * 2)(_TRIM.compiled)
        # The capsule keeps neither alive, not even its name.
        self._name = ctypes.create_string_buffer(b"mem_handler")
        self._handler = _Handler(b"collide", 1, address_of(self.state), tuple(f.compiled for f in _FUNCTIONS))
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
            self.state[_PLACE] = place
            arrays.append(self.context.copy().run(np.empty, shape, dtype))
        return arrays

    def set_limit(self, limit: int) -> None:
        if limit != self.state[_LIMIT]:
            self.state[_LIMIT] = limit
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
            ctypes.PYFUNCTYPE(None, ctypes.py_object)(("Py_IncRef", ctypes.pythonapi))([made, _FUNCTIONS])
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
    if math.prod(shape) * dtype.itemsize < LARGE or not _is_ours_to_choose():
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
    _limit = min(settings.integer("n_bytes", n_bytes, least=0), _MOST)
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
