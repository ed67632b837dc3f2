"""The kernels behind find_contacts: balls sorted by cell, then each ball against those in the cells around it.

Balls within a factor of two in size share a grid, with cells as wide as two of its largest balls reach, or as its balls
lie apart where they are sparse; a ball looks into its own grid and into all finer ones. In a row of cells the balls lie
side by side, so three cells are one range, of which lanes take several balls at a time. A grid is a torus (torus.py):
one that would need many more cells than it has balls has fewer slots, and a ball in the far distance shares a slot with
others, which costs a comparison. A periodic box is a torus anyway.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import from_dtype, types

from .._compile.gather import WINDOW, put_pairs, window
from .._compile.kernel import Kernel
from .._compile.lanes import count, leading
from .._compile.options import compiles, formula, rare
from .torus import column_and_row, span, touching, wrap

LEVELS = 32  # sizes below 2**-31 of the largest share the last grid
CHUNK = 1 << 13  # balls that are brought into the order of slots together
BLOCK = 1 << 6  # balls whose contacts are counted together
ROOM = 4 * BLOCK  # contacts of a block that can be noted
# A grid: cells per length, the cell before the first, columns, rows and twist; the largest radius in it; its first slot
# among those of all grids.
GRID = np.dtype(
    [(name, "f8") for name in ("per_x", "per_y", "x0", "y0", "columns", "rows", "twist", "radius")] + [("slot", "i8")]
)
# What holds for all balls: the largest radius, the margin of what counts as touching, the sides of the box, 0 if open.
COMMON = np.dtype([(name, "f8") for name in ("largest", "margin", "lx", "ly")])
BALL = np.dtype([("x", "f8"), ("y", "f8"), ("radius", "f8"), ("index", "i4"), ("slot", "i4")])


@formula
def _level(radius: Any, largest: Any, margin: Any) -> int:
    """How many powers of two the size of a ball, half the margin included, is below the largest: 0 above half of it."""
    size, bound, level = radius + 0.5 * margin, 0.5 * (largest + 0.5 * margin), 0
    while size <= bound and level < LEVELS - 1:
        level += 1
        bound *= 0.5
    return level


def _survey(radius, common, balls, reach, start, stop):  # type: ignore[no-untyped-def]  # compiled only
    """How many balls there are on each level, and the largest radius."""
    largest, margin = common[0].largest, common[0].margin
    for k in range(start, stop):
        level = _level(radius[k], largest, margin)
        balls[level] += 1
        reach[level] = max(reach[level], radius[k])


def _sample(x, y, radius, common, level, chance, xs, ys, start, stop):  # type: ignore[no-untyped-def]  # compiled only
    """Positions of a random share of the balls of a level, as far as there is room; returns how many."""
    largest, margin, lx, ly = common[0].largest, common[0].margin, common[0].lx, common[0].ly
    n = 0
    for k in range(start, stop):
        # Chance decides on each ball. To take every tenth, say, would not do: where the balls are in the order of their
        # cells, those are farther apart than balls picked by chance.
        z = (np.uint64(k) + np.uint64(1)) * np.uint64(0x9E3779B97F4A7C15)
        z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
        z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
        picked = (z >> np.uint64(11)) * 2.0**-53 < chance and n < xs.size
        if picked and (radius.size == 1 or _level(radius[k], largest, margin) == level):
            xs[n], ys[n] = wrap(x[k], lx), wrap(y[k], ly)
            n += 1
    return n


def _place(x, y, radius, common, which, grids, shift, slots, counts, start, stop):  # type: ignore[no-untyped-def]  # compiled only
    """The slot of each ball, marked, and how many balls of each chunk fall into each bucket."""
    largest, margin, lx, ly = common[0].largest, common[0].margin, common[0].lx, common[0].ly
    g = -1
    for chunk in range(start // CHUNK, (stop - 1) // CHUNK + 1):
        tally = counts[chunk]
        for k in range(chunk * CHUNK, min((chunk + 1) * CHUNK, stop)):
            own = which[_level(radius[k], largest, margin)] if radius.size > 1 else 0
            if own != g:
                g = own
                grid = grids[g]
                per_x, x0, columns = grid.per_x, grid.x0, grid.columns
                per_y, y0, rows = grid.per_y, grid.y0, grid.rows
                begin, twist = grid.slot, grid.twist
            slot, inside = slot_of(x[k], y[k], (lx, ly), (per_x, per_y, x0, y0, columns, rows, twist))
            slots[k] = marked(begin + slot, inside)
            tally[(begin + slot) >> shift] += 1


@formula
def slot_of(x: Any, y: Any, box: Any, torus: Any) -> tuple[Any, Any]:
    """The slot of a grid in which a place is, and whether that is off the border."""
    per_x, per_y, x0, y0, columns, rows, twist = torus
    cell_x, cell_y = np.floor(wrap(x, box[0]) * per_x) - x0, np.floor(wrap(y, box[1]) * per_y) - y0
    column, row = column_and_row(cell_x, cell_y, columns, rows, twist)
    inside = (column > 0.0) & (column < columns - 1.0) & (row > 0.0) & (row < rows - 1.0)
    return int(row * columns + column), inside


@formula
def marked(slot: Any, inside: Any) -> Any:
    """~slot on the border of a grid, where neighbours may be at its other end."""
    return slot if inside else ~slot


@formula
def _slot(mark: Any) -> Any:
    """The slot that is marked."""
    return mark ^ (mark >> 31)


def _spread(x, y, radius, common, slots, shift, offsets, balls, start, stop):  # type: ignore[no-untyped-def]  # compiled only
    """Balls into their buckets, in the order of their numbers."""
    lx, ly = common[0].lx, common[0].ly
    each = 1 if radius.size > 1 else 0
    for chunk in range(start // CHUNK, (stop - 1) // CHUNK + 1):
        at = offsets[chunk]
        for k in range(chunk * CHUNK, min((chunk + 1) * CHUNK, stop)):
            bucket = _slot(slots[k]) >> shift
            ball = balls[at[bucket]]
            at[bucket] += 1
            ball.x, ball.y, ball.radius = wrap(x[k], lx), wrap(y[k], ly), radius[k * each]
            ball.index, ball.slot = k, slots[k]


def _arrange(balls, buckets, shift, starts, x, y, radius, index, slots, start, stop):  # type: ignore[no-untyped-def]  # compiled only
    """Sorts the balls of the buckets that hold slots start to stop: those of slot s are starts[s] : starts[s + 1]."""
    for bucket in range(start >> shift, ((stop - 1) >> shift) + 1):
        lowest, highest = bucket << shift, min((bucket + 1) << shift, starts.size - 1)
        # First where each goes: to move the balls themselves at once, into five arrays, took a fifth longer.
        rank(balls, buckets[bucket], buckets[bucket + 1], starts, lowest, highest, index)
        for p in range(buckets[bucket], buckets[bucket + 1]):
            ball = balls[index[p]]
            x[p], y[p], radius[p], index[p], slots[p] = ball.x, ball.y, ball.radius, ball.index, ball.slot


@formula
def rank(marks: Any, first: Any, stop: Any, starts: Any, lowest: Any, highest: Any, order: Any) -> None:
    """Puts the numbers from first to stop in the order of the slots, lowest to highest, that their marks stand for."""
    for s in range(lowest, highest):
        starts[s + 1] = 0
    for k in range(first, stop):
        starts[_slot(_mark_of(marks, k)) + 1] += 1
    at = first
    for s in range(lowest, highest):
        at, starts[s + 1] = at + starts[s + 1], at
    for k in range(first, stop):
        s = _slot(_mark_of(marks, k))
        order[starts[s + 1]] = k
        starts[s + 1] += 1


def _mark_of(marks: Any, k: Any) -> Any:
    """That of ball k, of marks, or of balls that have them."""
    return marks[k]


@compiles(_mark_of)
def _pick_mark(marks: Any, k: Any) -> Any:
    return (lambda marks, k: marks[k].slot) if isinstance(marks.dtype, types.Record) else _mark_of


def _search(x, y, radius, index, slots, starts, grids, common, most, totals, noted_i, noted_j, start, stop):  # type: ignore[no-untyped-def]  # compiled only
    """Counts the contacts of each block of balls and notes them, in so far as the block's part of the notes has room.

    Returns how many there are, or -1 where there are more than `most`.
    """
    limits = common[0].margin, common[0].lx, common[0].ly
    n_found = 0
    for block in range(start // BLOCK, (stop - 1) // BLOCK + 1):
        p, last, at = block * BLOCK, min((block + 1) * BLOCK, stop), block * ROOM
        end = walk((x, y, radius, index), limits, slots, starts, grids, p, last, (noted_i, noted_j), at, at + ROOM)
        totals[block + 1] = end - at
        n_found += end - at
        if n_found > most:
            return -1
    return n_found


def _list(x, y, radius, index, slots, starts, grids, common, totals, noted_i, noted_j, i, j, start, stop):  # type: ignore[no-untyped-def]  # compiled only
    """The contacts of block b at totals[b] to totals[b + 1] of i and j: as noted, or where the room was short, anew."""
    limits = common[0].margin, common[0].lx, common[0].ly
    for block in range(start // BLOCK, (stop - 1) // BLOCK + 1):
        at, end, noted = totals[block], totals[block + 1], block * ROOM
        if end - at <= ROOM - WINDOW:
            for k in range(end - at):
                i[at + k], j[at + k] = noted_i[noted + k], noted_j[noted + k]
        else:
            p, last = block * BLOCK, min((block + 1) * BLOCK, stop)
            walk((x, y, radius, index), limits, slots, starts, grids, p, last, (i, j), at, end + WINDOW)


@rare
def walk(
    balls: Any, limits: Any, slots: Any, starts: Any, grids: Any, p: Any, last: Any, pairs: Any, at: Any, room: Any
) -> Any:
    """The contacts of the balls p to `last`, each with those after it in its own grid and with all in finer ones.

    They are put into the pairs from place `at` on, but not past `room`; returns the place after all of them.
    """
    g = 0
    while p < last:
        while g + 1 < grids.size and p >= starts[grids[g + 1].slot]:
            g += 1
        grid, columns = grids[g], int(grids[g].columns)
        end = last if g + 1 == grids.size else min(last, starts[grids[g + 1].slot])
        while p < end:
            s = slots[p]
            if s >= 0:  # off the border, where three cells of a row are one range
                at = _look(balls, limits, p, p + 1, starts[s + 2], pairs, at, room)
                at = _look(balls, limits, p, starts[s + columns - 1], starts[s + columns + 2], pairs, at, room)
            else:
                at = _around(balls, limits, starts, grid, p, p + 1, pairs, at, room)
            for finer in range(g + 1, grids.size):
                at = _around(balls, limits, starts, grids[finer], p, 0, pairs, at, room)
            p += 1
    return at


@rare
def _around(balls: Any, limits: Any, starts: Any, grid: Any, p: Any, first: Any, pairs: Any, at: Any, room: Any) -> Any:
    """The contacts of ball p with those of a grid that are numbered `first` or above, wherever on the torus it is.

    They lie in a rectangle of cells around it. Each of its rows is one range of slots; or it is two where it passes the
    last column, and its rest goes on from column 0, `twist` rows farther on:

        column      0                      last
        row         .  .  .  .  .  .  [=======]
        row + twist [====]  .  .  .  .  .  .  .
    """
    x, y, radius, _ = balls
    reach = radius[p] + grid.radius + limits[0]
    cell_x, n_columns = span(x[p] * grid.per_x, reach * grid.per_x)
    cell_y, n_rows = span(y[p] * grid.per_y, reach * grid.per_y)
    cell_x, cell_y = column_and_row(cell_x - grid.x0, cell_y - grid.y0, grid.columns, grid.rows, grid.twist)
    column, row, twist = int(cell_x), int(cell_y), int(grid.twist)
    columns, rows = int(grid.columns), int(grid.rows)
    if n_columns >= columns:  # all the way around: each slot of a row once, and with a twist that leads to all rows
        column, n_columns = 0, float(columns)
        if twist > 0:
            n_rows = float(rows)
    n_rest = column + int(n_columns) - columns  # negative where a row does not pass the last column
    for _ in range(int(min(n_rows, float(rows)))):
        if n_rest > 0:
            begin = grid.slot + (row + twist) % rows * columns
            at = _look(balls, limits, p, max(first, starts[begin]), starts[begin + n_rest], pairs, at, room)
        begin = grid.slot + row * columns + column
        stop = starts[begin + int(n_columns) - max(n_rest, 0)]
        at = _look(balls, limits, p, max(first, starts[begin]), stop, pairs, at, room)
        row = row + 1 if row + 1 < rows else 0
    return at


@formula
def _look(balls: Any, limits: Any, p: Any, first: Any, stop: Any, pairs: Any, at: Any, room: Any) -> Any:
    """The contacts of ball p with the balls first to stop; see `walk`."""
    (x, y, radius, index), (margin, lx, ly), (i, j) = balls, limits, pairs
    k = first
    while True:  # also where there are none: most often there are few, and not to ask costs less than a wrong guess
        reach = window(radius, k) + radius[p] + margin
        found = leading(touching(window(x, k) - x[p], window(y, k) - y[p], reach, lx, ly), stop - k)
        if at + WINDOW <= room:
            put_pairs(i, j, at, index, p, k, found)
        at += count(found)
        k += WINDOW
        if k >= stop:
            return at


def _kernel(function: Any, *signature: Any) -> Kernel:
    result, *arguments = signature
    return Kernel(function, result(*arguments, types.int64, types.int64), function.__name__)


def _array(element: Any, ndim: int = 1, readonly: bool = False) -> Any:
    return types.Array(element, ndim, "C", readonly=readonly)


IN, OUT, _NUMBER = _array(types.float64, readonly=True), _array(types.float64), types.float64
INT32, _INT64, _TABLE = _array(types.int32), _array(types.int64), _array(types.int64, 2)
_COMMON, GRIDS, _BALLS = _array(from_dtype(COMMON)), _array(from_dtype(GRID)), _array(from_dtype(BALL))

SURVEY = _kernel(_survey, types.void, IN, _COMMON, _INT64, OUT)
SAMPLE = _kernel(_sample, types.int64, IN, IN, IN, _COMMON, types.int64, _NUMBER, OUT, OUT)
PLACE = _kernel(_place, types.void, IN, IN, IN, _COMMON, _INT64, GRIDS, types.int64, INT32, _TABLE)
SPREAD = _kernel(_spread, types.void, IN, IN, IN, _COMMON, INT32, types.int64, _TABLE, _BALLS)
ARRANGE = _kernel(_arrange, types.void, _BALLS, _INT64, types.int64, INT32, *[OUT] * 3, INT32, INT32)
_SORTED = (*[OUT] * 3, *[INT32] * 3, GRIDS, _COMMON)
SEARCH = _kernel(_search, types.int64, *_SORTED, types.int64, _INT64, INT32, INT32)
LIST = _kernel(_list, types.void, *_SORTED, _INT64, INT32, INT32, _INT64, _INT64)
