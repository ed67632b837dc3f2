"""Two balls and a wall count the digits of pi (G. Galperin, Regul. Chaotic Dyn. 8, 375, 2003).

A ball of mass 100**n comes in from the right, a ball of mass 1 rests between it and the wall on the left. Nothing but
elastic collisions on a line happens, of the balls and of the small one with the wall: 3, 31, 314, 3141, ... in all.

    python -m collide.examples.galperin [--digits 7] [--save FILE.png]

The picture: with x = sqrt(M) V and y = v the energy is a circle, and each collision a step of one angle around it.
"""

from __future__ import annotations

import argparse
import math
from typing import Any

import numba
import numpy as np

import collide


# As in a user's program: the formula inside brings its own compile options, whatever stands here.
@numba.njit  # type: ignore[untyped-decorator]
def collisions(mass: float, path: Any) -> int:
    """How many there are; the velocities of both balls after each, as far as `path`, of shape (n, 2), has room."""
    small, big, count = 0.0, -1.0, 0
    path[0] = big, small
    while small < 0.0 or small > big:
        if small < 0.0:  # the wall is an immovable ball 1, on the left
            _, small = collide.scalar.resolve_1d(np.inf, 1.0, 0.0, small)
        else:
            small, big = collide.scalar.resolve_1d(1.0, mass, small, big)
        count += 1
        if count < len(path):
            path[count] = big, small
    return count


def draw(file: str | None) -> None:
    from matplotlib import pyplot as plt

    figure, axes = plt.subplots(1, 2, figsize=(8, 4.2))
    for ax, mass in zip(axes, (100.0, 10_000.0), strict=True):
        path = np.full((400, 2), np.nan)
        count = collisions(mass, path)
        turn = np.linspace(0, 2 * math.pi, 400)
        radius = math.sqrt(mass)
        ax.plot(radius * np.cos(turn), radius * np.sin(turn), color="0.7", linewidth=1)
        ax.plot(radius * path[: count + 1, 0], path[: count + 1, 1], marker=".", linewidth=0.5, markersize=3)
        ax.set_title(f"M = {mass:,.0f} m: {count} collisions")
        ax.set_xlabel("sqrt(M) V")
        ax.set_ylabel("sqrt(m) v")
        ax.set_aspect("equal")
    figure.tight_layout()
    if file:
        figure.savefig(file, dpi=120)
    else:
        plt.show()


def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(
        prog="python -m collide.examples.galperin", description=(__doc__ or "").split("\n")[0]
    )
    parser.add_argument("--digits", type=int, default=7, help="of pi, 1 to 8 (default 7, some seconds at 8)")
    parser.add_argument("--save", metavar="FILE.png", help="write the picture")
    parser.add_argument("--show", action="store_true", help="show the picture")
    options = parser.parse_args(arguments)
    if not 1 <= options.digits <= 8:
        parser.error(f"--digits {options.digits}: must be 1 to 8")
    print(f"{'mass ratio':>18} {'collisions':>12}")
    for n in range(options.digits):
        print(f"{100**n:18,} {collisions(float(100**n), np.empty((1, 2))):12,}", flush=True)
    if options.save or options.show:
        draw(options.save)


if __name__ == "__main__":
    main()
