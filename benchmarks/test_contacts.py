"""A ball state: contacts, their resolution, pairs that are drawn, a step of a gas, against what else one would use."""

from __future__ import annotations

import duels
import pytest
from cases import contacts, drawn_pairs, settled_gas
from contestants import SEARCHES, WALLS, entered, pymunk


@pytest.mark.parametrize("rival", SEARCHES)
@pytest.mark.parametrize("periodic", [False, True], ids=["open", "periodic"])
@pytest.mark.parametrize("n", [100, 10_000, 100_000, 1_000_000])
def test_find(race, benchmark, n, periodic, rival):
    space = "periodic" if periodic else "open"
    benchmark.group = f"contacts of {n:,} disks, {space}"
    race(*duels.search(rival, n, periodic), 9, search=n, space=space, rival=rival)


@pytest.mark.parametrize("order", ["cell order", "random order"])
def test_resolve(race, benchmark, order):
    i, j, x, y = contacts(order)
    benchmark.group = f"{i.size:,} contacts in {order}"
    race(*duels.resolution(i, j, x, y), 15, resolve=order, n=i.size)


@pytest.mark.parametrize("layout", ["columns", "rows"])
@pytest.mark.parametrize("d", [2, 3])
def test_drawn_pairs(race, benchmark, d, layout):
    benchmark.group = f"pairs of a million balls in {layout}, {d}D, gathered, resolved and written back by NumPy"
    race(*duels.drawing(*drawn_pairs(d, layout)), 15, drawn=f"{layout} in {d}D")


@pytest.mark.parametrize("rival", WALLS)
@pytest.mark.parametrize("in_rows", [False, True], ids=["columns", "rows"])
@pytest.mark.parametrize("n", [1, 100, 10_000, 1_000_000])
def test_walls(race, benchmark, n, in_rows, rival):
    benchmark.group = f"{n:,} disks at walls, in {'rows' if in_rows else 'columns'}"
    race(*duels.walls(rival, n, in_rows), 15, walls=n, rival=rival)


@pytest.mark.parametrize("threads", [1, 2])
def test_gas(race, benchmark, threads):
    """On two threads pymunk gets velocities wrong here."""
    rival = f"pymunk on {threads} thread{'s' * (threads > 1)}"
    position, v, side = settled_gas(10_000)
    space = entered("pymunk", pymunk.gas, position, v, side, threads)
    energies = (v * v).sum(), pymunk.energy(space)
    benchmark.group = "a step of a gas of 10,000 disks"
    race(*duels.gas_step(position, v, side, space), 60, step=benchmark.group, rival=rival)
    drifts = (v * v).sum() / energies[0] - 1, pymunk.energy(space) / energies[1] - 1
    print(f"\n{rival}: energies drifted by {drifts[0]:.1e}, and by {drifts[1]:.1e} with pymunk", end=" ")
    assert abs(drifts[0]) < 1e-12
