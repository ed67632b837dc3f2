"""The search for contacts as a whole: grids laid out, balls sorted into them, contacts counted and then listed.

Contacts are counted before they are listed, so that no memory but the list grows with it. Every pass runs on all
threads; the order of the list is that of the slots, and within a slot that of the balls' numbers, on any number of
threads. Few balls take a shorter way, that of at_once.py.
"""

from __future__ import annotations

import math
from functools import partial

import numpy as np

from .._compile import kept_memory
from .._compile.gather import WINDOW
from .._system import memory, threads
from .._typing import Array
from . import at_once
from .grid import ARRANGE, BALL, BLOCK, CHUNK, COMMON, LIST, PLACE, SAMPLE, SEARCH, SPREAD
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

    The facade has checked the arguments; bounds are those of x, y and radius, and a side of 0 is open.
    """
    n, (least, largest) = x.size, bounds[2]
    if n < 2:
        return np.empty(0, np.intp), np.empty(0, np.intp)
    found = at_once.contacts(x, y, radius, bounds, box, margin)
    if found is not None:
        return found
    balls, common = (x, y, radius), np.array([(largest, margin, *box)], COMMON)

    def sample(level: Level) -> tuple[Array, Array]:
        size = 4.0 * math.sqrt(level.balls) + 256.0
        xs, ys = np.empty((2, int(2.0 * size)))
        found = SAMPLE.compiled(*balls, common, level.number, size / level.balls, xs, ys, 0, n)
        return xs[:found], ys[:found]

    grids, which, n_slots = lay_out(levels_of(radius, least, common, n), bounds[:2], box, margin, sample)
    n_noted = -(-n // BLOCK) * BLOCK
    scratch = kept_memory.Scratch(n * (3 * 8 + 3 * 4) + n_noted * BALL.itemsize + n_slots * 4 + 16 * memory.CACHE_LINE)
    order, unsorted = _by_slot(balls, common, which, grids, n_slots, n_noted, scratch)
    # The notes lie where the unsorted balls lay.
    return _listed((*order, grids, common), n, unsorted.view(np.int32).reshape(2, -1))


def _by_slot(
    balls: tuple[Array, ...],
    common: Array,
    which: Array,
    grids: Array,
    n_slots: int,
    room: int,
    scratch: kept_memory.Scratch,
) -> tuple[tuple[Array, ...], Array]:
    """x, y, radius, number and slot of the balls, sorted by slot; those of slot s are starts[s] : starts[s + 1].

    And the memory through which they went, of `room` balls.
    """
    n = balls[0].size
    shift = max(_BUCKET_BITS, n_slots.bit_length() - _BUCKETS_BITS)
    slots, unsorted = scratch.take(n, np.int32), scratch.take(room, BALL)
    counts = np.zeros(((n - 1) // CHUNK + 1, (n_slots - 1 >> shift) + 1), np.int64)
    threads.run(partial(PLACE.compiled, *balls, common, which, grids, shift, slots, counts), n, CHUNK, _WORK)

    # Bucket by bucket, and in a bucket chunk by chunk: so the balls keep their order.
    offsets = np.ascontiguousarray(np.cumsum(counts.T).reshape(counts.T.shape).T - counts)
    buckets = np.append(offsets[0], n)
    threads.run(partial(SPREAD.compiled, *balls, common, slots, shift, offsets, unsorted), n, CHUNK, _WORK)

    x, y, radius = (scratch.take(n + WINDOW, np.float64) for _ in range(3))
    index, starts = scratch.take(n + WINDOW, np.int32), scratch.take(n_slots + 1, np.int32)
    starts[0] = 0
    arrange = partial(ARRANGE.compiled, unsorted, buckets, shift, starts, x, y, radius, index, slots)
    threads.run(arrange, n_slots, 1 << shift, max(1, _WORK * n // n_slots))
    return (x, y, radius, index, slots, starts), unsorted


def _listed(found_in: tuple[Array, ...], n: int, notes: Array) -> tuple[Array, Array]:
    """The contacts of balls by slot: counted, and noted where there is room, then listed."""
    totals, most = np.zeros((n - 1) // BLOCK + 2, np.int64), memory.installed() // _CONTACT
    found = threads.run(partial(SEARCH.compiled, *found_in, most, totals, *notes), n, BLOCK, _WORK)
    n_found = sum(found)
    if min(found) < 0 or (n_found > _MANY and n_found > memory.free() // _CONTACT):
        some = f"more than {most:,}" if min(found) < 0 else f"{n_found:,}"
        raise MemoryError(f"{some} contacts: there is no memory for a list of them")
    np.cumsum(totals, out=totals)
    i, j = kept_memory.fresh(2, (int(totals[-1]),), np.dtype(np.int64))
    threads.run(partial(LIST.compiled, *found_in, totals, *notes, i, j), n, BLOCK, _WORK)
    return i, j
