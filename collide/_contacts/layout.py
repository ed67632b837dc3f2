"""The geometry of a search: a grid for each size of balls, in open space or in a box, folded to a torus if need be."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from .._compile.elementwise import inverse_power_of_two
from .._compile.options import formula
from .._system import threads
from .._typing import Array
from .grid import GRID, LEVELS, SURVEY
from .torus import FAR, LEEWAY

Bounds = tuple[float, float]  # the least and the largest
Sample = Callable[["Level"], tuple[Array, Array]]  # the cells of some balls of a level

# A grid of more cells than this a ball is folded onto half of that.
_CELLS_A_BALL = 4
_FEW = 64  # cells that any grid may have, and the least columns of a folded one, if there are more


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
    for level in levels:
        cell = smallest_cell(2.0 * level.radius + margin, bounds, box)
        if plans and math.prod(_cells(cell, bounds, box)) > most_slots(level.balls):
            cell = _coarsened(cell, plans[-1].cell, level.balls, *sample(level))
        if plans and 2.0 * cell > plans[-1].cell:
            plans[-1] = plans[-1]._replace(balls=plans[-1].balls + level.balls)
        else:
            plans.append(_Plan(cell, level.balls, level.radius))
        which[level.number] = len(plans) - 1
    grids, n_slots = np.zeros(len(plans), GRID), 0
    for g, plan in enumerate(plans):
        grids[g] = *torus_of(plan.cell, plan.balls, bounds, box), plan.radius, n_slots
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


@formula
def most_slots(balls: Any) -> Any:
    """How many a grid has at most."""
    return _CELLS_A_BALL * balls + _FEW


@formula
def smallest_cell(reach: Any, bounds: Any, box: Any) -> Any:
    """As wide as balls reach, but no smaller than what squares of distances tell from 0, and what float64 can count."""
    far = max(_far(bounds[0], box[0]), _far(bounds[1], box[1]))
    return max(reach * (1.0 + LEEWAY), 2.0**-520, far * 2.0**-900)


@formula
def _far(bounds: Any, side: Any) -> Any:
    """How far out in open space balls lie."""
    return 0.0 if side > 0.0 else max(-bounds[0], bounds[1])


@formula
def _cells(cell: Any, bounds: Any, box: Any) -> Any:
    """Columns and rows of a grid that has no need to be folded."""
    return _axis(cell, bounds[0], box[0])[1], _axis(cell, bounds[1], box[1])[1]


@formula
def _axis(cell: Any, bounds: Any, side: Any) -> tuple[Any, Any, Any]:
    """Along one axis: cells per length, how many there are, up to FAR, and the cell before the first.

    In open space one more on either side: then no neighbour lies beyond the border, where looking takes longer.
    """
    low, high = bounds
    if side > 0.0:
        cells = max(1.0, min(np.floor(side / cell), FAR))  # none smaller than this
        return cells / side, cells, 0.0
    far = _far(bounds, side) > FAR * cell
    per = 0.25 * inverse_power_of_two((cell,)) if far else 1.0 / cell  # no rounding: cells of a power of two
    first, last = np.floor(low * per), np.floor(high * per)
    return per, min(last - first + 3.0, FAR), first - 1.0


@formula
def torus_of(cell: Any, balls: Any, bounds: Any, box: Any) -> tuple[Any, ...]:
    """per_x, per_y, x0, y0, columns, rows, twist of a grid of so many balls, whose cells are no smaller than this.

    The sides of a periodic box have to be vectors of the lattice (torus.py), n_x and n_y whole cells long. (0, n_y) is
    one where n_y = turns_y rows. (n_x, 0) is one where n_x = turns_x columns, and turns_x twist is a multiple of the
    rows. If there is room for all cells, one turn in both directions is all.
    """
    per_x, n_x, x0 = _axis(cell, bounds[0], box[0])
    per_y, n_y, y0 = _axis(cell, bounds[1], box[1])
    if n_x * n_y <= most_slots(balls):
        return per_x, per_y, x0, y0, n_x, n_y, 0.0
    # Few columns, and a turn around them starts somewhere else: then no line has all its balls in a few cells.
    slots = 0.5 * _CELLS_A_BALL * balls
    columns = min(n_x, max(float(_FEW), slots / n_y // 1.0))
    if box[0] == 0.0 and columns < n_x:
        columns = 2.0 / inverse_power_of_two((columns,))  # the power of two below: see column_and_row
    rows = max(1.0, min(n_y, slots / columns // 1.0))
    turns_x = n_x // columns
    # A twist of rows / order times a number that has no divisor in common with it comes back to its row after `order`
    # turns, and not sooner. So rows and turns are cut to multiples of the order.
    order = rows // np.ceil(rows / turns_x)
    while math.gcd(int(order), 210) > 1:  # where cells have numbers of few bits or digits they would share few rows
        order -= 1.0
    rows = rows // order * order
    if box[0] > 0.0:
        per_x = columns * (turns_x // order * order) / box[0]
    if box[1] > 0.0:
        per_y = rows * (n_y // rows) / box[1]
    return per_x, per_y, 0.0, 0.0, columns, rows, rows // order * _twist(order)


@formula
def _twist(order: Any) -> float:
    """A number without a common divisor with the order, a golden section of it: its multiples lie far apart."""
    t = int(0.618 * order)
    while math.gcd(t, int(order)) != 1:
        t += 1
    return float(t)
