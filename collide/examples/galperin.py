"""Two balls and a wall count the digits of pi (G. Galperin, Regul. Chaotic Dyn. 8, 375, 2003).

A ball of mass M = 100**n comes in from the right, a ball of mass m = 1 rests between it and the wall on the left.
Nothing but elastic collisions on a line happens, of the balls and of the small one with the wall: 3, 31, 314, 3141, ...
in all.

    python -m collide.examples.galperin [--digits 7] [--save FILE.png]

The picture: V and v are the velocities of the large ball and of the small one. In the plane of sqrt(M) V and sqrt(m) v
the energy is a circle. Collisions of the balls keep M V + m v, a line across it, and the wall turns v around: two of
them are a step of one angle, 2 arctan sqrt(m/M), around the circle, until the balls go apart for good. So half a turn,
pi, takes pi / arctan sqrt(m/M) collisions, less a part of one.
"""

from __future__ import annotations

import argparse
import math
from typing import Any

import numba
import numpy as np

import collide
from collide.examples.pictures import BLUE, GREY, RED, panels, save


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


def draw(file: str | None, counts: list[int]) -> None:
    figure, (left, right) = panels(3.3, 3.5, height=3.3)
    mass, path = 100.0, np.empty((32, 2))
    collisions(mass, path)
    x, y = path[:, 0], path[:, 1] / math.sqrt(mass)  # on a circle of radius 1
    turn = np.linspace(0.0, 2 * math.pi, 400)
    left.plot(np.cos(turn), np.sin(turn), color=GREY, linewidth=1)
    left.plot(x, y, ".-", color=BLUE, linewidth=0.7, markersize=5, label=f"{len(path) - 1} collisions")
    left.plot(x[0], y[0], "o", color=RED, label="at first")
    left.plot(x[-1], y[-1], "s", color=RED, label="in the end")
    left.set(xlabel=r"large ball: $\sqrt{M}\,V$ (of $\sqrt{2E}$)", ylabel=r"small ball: $\sqrt{m}\,v$ (of $\sqrt{2E}$)")
    left.set(aspect="equal", title=f"$M$ = {mass:.0f} $m$")
    left.legend(loc="center", frameon=True, framealpha=1, edgecolor="none")
    n = np.arange(len(counts))
    right.semilogy(n, math.pi - counts / 10.0**n, "o", color=BLUE, label=r"$\pi - N / \sqrt{M/m}$, for $N$ collisions")
    right.semilogy(n, 10.0**-n, "--", color=GREY, label="one of the last digit")
    for k, count in enumerate(counts):
        place = k, math.pi - count / 10**k
        right.annotate(f"{count / 10**k:.{k}f}", place, (0, -13), textcoords="offset points", ha="center", fontsize=7)
    right.set(xlabel=r"$\log_{100} (M/m)$", ylabel=r"what is missing to $\pi$")
    right.margins(x=0.12, y=0.12)
    right.legend()
    save(figure, file)


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
    counts = []
    for n in range(options.digits):
        counts.append(collisions(float(100**n), np.empty((1, 2))))
        print(f"{100**n:18,} {counts[n]:12,}", flush=True)
    if options.save or options.show:
        draw(options.save, counts)


if __name__ == "__main__":
    main()
