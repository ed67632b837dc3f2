"""The search for contacts as a whole: grids laid out, balls sorted into them, contacts counted and then listed.

Noted and counted first, so that nothing but the list itself grows with it. Every pass runs on all threads; the order of
the list is that of the slots, and within a slot that of the balls' numbers, on any number of threads.
"""

from __future__ import annotations

import contextlib
import functools
import math
import os
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from . import _threads
from ._grid import ARRANGE, BALL, BLOCK, CHUNK, FAR, GRID, LEEWAY, LEVELS, LIST, PLACE, SEARCH, SPREAD, SURVEY
from ._lanes import LINE
from ._memory import WINDOW

Array = np.ndarray[Any, np.dtype[Any]]
Bounds = tuple[float, float]  # the least and the largest

# A grid of more cells than this a ball is folded onto half of that.
_CELLS_A_BALL = 4.0
# A bucket is sorted in the cache: it has 2**13 slots, or more where there would be more than 2**10 buckets to fill.
_BUCKET_BITS, _BUCKETS_BITS = 13, 10
_WORK = 4  # a ball takes as long as so many pairs of a batch


class _Level(NamedTuple):
    """The balls of one grid."""

    number: int
    balls: int
    radius: float  # the largest


def contacts(
    x: Array, y: Array, radius: Array, bounds: tuple[Bounds, Bounds, Bounds], box: tuple[float, float], margin: float
) -> tuple[Array, Array]:
    """The numbers i < j of the balls that touch.

    The facade has checked the arguments; bounds are those of x, y and radius, and a box of (0, 0) is none.
    """
    n, (_, largest) = x.size, bounds[2]
    if n < 2:
        return np.empty(0, np.intp), np.empty(0, np.intp)
    grids, which, n_slots = _lay_out(_levels(radius, bounds[2], margin, n), bounds[:2], box, margin)

    shift = max(_BUCKET_BITS, n_slots.bit_length() - _BUCKETS_BITS)
    n_noted = -(-n // BLOCK) * BLOCK
    room = _Room(n * (3 * 8 + 3 * 4) + n_noted * BALL.itemsize + n_slots * 4)
    slots = room.take(n, np.int32)
    counts = np.zeros(((n - 1) // CHUNK + 1, (n_slots - 1 >> shift) + 1), np.int64)
    place = partial(PLACE.compiled, x, y, radius, largest, margin, *box, which, grids, shift, slots, counts)
    _threads.run(place, n, CHUNK, _WORK)

    # Bucket by bucket, and in a bucket chunk by chunk: so the balls keep their order.
    offsets = np.ascontiguousarray(np.cumsum(counts.T).reshape(counts.T.shape).T - counts)
    buckets = np.append(offsets[0], n)
    balls = room.take(n_noted, BALL)
    _threads.run(partial(SPREAD.compiled, x, y, radius, *box, slots, shift, offsets, balls), n, CHUNK, _WORK)

    x, y, radius = (room.take(n + WINDOW, np.float64) for _ in range(3))
    index, ends = room.take(n + WINDOW, np.int32), room.take(n_slots + 1, np.int32)
    ends[0] = 0
    arrange = partial(ARRANGE.compiled, balls, buckets, shift, ends, x, y, radius, index, slots)
    _threads.run(arrange, n_slots, 1 << shift, max(1, _WORK * n // n_slots))

    find = x, y, radius, index, slots, ends, grids, margin, *box
    # The notes lie where the unsorted balls lay.
    first, second = balls.view(np.int32).reshape(2, -1)
    totals, most = np.zeros((n - 1) // BLOCK + 2, np.int64), _most_contacts()
    found = _threads.run(partial(SEARCH.compiled, *find, most, totals, first, second), n, BLOCK, _WORK)
    if min(found) < 0 or sum(found) > most:
        raise MemoryError(f"more than {most:,} contacts: a list of them does not fit into this machine's memory")
    np.cumsum(totals, out=totals)
    i, j = np.empty(totals[-1], np.int64), np.empty(totals[-1], np.int64)
    _threads.run(partial(LIST.compiled, *find, totals, first, second, i, j), n, BLOCK, _WORK)
    room.leave()
    return i, j


def _levels(radius: Array, bounds: Bounds, margin: float, n: int) -> list[_Level]:
    least, largest = bounds
    if least + 0.5 * margin >= 0.5 * (largest + 0.5 * margin):
        return [_Level(0, n, largest)]

    def survey(start: int, stop: int) -> tuple[Array, Array]:
        balls, radii = np.zeros(LEVELS, np.int64), np.zeros(LEVELS)
        SURVEY.compiled(radius, largest, margin, balls, radii, start, stop)
        return balls, radii

    shares = _threads.run(survey, n)
    balls, radii = np.sum([share[0] for share in shares], axis=0), np.max([share[1] for share in shares], axis=0)
    return [_Level(k, int(balls[k]), float(radii[k])) for k in range(LEVELS) if balls[k]]


def _lay_out(
    levels: list[_Level], bounds: tuple[Bounds, Bounds], box: tuple[float, float], margin: float
) -> tuple[Array, Array, int]:
    """A grid for each level, the number of the grid for each level's number, and the number of slots in all."""
    grids, which, n_slots = np.zeros(len(levels), GRID), np.zeros(LEVELS, np.int64), 0
    for g, level in enumerate(levels):
        # No smaller than what the squares of its distances can tell from 0.
        cell = max(2.0 * level.radius + margin, 2.0**-520) * (1.0 + LEEWAY)
        layout = _periodic(cell, box, level.balls) if box[0] else _open(cell, bounds, level.balls)
        which[level.number] = g
        grids[g] = *layout, level.radius, n_slots
        n_slots += int(grids[g]["columns"] * grids[g]["rows"])
    return grids, which, n_slots


def _open(cell: float, bounds: tuple[Bounds, Bounds], balls: int) -> tuple[float, ...]:
    """per_x, per_y, x0, y0, columns, rows for balls within these bounds."""
    far = max(abs(bound) for pair in bounds for bound in pair)
    if far > FAR * cell:
        cell = math.ldexp(1.0, math.frexp(max(cell, far * 2.0**-900))[1])
    low, high = ([math.floor(pair[k] / cell) for pair in bounds] for k in (0, 1))
    # One more on either side: then no neighbour lies beyond the border, where looking takes longer.
    wanted = [float(b - a + 3) for a, b in zip(low, high, strict=True)]
    cells = _folded(wanted, balls)
    if cells == wanted:
        return 1.0 / cell, 1.0 / cell, low[0] - 1.0, low[1] - 1.0, *cells
    # Odd: positions that are multiples of a power of two still spread over all cells.
    return 1.0 / cell, 1.0 / cell, 0.0, 0.0, *(n // 2 * 2 + 1 for n in cells)


def _periodic(cell: float, box: tuple[float, float], balls: int) -> tuple[float, ...]:
    """The same for a periodic box: whole cells along each side, and a whole number of turns of the torus."""
    wanted = [max(1.0, min(length / cell // 1.0, FAR)) for length in box]
    cells = [n // math.ceil(n / m) for n, m in zip(wanted, _folded(wanted, balls), strict=True)]
    per = (n // m * m / length for n, m, length in zip(wanted, cells, box, strict=True))
    return *per, 0.0, 0.0, *cells


def _folded(wanted: list[float], balls: int) -> list[float]:
    """Columns and rows of a torus that has not many more cells than there are balls, and no more than wanted."""
    most = _CELLS_A_BALL * balls + LINE
    columns, rows = wanted
    if columns * rows <= most:
        return wanted
    most /= 2.0
    rows = min(rows, math.sqrt(most))
    columns = min(columns, most / rows)
    return [columns // 1.0, min(wanted[1], most / columns) // 1.0]


@functools.cache
def _most_contacts() -> int:
    """As many as fit into the machine's memory."""
    if not hasattr(os, "sysconf"):
        return 1 << 40
    return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") // (2 * np.dtype(np.intp).itemsize)


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
