"""A granular gas cools: its collisions lose energy, and its temperature follows Haff's law (J. Fluid Mech. 134, 1983).

    T = T0 / (1 + t/tau)^2        tau = 4 / ((1 - e^2) omega0)

A collision takes (1 - e^2) T away on average, and a disk has omega0 of them in a unit of time at first: in Enskog's
theory 2 sqrt(pi T0) n d g, for n disks of diameter d and mass 1 in a unit of area, g = (1 - 7 phi/16) / (1 - phi)^2 at
the packing phi. Nothing is fitted. Late in a large gas vortices form, and clusters, and the law ends: a smaller one
stays even.

    python -m collide.examples.cooling [--disks 1000] [--restitution 0.95] [--steps 30000] [--save FILE.png]
"""

from __future__ import annotations

import argparse
from typing import Any

import numpy as np
from tqdm import tqdm

import collide
from collide.examples.neighbours import RADIUS, Neighbours, lattice
from collide.examples.pictures import BLUE, GREY, RED, panels, save

PACKING = 0.1
MOVE = 0.025  # of a radius in a step: at 0.1 disks are found deep in each other, and lose 6 % too little
WARM_UP = 400  # elastic steps, in which the lattice is forgotten


def start(disks: int, rng: np.random.Generator) -> tuple[Any, Any, Neighbours]:
    """Positions on a lattice, Maxwell's velocities of temperature 1, each of shape (2, disks), and the periodic box."""
    position, side = lattice(disks, PACKING)
    v = rng.normal(size=(2, disks))
    return position, v - v.mean(axis=1, keepdims=True), Neighbours(box=(side, side), margin=1.0)


def temperature(v: Any) -> float:
    return float((v * v).sum() / (2 * v.shape[1]))


def step(position: Any, v: Any, near: Neighbours, restitution: float) -> float:
    """One step, in place; the slower the disks are, the longer. Returns how long it was."""
    time = MOVE * RADIUS / np.sqrt(temperature(v))
    position += time * v
    i, j = near.of(position)
    collide.resolve_contacts(i, j, 1.0, *position, *v, radius=RADIUS, restitution=restitution, box=near.box)
    return float(time)


def haff(t: Any, t0: float, restitution: float) -> Any:
    """Haff's law for temperatures that begin at t0."""
    g = (1 - 7 * PACKING / 16) / (1 - PACKING) ** 2
    density = PACKING / (np.pi * RADIUS**2)
    omega0 = 2 * np.sqrt(np.pi * t0) * density * 2 * RADIUS * g
    return t0 / (1 + t * (1 - restitution**2) * omega0 / 4) ** 2


def draw(file: str, t: Any, measured: Any, law: Any, disks: int, restitution: float) -> None:
    figure, (ax,) = panels(4.2, height=3.2)
    ax.loglog(t[1:], measured[1:], color=BLUE, linewidth=3, alpha=0.5, label="measured")
    ax.loglog(t[1:], law[1:], color=RED, linewidth=1, label="Haff's law, nothing fitted")
    late = np.array([t[-1] / 12, t[-1] / 2])
    ax.loglog(late, 3 * law[-1] * (late / t[-1]) ** -2.0, color=GREY, linewidth=1)
    ax.text(late[0] * 2.5, 3 * law[-1] * 30, r"$t^{-2}$", color=GREY)
    ax.set(xlabel=r"time $t$ $\left(d\,\sqrt{m/T_0}\right)$", ylabel="temperature $T/T_0$")
    ax.set_title(f"{disks:,} disks, restitution $e$ = {restitution:g}, packing {PACKING:g}")
    ax.legend(loc="lower left")
    save(figure, file)


def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(
        prog="python -m collide.examples.cooling", description=(__doc__ or "").split("\n")[0]
    )
    parser.add_argument("--disks", type=int, default=1000)
    parser.add_argument("--restitution", type=float, default=0.95)
    parser.add_argument("--steps", type=int, default=30_000)
    parser.add_argument("--save", metavar="FILE.png", help="write the picture")
    options = parser.parse_args(arguments)
    if options.disks < 20 or options.steps < 1 or not 0 <= options.restitution <= 1:
        parser.error("needs 20 --disks and 1 of --steps at least, and a --restitution from 0 to 1")
    position, v, near = start(options.disks, np.random.default_rng(0))
    for _ in range(WARM_UP):
        step(position, v, near, 1.0)
    times, measured = [0.0], [temperature(v)]
    for _ in tqdm(range(options.steps), unit="step", disable=None):  # none where it is piped
        times.append(times[-1] + step(position, v, near, options.restitution))
        measured.append(temperature(v))
    t, law = np.array(times), haff(np.array(times), measured[0], options.restitution)
    print(f"{'time':>12} {'temperature':>12} {'Haff':>12}")
    for k in np.unique(np.geomspace(1, options.steps, 9).astype(int)):
        print(f"{t[k]:12.1f} {measured[k]:12.3e} {law[k]:12.3e}")
    print(f"largest distance from the law {np.abs(np.log(measured / law)).max():.3f} of the temperature")
    if options.save:
        draw(options.save, t, measured, law, options.disks, options.restitution)


if __name__ == "__main__":
    main()
