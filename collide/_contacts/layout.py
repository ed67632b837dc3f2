"""The geometry of a search: a grid for each size of balls, in open space or in a box, folded to a torus if need be."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from .._system import threads
from .._typing import Array
from .grid import GRID, LEVELS, SURVEY
from .torus import FAR, LEEWAY

Bounds = tuple[float, float]  # the least and the largest
Sample = Callable[["Level"], tuple[Array, Array]]  # the cells of some balls of a level

# A grid of more cells than this a ball is folded onto half of that.
_CELLS_A_BALL = 4.0
_FEW = 64  # cells that any grid may have, and the columns of a twisted one


class Level(NamedTuple):
    """The balls of one grid."""

    number: int
    balls: int
    radius: float  # the largest


class _Plan(NamedTuple):
    """What is decided of a grid before it is laid out."""

    cell: float
    balls: int
    radius: float  # the largest


def levels_of(radius: Array, least: float, common: Array, n: int) -> list[Level]:
    """The levels of size that hold balls, largest first; one if all are within about a factor of two."""
    largest, margin = float(common["largest"][0]), float(common["margin"][0])
    if radius.size == 1 or least + 0.5 * margin > 0.5 * (largest + 0.5 * margin):
        return [Level(0, n, largest)]

    def survey(start: int, stop: int) -> tuple[Array, Array]:
        balls, radii = np.zeros(LEVELS, np.int64), np.zeros(LEVELS)
        SURVEY.compiled(radius, common, balls, radii, start, stop)
        return balls, radii

    shares = threads.run(survey, n)
    balls, radii = np.sum([share[0] for share in shares], axis=0), np.max([share[1] for share in shares], axis=0)
    return [Level(k, int(balls[k]), float(radii[k])) for k in range(LEVELS) if balls[k]]


def lay_out(
    levels: list[Level],
    bounds: tuple[Bounds, Bounds],
    box: tuple[float, float],
    margin: float,
    sample: Sample,
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
    # Few columns, and a turn around them starts somewhere else: then no line has all its balls in a few cells.
    height = int(_CELLS_A_BALL / 2.0 * plan.balls / _FEW) | 1
    return 1.0 / cell, 1.0 / cell, 0.0, 0.0, float(_FEW), float(height), _twist(height)


def _periodic(plan: _Plan, bounds: tuple[Bounds, Bounds], box: tuple[float, float]) -> tuple[float, ...]:
    """The same for a periodic box, whose sides have to be vectors of the lattice (torus.py): n_x by n_y whole cells.

    (0, n_y) is one where n_y = turns_y rows. (n_x, 0) is one where n_x = turns_x columns, and turns_x twist is a
    multiple of the rows. If there is room for all cells, one turn in both directions is all.
    """
    n_x, n_y = _cells(plan.cell, bounds, box)  # at most, as a cell must not be smaller
    columns, rows, twist, turns_x, turns_y = n_x, n_y, 0.0, 1.0, 1.0
    if n_x * n_y > _CELLS_A_BALL * plan.balls + _FEW:
        slots = _CELLS_A_BALL / 2.0 * plan.balls
        columns = min(n_x, max(float(_FEW), slots / n_y // 1.0))
        rows = max(1.0, min(n_y, slots / columns // 1.0))
        turns_x = n_x // columns
        # A twist of rows / order times a number that has no divisor in common with it comes back to its row after
        # `order` turns, and not sooner. So rows and turns are cut to multiples of the order.
        order = rows // math.ceil(rows / turns_x)
        turns_x, rows = turns_x // order * order, rows // order * order
        twist = rows // order * _twist(int(order))
        turns_y = n_y // rows
    return columns * turns_x / box[0], rows * turns_y / box[1], 0.0, 0.0, columns, rows, twist


def _twist(order: int) -> float:
    """A number without a common divisor with the order, a golden section of it: its multiples lie far apart."""
    return float(next((t for t in range(int(0.618 * order), order) if math.gcd(t, order) == 1), 0))
