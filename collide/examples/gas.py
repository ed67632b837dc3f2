"""A gas of disks in a box: its speeds become Maxwell's, its pressure is that of an equation of state.

All disks move, those at a wall turn around, those that touch and approach collide, one after another. At first all have
the same speed; a disk's mass and diameter are the units, and kT.

    p = n kT (1 + eta^2/8) / (1 - eta)^2        (D. Henderson, Mol. Phys. 30, 971, 1975)

at the packing eta. The pressure is what walls get, along the line that centres can be at; without, in a periodic box,
it follows from what disks give each other. Disks crowd at a wall, but keep a radius away: as many would fill a periodic
box whose sides are shorter by 2 r (1 - eta)/(1 + eta), by the theory of scaled particles.

    python -m collide.examples.gas [--disks 2000] [--packing 0.3] [--steps 100000] [--walls] [--save FILE.png]
"""

from __future__ import annotations

import argparse
from typing import Any

import numpy as np
from tqdm import tqdm

import collide
from collide.examples.dsmc import distance_to_maxwell, kurtosis
from collide.examples.neighbours import RADIUS, Neighbours, start
from collide.examples.pictures import BLUE, RED, draw_disks, draw_speeds, panels, save

TIME_STEP = 0.002  # at 0.01 disks are so far in each other when they collide that the pressure is 1 % too low
BLOCKS = 12  # of steps, each a measurement of the pressure; a quarter as many come before, to forget the lattice


def step(position: Any, v: Any, side: float, near: Neighbours, time: float = TIME_STEP) -> tuple[int, float]:
    """One step, in place. Returns how many pairs collided, and the pressure."""
    position += time * v
    (x, y), (vx, vy), on_walls = position, v, np.zeros(4)
    if near.box is None:
        collide.resolve_walls(x, y, vx, vy, RADIUS, (side, side), impulse=on_walls)
    i, j = near.of(position)
    on_disks = np.empty(i.size) if near.box else None  # to ask for impulses takes a little longer
    count = collide.resolve_contacts(i, j, 1.0, x, y, vx, vy, radius=RADIUS, box=near.box, impulse=on_disks)
    if on_disks is None:
        return count, float(on_walls.sum() / (time * 4 * (side - 2 * RADIUS)))
    return count, float(((v * v).sum() / 2 + RADIUS * on_disks.sum() / time) / side**2)  # the virial theorem


def henderson(disks: int, side: float, walls: bool) -> float:
    """The pressure of so many disks in a box."""
    area = np.pi * RADIUS**2
    eta = disks * area / side**2
    if walls:
        eta = disks * area / (side - 2 * RADIUS * (1 - eta) / (1 + eta)) ** 2
    return float(eta / area * (1 + eta**2 / 8) / (1 - eta) ** 2)


def draw(file: str, position: Any, v: Any, side: float, pressures: Any, mean: float, error: float, law: float) -> None:
    figure, (left, middle, right) = panels(3.7, 2.8, 2.8, height=3.0)
    speed, unit = np.hypot(*v), r"$\sqrt{kT/m}$"
    disks = draw_disks(left, position % side, RADIUS, array=speed, cmap="viridis", clim=(0, 3))
    left.set(xlim=(0, side), ylim=(0, side), title=f"{speed.size:,} disks")
    figure.colorbar(disks, ax=left, label=f"speed ({unit})", extend="max")
    draw_speeds(middle, speed, lambda s: s * np.exp(-s * s / 2), np.sqrt(2.0), xlabel=f"speed ({unit})")
    right.axhspan(mean - error, mean + error, color=BLUE, alpha=0.25, linewidth=0, label="their mean, and its error")
    right.plot(np.arange(1, BLOCKS + 1), pressures, "o", color=BLUE, markersize=4, label="blocks of steps")
    right.axhline(law, color=RED, label="Henderson")
    right.set(xlabel="block", ylabel="pressure ($kT$ / diameter$^2$)", xticks=range(0, BLOCKS + 1, 2))
    right.margins(y=0.7)
    right.legend(loc="upper left")
    save(figure, file)


def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(prog="python -m collide.examples.gas", description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--disks", type=int, default=2000)
    parser.add_argument("--packing", type=float, default=0.3, help="the share of the area that disks cover, up to 0.7")
    parser.add_argument("--steps", type=int, default=100_000)
    parser.add_argument("--walls", action="store_true", help="a box with walls, not a periodic one")
    parser.add_argument("--save", metavar="FILE.png", help="write the picture")
    options = parser.parse_args(arguments)
    if options.disks < 20 or options.steps < 2 * BLOCKS or not 0 < options.packing <= 0.7:
        parser.error("needs at least 20 --disks and 40 of --steps, and a --packing above 0 and up to 0.7")
    position, v, side = start(options.disks, options.packing, np.random.default_rng(0))
    near, energy = Neighbours(box=None if options.walls else (side, side)), (v * v).sum()
    steps = tqdm(range(options.steps), unit="step", disable=None)  # no progress bar where it is piped
    counts, pressures = np.transpose([step(position, v, side, near) for _ in steps])
    blocks = np.array([part.mean() for part in np.array_split(pressures[options.steps // 5 :], BLOCKS)])
    mean, error, law = blocks.mean(), blocks.std(ddof=1) / BLOCKS**0.5, henderson(options.disks, side, options.walls)
    print(f"{counts.sum():,.0f} collisions, {2 * counts.sum() / options.disks:.1f} a disk")
    print(f"<v^4>/<v^2>^2 = {kurtosis(v):.4f}: 1 at first, 2 in equilibrium")
    print(f"distance to Maxwell's distribution {distance_to_maxwell(v):.1e}")
    print(f"pressure {mean:.4f} +- {error:.4f}, Henderson's equation of state {law:.4f}")
    print(f"relative drift of the energy {(v * v).sum() / energy - 1:.1e}")
    if options.save:
        draw(options.save, position, v, side, blocks, mean, error, law)


if __name__ == "__main__":
    main()
