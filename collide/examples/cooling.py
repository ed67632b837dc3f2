"""A granular gas cools: its collisions lose energy, and its temperature follows Haff's law (J. Fluid Mech. 134, 1983).

    T = T0 / (1 + t/tau)^2        tau = 4 / ((1 - e^2) omega0)

A collision takes (1 - e^2) T away on average, and a disk has omega0 of them in a unit of time at first: in Enskog's
theory 2 sqrt(pi T0) n d g, for n disks of diameter d and mass 1 in a unit of area, g = (1 - 7 phi/16) / (1 - phi)^2 at
the packing phi. Nothing is fitted. Late in a large gas clusters form, and the law ends.

    python -m collide.examples.cooling [--disks 5000] [--restitution 0.95] [--steps 10000] [--save FILE.png]
"""

from __future__ import annotations

import argparse
from typing import Any

import numpy as np
from tqdm import tqdm

import collide
from collide.examples.gas import RADIUS, lattice

PACKING = 0.1
MOVE = 0.025  # of a radius in a step: at 0.1 disks are found deep in each other, and lose 6 % too little
WARM_UP = 400  # elastic steps, in which the lattice is forgotten


def start(disks: int, rng: np.random.Generator) -> tuple[Any, Any, float]:
    """Positions on a lattice, Maxwell's velocities of temperature 1, each of shape (2, disks), and the box's side."""
    position, side = lattice(disks, PACKING)
    v = rng.normal(size=(2, disks))
    return position, v - v.mean(axis=1, keepdims=True), side


def temperature(v: Any) -> float:
    return float((v * v).sum() / (2 * v.shape[1]))


def step(position: Any, v: Any, side: float, restitution: float) -> float:
    """One step, in place; the slower the disks are, the longer. Returns how long it was."""
    time = MOVE * RADIUS / np.sqrt(temperature(v))
    position += time * v
    (x, y), (vx, vy), box = position, v, (side, side)
    i, j = collide.find_contacts(x, y, RADIUS, box=box)
    collide.resolve_contacts(i, j, 1.0, x, y, vx, vy, restitution=restitution, box=box)
    return float(time)


def haff(t: Any, t0: float, restitution: float) -> Any:
    """Haff's law for temperatures that begin at t0."""
    g = (1 - 7 * PACKING / 16) / (1 - PACKING) ** 2
    density = PACKING / (np.pi * RADIUS**2)
    omega0 = 2 * np.sqrt(np.pi * t0) * density * 2 * RADIUS * g
    return t0 / (1 + t * (1 - restitution**2) * omega0 / 4) ** 2


def draw(file: str, t: Any, measured: Any, law: Any) -> None:
    from matplotlib import pyplot as plt

    figure, ax = plt.subplots(figsize=(6, 4))
    ax.loglog(t[1:], measured[1:], label="disks")
    ax.loglog(t[1:], law[1:], "k--", linewidth=1, label="Haff's law, nothing fitted")
    ax.set(xlabel="time", ylabel="temperature")
    ax.legend()
    figure.tight_layout()
    figure.savefig(file, dpi=120)


def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(
        prog="python -m collide.examples.cooling", description=(__doc__ or "").split("\n")[0]
    )
    parser.add_argument("--disks", type=int, default=5000)
    parser.add_argument("--restitution", type=float, default=0.95)
    parser.add_argument("--steps", type=int, default=10_000)
    parser.add_argument("--save", metavar="FILE.png", help="write the picture")
    options = parser.parse_args(arguments)
    if options.disks < 20 or options.steps < 1 or not 0 <= options.restitution <= 1:
        parser.error("needs 20 --disks and 1 of --steps at least, and a --restitution from 0 to 1")
    position, v, side = start(options.disks, np.random.default_rng(0))
    for _ in range(WARM_UP):
        step(position, v, side, 1.0)
    times, measured = [0.0], [temperature(v)]
    for _ in tqdm(range(options.steps), unit="step", disable=None):  # none where it is piped
        times.append(times[-1] + step(position, v, side, options.restitution))
        measured.append(temperature(v))
    t, law = np.array(times), haff(np.array(times), measured[0], options.restitution)
    print(f"{'time':>12} {'temperature':>12} {'Haff':>12}")
    for k in np.unique(np.geomspace(1, options.steps, 9).astype(int)):
        print(f"{t[k]:12.1f} {measured[k]:12.3e} {law[k]:12.3e}")
    print(f"largest distance from the law {np.abs(np.log(measured / law)).max():.3f} of the temperature")
    if options.save:
        draw(options.save, t, measured, law)


if __name__ == "__main__":
    main()
