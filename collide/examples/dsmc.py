"""A gas of a million disks comes to equilibrium by random collisions: direct-simulation Monte Carlo, without cells.

All disks start at the same speed, in random directions. Each step draws disjoint pairs at random, lets a pair collide
with a probability in proportion to its relative speed, at an impact parameter drawn evenly across the disk, and
resolves all collisions of the step as one batch. The speeds end up as Maxwell's: <v^4>/<v^2>^2 goes from 1 to 2.

    python -m collide.examples.dsmc [--disks 1000000] [--steps 40] [--save FILE.png]
"""

from __future__ import annotations

import argparse
from typing import Any

import numpy as np
from tqdm import tqdm

import collide


def step(v: Any, rng: np.random.Generator) -> int:
    """One step of the gas; v, of shape (2, n), is changed in place. Returns how many pairs collided."""
    one, two = rng.permutation(v.shape[1])[: v.shape[1] // 2 * 2].reshape(2, -1)
    wx, wy = v[:, one] - v[:, two]
    speed = np.hypot(wx, wy)
    hit = rng.random(speed.size) * speed.max() < speed
    one, two, wx, wy, speed = one[hit], two[hit], wx[hit], wy[hit], speed[hit]
    # The line of centres, at the angle arcsin(b) to the relative velocity.
    b = rng.uniform(-1.0, 1.0, speed.size)
    c = np.sqrt(1.0 - b * b)
    nx, ny = (c * wx - b * wy) / speed, (b * wx + c * wy) / speed
    u = collide.resolve_2d(1.0, 1.0, v[0, one], v[1, one], v[0, two], v[1, two], nx, ny)
    v[0, one], v[1, one], v[0, two], v[1, two] = u
    return int(speed.size)


def kurtosis(v: Any) -> float:
    """<v^4>/<v^2>^2: 1 for equal speeds, 2 for Maxwell's distribution in two dimensions."""
    square = (v * v).sum(axis=0)
    return float((square * square).mean() / square.mean() ** 2)


def distance_to_maxwell(v: Any) -> float:
    """The largest distance between the distribution of v^2 and the exponential one of the same mean."""
    square = np.sort((v * v).sum(axis=0))
    return float(np.abs(-np.expm1(-square / square.mean()) - (np.arange(square.size) + 0.5) / square.size).max())


def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(prog="python -m collide.examples.dsmc", description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--disks", type=int, default=1_000_000)
    parser.add_argument("--steps", type=int, default=40)
    parser.add_argument("--save", metavar="FILE.png", help="write the picture")
    options = parser.parse_args(arguments)
    for name in ("disks", "steps"):
        if getattr(options, name) < 2:
            parser.error(f"--{name} {getattr(options, name)}: must be at least 2")
    rng = np.random.default_rng(0)
    angle = rng.uniform(0.0, 2.0 * np.pi, options.disks)
    v = np.stack([np.cos(angle), np.sin(angle)])
    energy = (v * v).sum()
    speeds, moments, collisions = {}, [kurtosis(v)], 0
    for k in tqdm(range(1, options.steps + 1), unit="step", disable=None):  # none where it is piped
        collisions += step(v, rng)
        moments.append(kurtosis(v))
        if k in (1, 3, options.steps):
            speeds[k] = np.hypot(*v)
    for k in sorted({0, 1, 2, 5, 10, 20, options.steps} & set(range(options.steps + 1))):
        print(f"step {k:4}: <v^4>/<v^2>^2 = {moments[k]:.4f}")
    print(f"{collisions:,} collisions; distance to Maxwell's distribution {distance_to_maxwell(v):.1e}")
    print(f"relative drift of the energy {(v * v).sum() / energy - 1:.1e}")
    if options.save:
        from matplotlib import pyplot as plt

        figure, ax = plt.subplots(figsize=(7, 4))
        for k, speed in speeds.items():
            ax.hist(
                speed, bins=200, range=(0, 3), density=True, histtype="step", label=f"after {k} step{'s' * (k > 1)}"
            )
        x = np.linspace(0, 3, 300)
        ax.plot(x, 2 * x * np.exp(-x * x), "k--", linewidth=1, label="Maxwell")
        ax.set_xlabel("speed")
        ax.set_ylabel("probability density")
        ax.set_ylim(0, 1.5)
        ax.legend()
        figure.tight_layout()
        figure.savefig(options.save, dpi=120)


if __name__ == "__main__":
    main()
