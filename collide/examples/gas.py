"""A gas of disks in a box, stepped in time: its speeds become Maxwell's, and its energy stays what it was.

A loop of one's own around `find_contacts` and `resolve_contacts`: all disks move, those that touch and approach
collide, one after another. At first all have the same speed. The box is periodic or has walls, each an immovable ball.

    python -m collide.examples.gas [--disks 10000] [--packing 0.3] [--steps 2000] [--walls] [--save FILE.png]
"""

from __future__ import annotations

import argparse
from typing import Any

import numpy as np
from tqdm import tqdm

import collide
from collide.examples.dsmc import distance_to_maxwell, kurtosis

RADIUS, TIME_STEP = 1.0, 0.1  # a disk moves a tenth of its radius in a step


def lattice(disks: int, packing: float) -> tuple[Any, float]:
    """Positions on a square lattice, of shape (2, disks), and the side of the box that it fills."""
    side = float(np.sqrt(disks * np.pi * RADIUS**2 / packing))
    rows = int(np.ceil(np.sqrt(disks)))
    return side / rows * (np.stack(np.divmod(np.arange(disks), rows)) + 0.5), side


def start(disks: int, packing: float, rng: np.random.Generator) -> tuple[Any, Any, float]:
    """Positions on a lattice and velocities in random directions, each of shape (2, disks), and the side of the box."""
    position, side = lattice(disks, packing)
    angle = rng.uniform(0.0, 2.0 * np.pi, disks)
    return position, np.stack([np.cos(angle), np.sin(angle)]), side


def step(position: Any, v: Any, side: float, walls: bool) -> int:
    """One step, in place. Returns how many pairs collided."""
    position += TIME_STEP * v
    if walls:
        for axis, nx, ny in ((0, 1.0, 0.0), (1, 0.0, 1.0)):
            off = position[axis] - side / 2
            k = np.flatnonzero(np.abs(off) > side / 2 - RADIUS)
            out = np.sign(off[k])  # the wall is an immovable ball 2, on this side
            u = collide.resolve_2d(1, np.inf, v[0, k], v[1, k], 0, 0, out * nx, out * ny, approaching_only=True)
            v[:, k] = u[:2]
    (x, y), (vx, vy), box = position, v, None if walls else (side, side)
    i, j = collide.find_contacts(x, y, RADIUS, box=box)
    return collide.resolve_contacts(i, j, 1.0, x, y, vx, vy, box=box)


def draw(file: str, position: Any, v: Any, side: float) -> None:
    from matplotlib import pyplot as plt

    figure, (left, right) = plt.subplots(1, 2, figsize=(9, 4.2))
    x, y = position % side
    speed = np.hypot(*v)
    area = (RADIUS * 72 * 3.4 / side) ** 2 * np.pi  # in points, for axes 3.4 inches wide
    left.scatter(x, y, s=area, c=speed, cmap="viridis", linewidths=0)
    left.set(xlim=(0, side), ylim=(0, side), xticks=[], yticks=[], aspect="equal", title="coloured by speed")
    right.hist(speed, bins=60, range=(0, 3), density=True, histtype="step", label="disks")
    s = np.linspace(0, 3, 300)
    right.plot(s, 2 * s * np.exp(-s * s), "k--", linewidth=1, label="Maxwell")
    right.axvline(1.0, color="0.6", linewidth=1, label="at first")
    right.set(xlabel="speed", ylabel="probability density")
    right.legend()
    figure.tight_layout()
    figure.savefig(file, dpi=120)


def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(prog="python -m collide.examples.gas", description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--disks", type=int, default=10_000)
    parser.add_argument("--packing", type=float, default=0.3, help="the share of the area that disks cover, up to 0.7")
    parser.add_argument("--steps", type=int, default=2000)
    parser.add_argument("--walls", action="store_true", help="a box with walls, not a periodic one")
    parser.add_argument("--save", metavar="FILE.png", help="write the picture")
    options = parser.parse_args(arguments)
    if options.disks < 20 or options.steps < 1 or not 0 < options.packing <= 0.7:
        parser.error("needs at least 20 --disks and 1 of --steps, and a --packing above 0 and up to 0.7")
    position, v, side = start(options.disks, options.packing, np.random.default_rng(0))
    energy, collisions = (v * v).sum(), 0
    for _ in tqdm(range(options.steps), unit="step", disable=None):  # none where it is piped
        collisions += step(position, v, side, options.walls)
    print(f"{collisions:,} collisions, {2 * collisions / options.disks:.1f} a disk")
    print(f"<v^4>/<v^2>^2 = {kurtosis(v):.4f}: 1 at first, 2 in equilibrium")
    print(f"distance to Maxwell's distribution {distance_to_maxwell(v):.1e}")
    print(f"relative drift of the energy {(v * v).sum() / energy - 1:.1e}")
    if options.save:
        draw(options.save, position, v, side)


if __name__ == "__main__":
    main()
