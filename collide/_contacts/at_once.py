"""The whole search in one compiled call on the caller's thread, which for few balls takes a third of the time.

The steps are those of search.py, but all balls are in one grid, whatever their sizes. So this is not for small balls by
the hundred in each cell of a large one, nor for many contacts, for which it has no room.
"""

from __future__ import annotations

import numpy as np
from numba import types

from .._compile import kept_memory
from .._compile.gather import WINDOW
from .._compile.kernel import Kernel
from .._typing import Array
from .grid import BLOCK, GRID, GRIDS, IN, INT32, OUT, marked, rank, slot_of, walk
from .layout import Bounds, most_slots, smallest_cell, torus_of
from .torus import wrap

# Balls. Of twice as many this still takes no longer than two threads, where waking one takes 40 us; many threads, or
# such as wake sooner, are worth having from here on.
MOST = 1 << 15
_CROWD = 1 << 17  # pairs that share a cell: to compare more takes longer than a grid for each size


def _kernel_at_once(  # type: ignore[no-untyped-def]  # compiled only
    x, y, radius, x_low, x_high, y_low, y_high, largest, margin, lx, ly, grids, memory, numbers, room
):
    """Puts the contacts into `numbers`, i from 0 and j from `room` on; returns how many there are.

    -1 where they have no room, or balls are too crowded for one grid.
    """
    n, bounds, box = x.size, ((x_low, x_high), (y_low, y_high)), (lx, ly)
    torus = torus_of(smallest_cell(2.0 * largest + margin, bounds, box), n, bounds, box)
    grid = grids[0]
    grid.per_x, grid.per_y, grid.x0, grid.y0, grid.columns, grid.rows, grid.twist = torus
    grid.radius, grid.slot = largest, 0
    n_slots = int(grid.columns * grid.rows)
    if n * n > _CROWD * n_slots:
        return -1

    pairs, rest = (numbers[:room], numbers[room : 2 * room]), numbers[2 * room :]
    marks, slots, index, starts = rest[:n], rest[n : 2 * n], rest[2 * n : 3 * n + WINDOW], rest[3 * n + WINDOW :]
    xs, ys, radii = memory[: n + WINDOW], memory[n + WINDOW : 2 * (n + WINDOW)], memory[2 * (n + WINDOW) :]
    for k in range(n):
        marks[k] = marked(*slot_of(x[k], y[k], box, torus))
    starts[0], crowd = 0, 0
    rank(marks, 0, n, starts, 0, n_slots, index)
    for s in range(n_slots):
        crowd += (starts[s + 1] - starts[s]) ** 2
    if crowd > _CROWD:
        return -1
    each = 1 if radius.size > 1 else 0
    for p in range(n):
        k = index[p]
        xs[p], ys[p], radii[p], slots[p] = wrap(x[k], lx), wrap(y[k], ly), radius[k * each], marks[k]

    balls, limits, found = (xs, ys, radii, index), (margin, lx, ly), 0
    for p in range(0, n, BLOCK):
        found = walk(balls, limits, slots, starts, grids, p, min(p + BLOCK, n), pairs, found, room)
        if found > room - WINDOW:
            return -1
    return found


def contacts(
    x: Array, y: Array, radius: Array, bounds: tuple[Bounds, Bounds, Bounds], box: tuple[float, float], margin: float
) -> tuple[Array, Array] | None:
    """The numbers i < j of the balls that touch, in the order of search.py; None where this is not the way."""
    n = x.size
    if n > MOST:
        return None
    room, n_floats = 4 * n + 64, 3 * (n + WINDOW)
    n_integers = 2 * room + 3 * n + WINDOW + most_slots(n) + 1
    (memory,) = kept_memory.fresh(1, (n_floats + (n_integers + 1) // 2,), np.dtype(np.float64))
    numbers = memory[n_floats:].view(np.int32)
    extent = *bounds[0], *bounds[1], bounds[2][1]
    found = _AT_ONCE.compiled(x, y, radius, *extent, margin, *box, np.empty(1, GRID), memory, numbers, room)
    if found < 0:
        return None
    i, j = kept_memory.fresh(2, (found,), np.dtype(np.int64))
    i[:], j[:] = numbers[:found], numbers[room : room + found]
    return i, j


_AT_ONCE = Kernel(
    _kernel_at_once, types.int64(IN, IN, IN, *[types.float64] * 8, GRIDS, OUT, INT32, types.int64), "_kernel_at_once"
)
