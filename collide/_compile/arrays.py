"""What a kernel asks of its arrays before it begins: what they are, and how they lie, alone and to each other."""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types

from .._system.memory import CACHE_LINE
from .._typing import Array
from .lanes import I64, out_of_line
from .options import formula, intrinsic, rare


@intrinsic
def address(typingctx: Any, array: Any) -> Any:
    """Of the first element, as a signed integer: with one that has no sign Numba would compute in float64."""

    def codegen(context: Any, b: Any, sig: Any, args: Any) -> Any:
        return b.ptrtoint(context.make_array(array)(context, b, args[0]).data, I64)

    return types.int64(array), codegen


def address_of(array: Array) -> int:
    """The same for Python. `array.ctypes` imports, which at the end of the interpreter nothing can."""
    place: int = array.__array_interface__["data"][0]
    return place


@intrinsic
def _is_swapped(typingctx: Any, array: Any) -> Any:
    """Whether the numbers of an array are byte-swapped.

    Numba does not tell: it takes a read-only byte-swapped array for a native one. To ask it here, of the objects as
    every C extension of NumPy's sees them, takes a nanosecond; Python needs 0.05 us an array, a tenth of a call of one
    pair in all (test_kernels_know_byte_swapped_arrays).
    """
    descriptor = object.__basicsize__ + 5 * 8  # data, nd, dimensions, strides and base come first
    byte_order = object.__basicsize__ + 8 + 2  # the class of the numbers, kind and type come first

    def codegen(context: Any, b: Any, sig: Any, args: Any) -> Any:
        def look(place: Any, offset: int, kind: Any) -> Any:
            return b.load(b.inttoptr(b.add(place, ir.Constant(I64, offset)), kind.as_pointer()))

        parent = b.ptrtoint(context.make_array(array)(context, b, args[0]).parent, I64)
        order = look(look(parent, descriptor, I64), byte_order, ir.IntType(8))
        return b.icmp_signed("==", order, ir.Constant(order.type, ord(">")))

    return types.boolean(array), codegen


@formula
def overlap(columns: Any, outputs: Any, n_numbers: int) -> int:
    """How the outputs lie to the columns and to each other: 0 apart, 1 some in place; -1 in any other way.

    -1 as well where they are not of one length, but for so many empty columns, which stand for numbers, and where one
    is not what Numba takes it for.
    """
    for a in columns:
        n_numbers -= a.size == 0
        if _is_swapped(a):
            return -1
    if n_numbers != 0:
        return -1
    n, relation = outputs[0].size, 0
    for i in range(len(outputs)):
        u = outputs[i]
        if _is_swapped(u) or u.size != n or (n > 1 and abs(u.strides[0]) < u.itemsize):
            return -1
        for a in columns:
            if a.size != 0:
                met = -1 if a.size != n else _meet(a, u)
                if met < 0:
                    return -1
                relation |= met
        for k in range(i):
            if _meet(outputs[k], u) != 0:
                return -1
    return relation


@formula
def _meet(a: Any, u: Any) -> int:
    """Of two arrays of one length: 0 they share no element, 1 each of a is that of u with its number, -1 otherwise."""
    n, step, start, place = u.size, u.strides[0], address(a), address(u)
    reach, extent = (n - 1) * a.strides[0], (n - 1) * step
    low, lowest = start + min(reach, 0), place + min(extent, 0)
    if low >= lowest + abs(extent) + u.itemsize or lowest >= low + abs(reach) + a.itemsize:
        return 0
    if start == place and reach == extent and a.itemsize == u.itemsize:
        return 1
    if reach == extent:
        between = (place - start) % abs(step)  # as columns of rows
        if between >= a.itemsize and between + u.itemsize <= abs(step):
            return 0
    return -1


@formula
def is_plain(columns: Any) -> bool:
    """Whether all columns are arrays without gaps; only the last may be a number."""
    others = 0
    for c in columns:
        others += c.size == 0 or c.strides[0] != c.itemsize
    last = columns[-1]
    return others == 0 or (others == 1 and last.size == 0)


@formula
def rows_of(outputs: Any) -> int:
    """How the outputs lie: 0 all without gaps; else bit 0, and more where some adjoin.

    Bit c+1: number c and the next are rows of two. Bit c+9: c, a multiple of three, and the next two are rows of three.
    """
    rows, c, item = 0, 0, outputs[0].itemsize
    while c < len(outputs):
        u, w = outputs[c], outputs[min(c + 1, len(outputs) - 1)]
        if u.strides[0] != item:
            rows |= 1
            if u.strides[0] == 2 * item and w.strides[0] == 2 * item and address(w) == address(u) + item:
                rows |= 2 << c
                c += 1
        c += 1
    if len(outputs) % 3 == 0:
        for c in range(0, len(outputs), 3):
            u, v, w = outputs[c], outputs[c + 1], outputs[c + 2]
            steps = u.strides[0] == 3 * item and v.strides[0] == 3 * item and w.strides[0] == 3 * item
            if steps and address(v) == address(u) + item and address(w) == address(v) + item:
                rows |= 512 << c
    return rows


@rare
def lead(outputs: Any, start: int, rows: int) -> int:
    """Pairs from `start` to where a cache line begins in all outputs; -1 where they do not agree on it."""
    out_of_line()
    item, head = outputs[0].itemsize, 0
    for c in range(len(outputs)):
        begins_before = rows >> c
        if len(outputs) % 3 == 0:
            begins_before |= rows >> (c + 8) | rows >> (c + 7)
        if c > 0 and begins_before & 1:
            continue  # it lies in the lines of one before
        step = outputs[c].strides[0]
        own, place = 0, address(outputs[c]) + start * step
        while own * item < CACHE_LINE and (place + own * step) % CACHE_LINE != 0:
            own += 1
        if own * item == CACHE_LINE or (c > 0 and own != head):
            return -1
        head = own
    return head
