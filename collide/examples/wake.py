"""A large disk flies through thousands at rest: a bow wave before it, a wake behind.

Its mass is infinite, so it keeps its velocity; the small ones have a mass, and a diameter, of 1, and so has its speed.

    python -m collide.examples.wake [--disks 5000] [--radius 4] [--restitution 0.9] [--save FILE.png]
"""

from __future__ import annotations

import argparse
from typing import Any

import numpy as np
from tqdm import tqdm

import collide
from collide.examples.neighbours import RADIUS, Neighbours, lattice
from collide.examples.pictures import GREEN, draw_disks, panels, save

TIME_STEP = 0.02
PACKING = 0.4


def start(disks: int, radius: float, rng: np.random.Generator) -> tuple[Any, Any, Any, Any, float]:
    """Positions, velocities, radii and masses of disks in a band at rest and of the large one, the last, and the side.

    The band is twice as long as wide. The small ones are a little off their lattice, or they moved in mirror images.
    """
    position, side = lattice(2 * disks, PACKING)
    position = position[:, position[1] < side / 2] + 0.0
    position += rng.uniform(-0.05, 0.05, position.shape)
    position = np.column_stack([position, [-radius - RADIUS, side / 4]])
    n = position.shape[1]
    v, radii, masses = np.zeros((2, n)), np.full(n, RADIUS), np.ones(n)
    v[0, -1], radii[-1], masses[-1] = 1.0, radius, np.inf
    return position, v, radii, masses, side


def step(position: Any, v: Any, masses: Any, near: Neighbours, restitution: float) -> int:
    """One step, in place. Returns how many pairs collided."""
    position += TIME_STEP * v
    i, j = near.of(position)
    (x, y), (vx, vy) = position, v
    return collide.resolve_contacts(i, j, masses, x, y, vx, vy, radius=near.radius, restitution=restitution)


def draw(file: str, position: Any, v: Any, radii: Any, side: float) -> None:
    """Small disks by their speed, grey where they are at rest, on no background: for white pages and black ones."""
    from matplotlib.colors import LinearSegmentedColormap

    figure, (ax,) = panels(7.0, height=3.5)
    figure.patch.set_alpha(0.0)
    colours = LinearSegmentedColormap.from_list("speed", ["#4493f8", "#8f6fe8", "#e5534b", "#f5b83d"])
    # From the slowest up, so that what is fast is not covered.
    order = np.argsort(np.hypot(*v[:, :-1]))
    speed = np.hypot(*v[:, order])
    draw_disks(
        ax,
        position[:, order],
        RADIUS,
        array=speed,
        cmap=colours.with_extremes(under="#8b949e"),
        clim=(1e-9, 0.9),
        linewidth=0,
    )
    draw_disks(ax, position[:, -1:], radii[-1], color=GREEN)
    ax.set(xlim=(0, side), ylim=(0, side / 2))
    ax.axis("off")
    save(figure, file)


def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(prog="python -m collide.examples.wake", description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--disks", type=int, default=5000)
    parser.add_argument("--radius", type=float, default=4.0, help="of the large disk")
    parser.add_argument("--restitution", type=float, default=0.9)
    parser.add_argument("--save", metavar="FILE.png", help="write the picture")
    options = parser.parse_args(arguments)
    if options.disks < 200 or not 0 < options.radius <= 10 or not 0 <= options.restitution <= 1:
        parser.error("needs at least 200 --disks, a --radius above 0 and up to 10, and a --restitution from 0 to 1")
    position, v, radii, masses, side = start(options.disks, options.radius, np.random.default_rng(0))
    near = Neighbours(radii)
    steps = tqdm(range(int(0.7 * side / TIME_STEP)), unit="step", disable=None)  # no progress bar where it is piped
    count = sum(step(position, v, masses, near, options.restitution) for _ in steps)
    moved = (v[:, :-1] != 0).any(axis=0).sum()
    print(f"{count:,} collisions; {moved:,} of {masses.size - 1:,} disks have been moved")
    print(f"they have got the momentum {v[0, :-1].sum():,.0f} along the flight, and {v[1, :-1].sum():.0f} across it")
    if options.save:
        draw(options.save, position, v, radii, side)


if __name__ == "__main__":
    main()
