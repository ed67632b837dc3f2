"""An allocator for NumPy that keeps what is freed: the functions that NumPy calls, compiled (NEP 49).

They find their state, words of 64 bits, at the address that NumPy hands them: how many bytes may be kept, how many
are, the place in a page where the next array shall begin, a clock, and NumPy's own functions. Then of each piece that
is kept its address, or 0, its size, and when it came. At most SLOTS pieces are kept; the oldest goes first.
"""

from __future__ import annotations

import ctypes
from typing import Any

from numba import types
from numba.core import cgutils

from .kernel import Callback
from .lanes import I64
from .options import formula, intrinsic
from .words import words

LARGE = 1 << 17  # bytes: what is smaller comes from the heap, which keeps it itself
SLOTS = 16
MOST = 1 << 60  # bytes of an array: sums of some sizes are no overflow
PAGE = 4096  # arrays at the same place of a page share the sets of a cache
HEADER = 16  # bytes before an array: where its piece of memory begins, and the size of that
LIMIT, KEPT, PLACE, _CLOCK, ALLOCATE, RELEASE, FIRST = range(7)
END = FIRST + 3 * SLOTS


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
    for s in range(FIRST, END, 3):
        if state[s] != 0 and (oldest < 0 or state[s + 2] < state[oldest + 2]):
            oldest = s
    return oldest


@formula
def _let_go(state: Any, slot: int) -> None:
    _call(state[RELEASE], 0, state[slot], state[slot + 1])
    state[KEPT] -= state[slot + 1]
    state[slot] = 0


def _trim(context: int, room: int) -> None:
    """The oldest pieces go until so many bytes more may be kept."""
    state = words(context)
    slot = _oldest(state)
    while slot >= 0 and state[KEPT] + room > state[LIMIT]:
        _let_go(state, slot)
        slot = _oldest(state)


def _malloc(context: int, size: int) -> int:
    if size < 0 or size > MOST:  # it has no sign where it comes from
        return 0
    state, needed, chosen = words(context), size + HEADER + PAGE, -1
    for s in range(FIRST, END, 3):
        # Not one that is much larger: an array would hold memory that nothing counts.
        fits = state[s] != 0 and needed <= state[s + 1] <= needed + needed // 8
        if fits and (chosen < 0 or state[s + 1] < state[chosen + 1]):
            chosen = s
    if chosen >= 0:
        piece, size = state[chosen], state[chosen + 1]
        state[KEPT] -= size
        state[chosen] = 0
    else:
        piece, size = _call(state[ALLOCATE], 0, needed, 0), needed
        if piece == 0:
            _trim(context, MOST)
            piece = _call(state[ALLOCATE], 0, needed, 0)
            if piece == 0:
                return 0
    array = piece + HEADER
    # Aligned for whatever we make, though another call may have asked for another place meanwhile.
    array = (array + (state[PLACE] - array) % PAGE) // 8 * 8
    header = words(array - HEADER)
    header[0], header[1] = piece, size
    return int(array)


def _free(context: int, array: int, size: int) -> None:
    if array == 0:
        return
    state, header = words(context), words(array - HEADER)
    piece, size = header[0], header[1]
    if not LARGE <= size <= state[LIMIT]:
        _call(state[RELEASE], 0, piece, size)
        return
    _trim(context, size)
    slot = -1
    for s in range(FIRST, END, 3):
        if state[s] == 0:
            slot = s
    if slot < 0:
        slot = _oldest(state)
        _let_go(state, slot)
    state[_CLOCK] += 1
    state[KEPT] += size
    state[slot], state[slot + 1], state[slot + 2] = piece, size, state[_CLOCK]


def _calloc(context: int, n: int, item: int) -> int:
    if n < 0 or item < 0 or (item > 0 and n > MOST // item):
        return 0
    array = _malloc(context, n * item)
    if array != 0:
        _clear(array, n * item)
    return array


def _realloc(context: int, array: int, size: int) -> int:
    again = _malloc(context, size)
    if array != 0 and again != 0:
        header = words(array - HEADER)
        _copy(again, array, min(size, header[0] + header[1] - array))
        _free(context, array, 0)
    return again


for _function in (_trim, _malloc, _free):
    formula(_function)
_WORD = types.int64
FUNCTIONS = (  # in NumPy's order
    Callback(_malloc, _WORD(_WORD, _WORD), "kept_malloc"),
    Callback(_calloc, _WORD(_WORD, _WORD, _WORD), "kept_calloc"),
    Callback(_realloc, _WORD(_WORD, _WORD, _WORD), "kept_realloc"),
    Callback(_free, types.void(_WORD, _WORD, _WORD), "kept_free"),
)
TRIM = Callback(_trim, types.void(_WORD, _WORD), "kept_trim")


class Handler(ctypes.Structure):
    """NumPy's PyDataMem_Handler."""

    _fields_ = (
        ("name", ctypes.c_char * 127),
        ("version", ctypes.c_uint8),
        ("context", ctypes.c_void_p),
        ("functions", ctypes.c_void_p * 4),
    )
