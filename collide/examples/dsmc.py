"""A gas of a million balls comes to equilibrium by random collisions: direct-simulation Monte Carlo, without cells.

All balls start at the same speed, in random directions of space. Each step draws disjoint pairs at random, lets a pair
collide with a probability in proportion to its relative speed, and resolves all collisions of the step at once. Hard
balls scatter evenly in all directions, so the line of centres halves the angle between the relative velocity and a
random direction. The speeds end up as Maxwell's: <v^4>/<v^2>^2 goes from 1 to 5/3.

    python -m collide.examples.dsmc [--balls 1000000] [--steps 40] [--save FILE.png]
"""

from __future__ import annotations

import argparse
import math
from typing import Any

import numpy as np
from tqdm import tqdm

import collide
from collide.examples.pictures import BLUE, GREEN, GREY, RED, panels, save


def directions(n: int, rng: np.random.Generator) -> Any:
    """Unit vectors, evenly over the sphere, of shape (3, n)."""
    v = rng.normal(size=(3, n))
    return v / np.sqrt((v * v).sum(axis=0))


def step(v: Any, rng: np.random.Generator) -> int:
    """One step of the gas; v, of shape (3, n), is changed in place. Returns how many pairs collided."""
    i, j = rng.permutation(v.shape[1])[: v.shape[1] // 2 * 2].reshape(2, -1)
    w = v[:, i] - v[:, j]
    speed = np.sqrt((w * w).sum(axis=0))
    hit = rng.random(speed.size) * speed.max() < speed
    i, j, w, speed = i[hit], j[hit], w[:, hit], speed[hit]
    n = w - speed * directions(i.size, rng)  # the relative velocity before, less that after
    return collide.resolve_pairs(i, j, 1.0, tuple(v), tuple(n))


def kurtosis(v: Any) -> float:
    """<v^4>/<v^2>^2: 1 for equal speeds; for Maxwell's distribution 2 in the plane, and 5/3 in space."""
    square = (v * v).sum(axis=0)
    return float((square * square).mean() / square.mean() ** 2)


def distance_to_maxwell(v: Any) -> float:
    """The largest distance between the distribution of v^2 and that of Maxwell's speeds, with the same mean."""
    square = np.sort((v * v).sum(axis=0))
    energy = square / square.mean() * len(v) / 2  # in units of kT
    below = -np.expm1(-energy)
    if len(v) == 3:
        below = np.vectorize(math.erf)(np.sqrt(energy)) - np.sqrt(4 / np.pi * energy) * np.exp(-energy)
    return float(np.abs(below - (np.arange(square.size) + 0.5) / square.size).max())


def draw(file: str, speeds: dict[int, Any], moments: list[float]) -> None:
    figure, (left, right) = panels(3.7, 2.9, height=3.0)
    for (k, speed), colour in zip(speeds.items(), (GREY, GREEN, BLUE), strict=False):
        style: dict[str, Any] = {"histtype": "step", "linewidth": 1.4, "color": colour, "label": f"after {k} steps"}
        left.hist(speed, bins=120, range=(0, 2.5), density=True, **style)
    x = np.linspace(0, 2.5, 300)
    left.plot(x, np.sqrt(54 / np.pi) * x * x * np.exp(-1.5 * x * x), "--", color=RED, label="Maxwell")
    left.set(xlabel="speed (that of all at first)", ylabel="probability density", xlim=(0, 2.5), ylim=(0, None))
    left.legend()
    right.axhline(5 / 3, color=RED, linestyle="--", label="Maxwell: 5/3")
    right.plot(moments, "o", color=BLUE, markersize=3.5, label="measured")
    right.set(xlabel="step", ylabel=r"$\langle v^4 \rangle \,/\, \langle v^2 \rangle^2$")
    right.legend(loc="lower right")
    save(figure, file)


def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(prog="python -m collide.examples.dsmc", description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--balls", "--disks", type=int, default=1_000_000)
    parser.add_argument("--steps", type=int, default=40)
    parser.add_argument("--save", metavar="FILE.png", help="write the picture")
    options = parser.parse_args(arguments)
    for name in ("balls", "steps"):
        if getattr(options, name) < 2:
            parser.error(f"--{name} {getattr(options, name)}: must be at least 2")
    rng = np.random.default_rng(0)
    v = directions(options.balls, rng)
    energy, speeds, moments, collisions = (v * v).sum(), {}, [kurtosis(v)], 0
    for k in tqdm(range(1, options.steps + 1), unit="step", disable=None):  # none where it is piped
        collisions += step(v, rng)
        moments.append(kurtosis(v))
        if k in (5, 10, options.steps):
            speeds[k] = np.sqrt((v * v).sum(axis=0))
    for k in sorted({0, 1, 2, 5, 10, 20, options.steps} & set(range(options.steps + 1))):
        print(f"step {k:4}: <v^4>/<v^2>^2 = {moments[k]:.4f}")
    print(f"{collisions:,} collisions; distance to Maxwell's distribution {distance_to_maxwell(v):.1e}")
    print(f"relative drift of the energy {(v * v).sum() / energy - 1:.1e}")
    if options.save:
        draw(options.save, speeds, moments)


if __name__ == "__main__":
    main()
