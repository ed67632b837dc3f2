"""The seeded cases that contestants are given: pairs in each form, and states of disks in the plane."""

from __future__ import annotations

import dataclasses
import functools
import os
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

import collide
from collide._cli.against_numpy import random_pairs
from collide.examples import gas
from collide.examples.neighbours import Neighbours, start

Array = np.ndarray[Any, np.dtype[Any]]
Call = Callable[[], Sequence[Array]]
RESULTS = {"1d": 2, "2d": 4, "3d": 6, "polar": 4, "impact": 1, "impact_3d": 1}
FORMS = tuple(RESULTS)
IMPACTS = ("impact", "impact_3d")
PACKING = 0.4
GAS_TIME_STEP = 0.01  # in which disks of diameter 1 move that far at a speed of 1; their mean square is 2
FILE_PAIRS = int(os.environ.get("COLLIDE_FILE_PAIRS", "10000000"))
STORE_PAIRS = int(os.environ.get("COLLIDE_STORE_PAIRS", "16000000"))


@dataclasses.dataclass(frozen=True)
class Case:
    """Pairs in one form, arrays for the results, and how many threads may work."""

    form: str
    n: int
    threads: int
    columns: tuple[Array, ...]
    out: tuple[Array, ...]


@functools.lru_cache(maxsize=1)  # 10^7 pairs take up to 2.5 GB with their results
def arrays(form: str, n: int) -> tuple[tuple[Array, ...], tuple[Array, ...]]:
    """Seeded pairs in one form, and arrays for their results."""
    columns: Sequence[Array]
    if form in IMPACTS:
        rng = np.random.default_rng(0)
        # Of either one in sixty meets.
        d, size = (2, 50.0) if form == "impact" else (3, 8.0)
        columns = [*rng.uniform(-size, size, (d, n)), *rng.normal(size=(d, n)), rng.uniform(1.0, 2.0, n)]
    else:
        columns = random_pairs(form, n)
    return tuple(c.copy() for c in columns), tuple(np.zeros(n) for _ in range(RESULTS[form]))


def make_case(form: str, n: int) -> Case:
    """For as many threads as collide has at this moment."""
    return Case(form, n, collide.get_num_threads(), *arrays(form, n))


@functools.lru_cache(maxsize=4)
def disks(n: int, mixed: bool = False) -> tuple[Array, Array, Any, float]:
    """Positions, radii and the side of a square: strewn at random, equal, or half the area in disks of a 20th."""
    rng = np.random.default_rng(0)
    radius = np.where(np.arange(n) % 401 == 0, 1.0, 0.05) if mixed else np.ones(n)
    side = np.sqrt((np.pi * radius**2).sum() / PACKING)
    return *rng.uniform(0, side, (2, n)), radius if mixed else 1.0, side


def contacts(order: str) -> tuple[Array, Array, Array, Array]:
    """Those of a million disks, i and j, and their positions, x and y."""
    x, y, radius, _ = disks(1_000_000)
    if order == "cell order":
        sort = np.lexsort((x // 2, y // 2))
        x, y = x[sort], y[sort]
    return *collide.find_contacts(x, y, radius), x, y


def drawn_pairs(d: int, layout: str) -> tuple[Array, Array, Any, Any]:
    """A million balls in pairs at random, i and j, their velocities and normals, in rows or in columns."""
    n = 1_000_000
    rng = np.random.default_rng(0)
    i, j = rng.permutation(n).reshape(2, -1).copy()
    vectors = rng.normal(size=(n, d)), rng.normal(size=(i.size, d))
    v, normals = (a if layout == "rows" else tuple(c.copy() for c in a.T) for a in vectors)
    return i, j, v, normals


def settled_gas(n: int) -> tuple[Array, Array, float]:
    """Positions and velocities of disks between walls, and the side of their box, when the lattice is forgotten."""
    position, v, side = start(n, 0.3, np.random.default_rng(0))
    near = Neighbours()
    for _ in range(1000):
        gas.step(position, v, side, near, GAS_TIME_STEP)
    return position, v, side
