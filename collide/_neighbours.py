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
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from . import _threads
from ._grid import ARRANGE, BALL, BLOCK, CHUNK, FAR, GRID, LEEWAY, LEVELS, LIST, PLACE, SAMPLE, SEARCH, SPREAD, SURVEY
from ._lanes import LINE
from ._memory import WINDOW

Array = np.ndarray[Any, np.dtype[Any]]
Bounds = tuple[float, float]  # the least and the largest

# A grid of more cells than this a ball is folded onto half of that.
_CELLS_A_BALL = 4.0
_FEW = 64  # cells that any grid may have, and the columns of a twisted one
# A bucket is sorted in the cache: it has 2**13 slots, or more where there would be more than 2**10 buckets to fill.
_BUCKET_BITS, _BUCKETS_BITS = 13, 10
_WORK = 4  # a ball takes as long as so many pairs of a batch
_CONTACT = 2 * np.dtype(np.intp).itemsize
_MANY = 1 << 26  # contacts, a gigabyte: above it Linux is asked whether it has the memory


class _Level(NamedTuple):
    """The balls of one grid."""

    number: int
    balls: int
    radius: float  # the largest


class _Plan(NamedTuple):
    """What is decided of a grid before it is laid out."""

    cell: float
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

    def sample(level: _Level) -> tuple[Array, Array]:
        size = 4.0 * math.sqrt(level.balls) + 256.0
        xs, ys = np.empty((2, int(2.0 * size)))
        share = size / level.balls
        found = SAMPLE.compiled(x, y, radius, largest, margin, *box, level.number, share, xs, ys, 0, n)
        return xs[:found], ys[:found]

    grids, which, n_slots = _lay_out(_levels(radius, bounds[2], margin, n), bounds[:2], box, margin, sample)

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
    totals, most = np.zeros((n - 1) // BLOCK + 2, np.int64), _memory() // _CONTACT
    found = _threads.run(partial(SEARCH.compiled, *find, most, totals, first, second), n, BLOCK, _WORK)
    n_found = sum(found)
    if min(found) < 0 or (n_found > _MANY and n_found > _free_memory() // _CONTACT):
        some = f"more than {most:,}" if min(found) < 0 else f"{n_found:,}"
        raise MemoryError(f"{some} contacts: there is no memory for a list of them")
    np.cumsum(totals, out=totals)
    i, j = np.empty(totals[-1], np.int64), np.empty(totals[-1], np.int64)
    _threads.run(partial(LIST.compiled, *find, totals, first, second, i, j), n, BLOCK, _WORK)
    room.leave()
    return i, j


def _levels(radius: Array, bounds: Bounds, margin: float, n: int) -> list[_Level]:
    least, largest = bounds
    if radius.size == 1 or least + 0.5 * margin > 0.5 * (largest + 0.5 * margin):
        return [_Level(0, n, largest)]

    def survey(start: int, stop: int) -> tuple[Array, Array]:
        balls, radii = np.zeros(LEVELS, np.int64), np.zeros(LEVELS)
        SURVEY.compiled(radius, largest, margin, balls, radii, start, stop)
        return balls, radii

    shares = _threads.run(survey, n)
    balls, radii = np.sum([share[0] for share in shares], axis=0), np.max([share[1] for share in shares], axis=0)
    return [_Level(k, int(balls[k]), float(radii[k])) for k in range(LEVELS) if balls[k]]


def _lay_out(
    levels: list[_Level], bounds: tuple[Bounds, Bounds], box: tuple[float, float], margin: float, sample: Any
) -> tuple[Array, Array, int]:
    """A grid for each level, the number of the grid for each level's number, and the number of slots in all.

    A level whose balls lie far apart has cells to match, or shares the grid of the level before it.
    """
    plans: list[_Plan] = []
    which = np.zeros(LEVELS, np.int64)
    far = max(abs(bound) for pair in bounds for bound in pair)
    for level in levels:
        # No smaller than what the squares of its distances can tell from 0, and than what float64 can count.
        cell = max((2.0 * level.radius + margin) * (1.0 + LEEWAY), 2.0**-520, far * 2.0**-900)
        if plans and math.prod(_cells(cell, bounds, box)) > _CELLS_A_BALL * level.balls + _FEW:
            cell = _coarsened(cell, plans[-1].cell, level.balls, *sample(level))
        if plans and 2.0 * cell > plans[-1].cell:
            plans[-1] = plans[-1]._replace(balls=plans[-1].balls + level.balls)
        else:
            plans.append(_Plan(cell, level.balls, level.radius))
        which[level.number] = len(plans) - 1
    grids, n_slots = np.zeros(len(plans), GRID), 0
    for g, plan in enumerate(plans):
        layout = _periodic(plan, bounds, box) if box[0] else _open(plan, bounds, box)
        grids[g] = *layout, plan.radius, n_slots
        n_slots += int(grids[g]["columns"] * grids[g]["rows"])
    return grids, which, n_slots


def _coarsened(cell: float, limit: float, balls: int, xs: Array, ys: Array) -> float:
    """The cell, doubled as long as a ball shares it with one other at most on average, and up to the limit.

    A ball that looks into this grid from another would have too many cells to look at. The sample, of some 4 sqrt(n)
    balls, has 8 pairs that share a cell by then.
    """
    least, most = 0, math.frexp(limit)[1] - math.frexp(cell)[1]
    while least < most:
        middle = (least + most + 1) // 2
        width = math.ldexp(cell, middle)
        _, counts = np.unique(np.floor(xs / width) + 1j * np.floor(ys / width), return_counts=True)
        shared = float((counts * (counts - 1.0)).sum()) * balls > float(xs.size) ** 2
        least, most = (least, middle - 1) if shared else (middle, most)
    return math.ldexp(cell, least)


def _cells(cell: float, bounds: tuple[Bounds, Bounds], box: tuple[float, float]) -> list[float]:
    """Columns and rows of a grid that has no need to be folded.

    In open space one more on either side: then no neighbour lies beyond the border, where looking takes longer.
    """
    if box[0]:
        return [max(1.0, min(length / cell // 1.0, FAR)) for length in box]
    return [float(math.floor(high / cell) - math.floor(low / cell) + 3) for low, high in bounds]


def _open(plan: _Plan, bounds: tuple[Bounds, Bounds], box: tuple[float, float]) -> tuple[float, ...]:
    """per_x, per_y, x0, y0, columns, rows, twist of a grid in open space."""
    far, cell = max(abs(bound) for pair in bounds for bound in pair), plan.cell
    if far > FAR * cell:
        cell = math.ldexp(1.0, math.frexp(cell)[1])
    columns, rows = _cells(cell, bounds, box)
    if columns * rows <= _CELLS_A_BALL * plan.balls + _FEW:
        low = (math.floor(pair[0] / cell) - 1.0 for pair in bounds)
        return 1.0 / cell, 1.0 / cell, *low, columns, rows, 0.0
    # Few columns, and a turn around them ends somewhere else: then no line has all its balls in a few cells.
    height = int(_CELLS_A_BALL / 2.0 * plan.balls / _FEW) | 1
    return 1.0 / cell, 1.0 / cell, 0.0, 0.0, float(_FEW), float(height), _twist(height)


def _periodic(plan: _Plan, bounds: tuple[Bounds, Bounds], box: tuple[float, float]) -> tuple[float, ...]:
    """The same for a periodic box: whole cells along each side, and a side is a whole number of turns of the torus."""
    columns, rows = _cells(plan.cell, bounds, box)
    twist = 0.0
    turns_x, turns_y = 1.0, 1.0
    if columns * rows > _CELLS_A_BALL * plan.balls + _FEW:
        most = _CELLS_A_BALL / 2.0 * plan.balls
        width = min(columns, max(float(_FEW), most / rows // 1.0))
        height = max(1.0, min(rows, most / width // 1.0))
        # The turns around the columns end where they began after a part of them, and with that after all.
        turns_x = columns // width
        order = height // math.ceil(height / turns_x)
        turns_x, height = turns_x // order * order, height // order * order
        turns_y = rows // height
        columns, rows, twist = width, height, height // order * _twist(int(order))
    per_x, per_y = columns * turns_x / box[0], rows * turns_y / box[1]
    return per_x, per_y, 0.0, 0.0, columns, rows, twist


def _twist(order: int) -> float:
    """A number without a common divisor with the order, a golden section of it: its multiples lie far apart."""
    return float(next((t for t in range(int(0.618 * order), order) if math.gcd(t, order) == 1), 0))


@functools.cache
def _memory() -> int:
    """The bytes that the machine has, or the control group grants; a very large number where neither says."""
    limits = [1 << 48]
    if hasattr(os, "sysconf"):
        limits.append(os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE"))
    with contextlib.suppress(OSError, ValueError):  # "max" is no number
        limits.append(int(Path("/sys/fs/cgroup/memory.max").read_text()))
    return min(limits)


def _free_memory() -> int:
    """Those of them that Linux would give now."""
    with contextlib.suppress(OSError, ValueError, IndexError):
        return min(_memory(), 1024 * int(Path("/proc/meminfo").read_text().split("MemAvailable:")[1].split()[0]))
    return _memory()


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
