"""The search for contacts as a whole: grids laid out, balls sorted into them, contacts counted and then listed.

Noted and counted first, so that nothing but the list itself grows with it. Every pass runs on all threads; the order of
the list is that of the slots, and within a slot that of the balls' numbers, on any number of threads.
"""

from __future__ import annotations

import contextlib
import math
from functools import partial
from typing import Any

import numpy as np

from .._compile.gather import WINDOW
from .._compile.lanes import LINE
from .._system import memory, threads
from .._typing import Array
from .grid import ARRANGE, BALL, BLOCK, CHUNK, LIST, PLACE, SAMPLE, SEARCH, SPREAD
from .layout import Bounds, Level, lay_out, levels_of

# A bucket is sorted in the cache: it has 2**13 slots, or more where there would be more than 2**10 buckets to fill.
_BUCKET_BITS, _BUCKETS_BITS = 13, 10
_WORK = 4  # a ball takes as long as so many pairs of a batch
_CONTACT = 2 * np.dtype(np.intp).itemsize
_MANY = 1 << 26  # contacts, a gigabyte: above it Linux is asked whether it has the memory


def contacts(
    x: Array, y: Array, radius: Array, bounds: tuple[Bounds, Bounds, Bounds], box: tuple[float, float], margin: float
) -> tuple[Array, Array]:
    """The numbers i < j of the balls that touch.

    The facade has checked the arguments; bounds are those of x, y and radius, and a box of (0, 0) is none.
    """
    n, (_, largest) = x.size, bounds[2]
    if n < 2:
        return np.empty(0, np.intp), np.empty(0, np.intp)

    def sample(level: Level) -> tuple[Array, Array]:
        size = 4.0 * math.sqrt(level.balls) + 256.0
        xs, ys = np.empty((2, int(2.0 * size)))
        share = size / level.balls
        found = SAMPLE.compiled(x, y, radius, largest, margin, *box, level.number, share, xs, ys, 0, n)
        return xs[:found], ys[:found]

    grids, which, n_slots = lay_out(levels_of(radius, bounds[2], margin, n), bounds[:2], box, margin, sample)

    shift = max(_BUCKET_BITS, n_slots.bit_length() - _BUCKETS_BITS)
    n_noted = -(-n // BLOCK) * BLOCK
    room = _Room(n * (3 * 8 + 3 * 4) + n_noted * BALL.itemsize + n_slots * 4)
    slots = room.take(n, np.int32)
    counts = np.zeros(((n - 1) // CHUNK + 1, (n_slots - 1 >> shift) + 1), np.int64)
    place = partial(PLACE.compiled, x, y, radius, largest, margin, *box, which, grids, shift, slots, counts)
    threads.run(place, n, CHUNK, _WORK)

    # Bucket by bucket, and in a bucket chunk by chunk: so the balls keep their order.
    offsets = np.ascontiguousarray(np.cumsum(counts.T).reshape(counts.T.shape).T - counts)
    buckets = np.append(offsets[0], n)
    balls = room.take(n_noted, BALL)
    threads.run(partial(SPREAD.compiled, x, y, radius, *box, slots, shift, offsets, balls), n, CHUNK, _WORK)

    x, y, radius = (room.take(n + WINDOW, np.float64) for _ in range(3))
    index, ends = room.take(n + WINDOW, np.int32), room.take(n_slots + 1, np.int32)
    ends[0] = 0
    arrange = partial(ARRANGE.compiled, balls, buckets, shift, ends, x, y, radius, index, slots)
    threads.run(arrange, n_slots, 1 << shift, max(1, _WORK * n // n_slots))

    find = x, y, radius, index, slots, ends, grids, margin, *box
    # The notes lie where the unsorted balls lay.
    first, second = balls.view(np.int32).reshape(2, -1)
    totals, most = np.zeros((n - 1) // BLOCK + 2, np.int64), memory.installed() // _CONTACT
    found = threads.run(partial(SEARCH.compiled, *find, most, totals, first, second), n, BLOCK, _WORK)
    n_found = sum(found)
    if min(found) < 0 or (n_found > _MANY and n_found > memory.free() // _CONTACT):
        some = f"more than {most:,}" if min(found) < 0 else f"{n_found:,}"
        raise MemoryError(f"{some} contacts: there is no memory for a list of them")
    np.cumsum(totals, out=totals)
    i, j = np.empty(totals[-1], np.int64), np.empty(totals[-1], np.int64)
    threads.run(partial(LIST.compiled, *find, totals, first, second, i, j), n, BLOCK, _WORK)
    room.leave()
    return i, j


_LARGEST_SPARE = 1 << 24  # bytes
_spare: list[Array] = []  # one room at most; taken and left without a lock, as a list's own steps are whole


class _Room:
    """One piece of memory for all arrays of a search, each on a cache line, which serves the next search as well.

    Fresh memory costs more than the sort: 10,000 balls took 85 ns each and not 53. Large pieces are given back.
    """

    def __init__(self, size: int) -> None:
        size += 16 * LINE
        self._memory = np.empty(0, np.uint8)
        with contextlib.suppress(IndexError):
            self._memory = _spare.pop()
        if self._memory.size < size:
            self._memory = np.empty(size, np.uint8)
        self._at = -self._memory.ctypes.data % LINE

    def take(self, n: int, dtype: Any) -> Array:
        size = n * np.dtype(dtype).itemsize
        array: Array = self._memory[self._at : self._at + size].view(dtype)
        self._at += -(-size // LINE) * LINE
        return array

    def leave(self) -> None:
        if self._memory.size <= _LARGEST_SPARE:
            _spare[:] = [self._memory]
