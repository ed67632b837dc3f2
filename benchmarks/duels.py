"""Races that are measured and guarded alike: a contestant, a reference beside it, and how many calls a round has."""

from __future__ import annotations

import copy
from pathlib import Path
from typing import Any

import disk
import make_pairs
import numba
import numpy as np
import pyarrow.parquet as pq
from cases import GAS_TIME_STEP, disks, make_case
from contestants import SEARCHES, TABLES, WALLS, by_hand, dask, entered, itself
from rounds import After, Timed, calls_a_round

import collide
from collide.examples import gas
from collide.examples.neighbours import Neighbours

Duel = tuple[Timed, Timed, int]


@numba.njit(error_model="numpy")
def embedded(m1, m2, v1x, v1y, v2x, v2y, nx, ny, u1x, u1y, u2x, u2y):
    for k in range(m1.size):
        u1x[k], u1y[k], u2x[k], u2y[k] = collide.scalar.resolve_2d(
            m1[k], m2[k], v1x[k], v1y[k], v2x[k], v2y[k], nx[k], ny[k]
        )


def embedding(n: int) -> Duel:
    """A formula of collide.scalar in a user's kernel, and the same expression written out there by hand."""
    case = make_case("2d", n)
    embedded(*case.columns, *case.out)
    want = [u.copy() for u in case.out]
    by_hand.plane(*case.columns, *case.out)
    for u, w in zip(case.out, want, strict=True):
        np.testing.assert_array_equal(u, w)
    return (
        lambda: embedded(*case.columns, *case.out),
        lambda: by_hand.plane(*case.columns, *case.out),
        calls_a_round(n),
    )


def search(rival: str, n: int, periodic: bool) -> Duel:
    """A rival's search for the contacts of n disks, and collide's."""
    x, y, radius, side = disks(n)
    box = (side, side) if periodic else None
    contestant = entered(rival, SEARCHES[rival], x, y, radius, box)
    np.testing.assert_array_equal(_as_set(collide.find_contacts(x, y, radius, box=box)), _as_set(contestant()))
    return contestant, lambda: collide.find_contacts(x, y, radius, box=box), calls_a_round(n, 150e-9)


def _as_set(pairs: Any) -> Any:
    """Each pair once, in one order: matscipy lists it both ways."""
    i, j = np.sort(np.asarray(pairs, np.int64), axis=0)
    return np.unique(i * (1 << 31) + j)


def resolution(i: Any, j: Any, x: Any, y: Any) -> Duel:
    """collide's resolution of a list of contacts, and a loop by hand, from the same velocities each time."""
    v = np.random.default_rng(1).normal(size=(2, x.size))
    ours, theirs = v.copy(), v.copy()
    assert collide.resolve_contacts(i, j, 1.0, x, y, *ours) == by_hand.contacts(i, j, x, y, *theirs)
    np.testing.assert_allclose(ours, theirs, rtol=1e-9, atol=1e-9)
    return (
        After(lambda: np.copyto(ours, v), lambda: collide.resolve_contacts(i, j, 1.0, x, y, *ours)),
        After(lambda: np.copyto(theirs, v), lambda: by_hand.contacts(i, j, x, y, *theirs)),
        1,
    )


def drawing(i: Any, j: Any, v: Any, n: Any) -> Duel:
    """Pairs gathered, resolved as a batch and written back by NumPy, and collide.resolve_pairs."""
    theirs = copy.deepcopy(v)

    def by_rows() -> None:
        theirs[i], theirs[j] = collide.resolve(1.0, 1.0, theirs[i], theirs[j], n)

    def by_columns() -> None:
        one, two = [c[i] for c in theirs], [c[j] for c in theirs]
        batch = collide.resolve_2d if len(theirs) == 2 else collide.resolve_3d
        after = batch(1.0, 1.0, *one, *two, *n)
        for c, u1, u2 in zip(theirs, after[: len(theirs)], after[len(theirs) :], strict=True):
            c[i], c[j] = u1, u2

    contestant = by_rows if isinstance(v, np.ndarray) else by_columns
    contestant()
    assert collide.resolve_pairs(i, j, 1.0, v, n) == i.size
    np.testing.assert_array_equal(v, theirs)
    return contestant, lambda: collide.resolve_pairs(i, j, 1.0, v, n), 1


def walls(rival: str, n: int, in_rows: bool) -> Duel:
    """Disks between walls, in rows of (N, 2) or in columns: few bounce, all are looked at."""
    x, y, radius, side = disks(n)
    state = np.stack([x, y, *np.random.default_rng(1).normal(size=(2, n))])
    place, v = (np.array(half, order="F" if in_rows else "C") for half in (state[:2], state[2:]))
    ours, theirs = [*place, *v], [*place, *v.copy("K")]
    box = side, side
    assert collide.resolve_walls(*ours, radius, box) == WALLS[rival](*theirs, radius, side)
    np.testing.assert_array_equal(ours, theirs)
    return (
        lambda: WALLS[rival](*theirs, radius, side),
        lambda: collide.resolve_walls(*ours, radius, box),
        calls_a_round(n, 1.5e-9),
    )


def gas_step(position: Any, v: Any, side: float, space: Any) -> Duel:
    """A step of pymunk's, and of collide's: disks move, those at walls turn around, contacts are resolved.

    They come from a list that serves until some disk has moved half its margin, as a user would have it.
    """
    near = Neighbours()
    return (
        lambda: space.step(GAS_TIME_STEP),
        lambda: gas.step(position, v, side, near, GAS_TIME_STEP),
        calls_a_round(position.shape[1], 25e-9),
    )


def table(rival: str, source: Path, cold: bool) -> Duel:
    """`collide resolve`, and a rival's table, both to the disk; cold after the input was forgotten."""
    target = source.with_name(f"after{source.suffix}")
    command, other = itself.command(), entered(rival, TABLES[rival], source, target)

    def ready() -> None:
        disk.remove(target)
        if cold:
            disk.forget(source)

    def resolve() -> None:
        assert command(["resolve", str(source), "-o", str(target), "--quiet"]) == 0

    def contestant() -> None:
        other()
        disk.sync(target)

    if source.suffix:
        found = []
        for call in (resolve, contestant):
            ready()
            call()
            found.append(next(pq.ParquetFile(target).iter_batches(1 << 17)))
        for name in (*make_pairs.NAMES, *make_pairs.RESULTS):
            np.testing.assert_allclose(found[1][name], found[0][name], rtol=1e-6, atol=1e-6)
    return After(ready, resolve), After(ready, contestant), 1


def cluster(two: Any, rival: Any, folder: Path) -> Duel:
    """The store by the client of two processes, and by the rival's client, or in one call where that is None."""

    def contestant() -> None:
        dask.on_cluster(two, folder)

    def reference() -> None:
        dask.on_cluster(rival, folder) if rival else dask.in_one_call(folder)

    expected = collide.resolve_2d(*(np.load(folder / f"{name}.npy") for name in make_pairs.NAMES))
    for call in (contestant, reference):
        for name in make_pairs.RESULTS:
            np.load(folder / f"{name}.npy", mmap_mode="r+")[:] = 0.0
        call()
        for name, u in expected._asdict().items():
            np.testing.assert_array_equal(np.load(folder / f"{name}.npy"), u)
    return contestant, reference, 1
