"""Brownian motion: one heavy disk among a thousand light ones, whose collisions push it about.

At first it flies straight on, with its share of the thermal energy; in the end it has forgotten where it came from:

    <r^2> = 2 (kT/M) t^2  at first        <r^2> = 4 D t  in the end, D = tau kT/M

Langevin's equation has both, <r^2> = 4 D (t - tau (1 - exp(-t/tau))), with tau = M/zeta. Nothing is fitted, zeta is
that of Enskog's theory, with g for how much denser the light disks are at the heavy one than elsewhere:

    zeta = 2 sqrt(2 pi mu kT) n (R + r) g        mu = m M / (m + M)

Its collisions know nothing of each other. In a denser gas it meets the whirls again that it made, and goes farther.

    python -m collide.examples.brownian [--disks 1000] [--mass 10] [--steps 200000] [--save FILE.png]
"""

from __future__ import annotations

import argparse
from typing import Any

import numpy as np
from tqdm import tqdm

import collide
from collide.examples.neighbours import RADIUS, Neighbours, start
from collide.examples.pictures import BLUE, GREY, RED, draw_disks, panels, save

HEAVY, PACKING, TIME_STEP = 4 * RADIUS, 0.05, 0.04  # HEAVY: the radius; a light mass, its diameter d and kT are 1


def state(disks: int, mass: float, rng: np.random.Generator) -> tuple[Any, Any, Any, Any, float]:
    """Masses, radii, positions and velocities, the heavy disk's first; and the side of their periodic box."""
    position, v, side = start(disks, PACKING, rng)
    middle = position[:, [np.hypot(*(position - side / 2)).argmin()]]
    stay = np.hypot(*(position - middle)) > HEAVY + RADIUS
    position, v = np.hstack([middle, position[:, stay]]), np.hstack([np.zeros((2, 1)), v[:, stay]])
    m, radius = np.ones(v.shape[1]), np.full(v.shape[1], RADIUS)
    m[0], radius[0] = mass, HEAVY
    v -= (m * v).sum(axis=1, keepdims=True) / m.sum()
    return m, radius, position, v * np.sqrt(2 * (m.size - 1) / (m * v * v).sum()), side


def enskog(mass: float, light: int, side: float) -> float:
    """The time tau, in which the heavy disk forgets its velocity."""
    eta = light * np.pi * RADIUS**2 / side**2
    g = 1 / (1 - eta) + 9 / 16 * eta / (1 - eta) ** 2 * 2 * HEAVY / (HEAVY + RADIUS)
    return float(mass / (2 * np.sqrt(2 * np.pi * mass / (1 + mass)) * light / side**2 * (HEAVY + RADIUS) * g))


def draw(file: str, path: Any, light: Any, side: float, t: Any, r2: Any, law: Any, tau: float, mass: float) -> None:
    figure, (left, right) = panels(3.3, 3.6, height=3.3)
    recent = (path - path[:, [-1]])[:, -int(20 * tau / TIME_STEP) :]
    draw_disks(left, (light - path[:, [-1]] + side / 2) % side - side / 2, RADIUS, color="0.8")
    draw_disks(left, np.zeros((2, 1)), HEAVY, color=BLUE)
    left.plot(*recent, color=RED, linewidth=1)
    left.set(xlim=(-side / 2, side / 2), ylim=(-side / 2, side / 2), title=r"the last 20 $\tau$ of the path")
    right.loglog(t, law, color=RED, label="Langevin and Enskog")
    right.loglog(t, r2, "o", color=BLUE, markersize=3.5, label="measured")
    for power, end, k in ((r"$\propto t^2$", 2 / mass * t**2, t.size // 3), (r"$\propto t$", 4 * tau / mass * t, -6)):
        right.loglog(t, end, "--", color=GREY, linewidth=1)
        right.annotate(power, (t[k], end[k]), (-28, 4), textcoords="offset points", color="0.4")
    right.set(ylim=(r2[0] / 3, 30 * r2[-1]))
    right.set(xlabel=r"time $t$ ($d\,\sqrt{m/kT}$)", ylabel=r"$\langle r^2 \rangle$ ($d^2$)")
    right.set_title(f"$M$ = {mass:g} $m$, $R$ = {HEAVY / RADIUS:g} $r$, packing {PACKING:g}")
    right.legend()
    save(figure, file)


def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser("python -m collide.examples.brownian", description=str(__doc__).split("\n")[0])
    parser.add_argument("--disks", type=int, default=1000)
    parser.add_argument("--mass", type=float, default=10.0, help="of the heavy disk, in those of a light one")
    parser.add_argument("--steps", type=int, default=200_000)
    parser.add_argument("--save", metavar="FILE.png", help="write the picture")
    options = parser.parse_args(arguments)
    if options.disks < 100 or options.steps < 1000 or not 1 <= options.mass < np.inf:
        parser.error("needs at least 100 --disks, 1000 of --steps and a --mass of 1")
    m, radius, position, v, side = state(options.disks, options.mass, np.random.default_rng(0))
    path, near = np.empty((2, options.steps)), Neighbours(radius, (side, side), margin=1.5)
    for k in tqdm(range(options.steps), unit="step", disable=None):  # none where it is piped
        position += TIME_STEP * v
        i, j = near.of(position)
        collide.resolve_contacts(i, j, m, *position, *v, radius=radius, box=near.box)
        path[:, k] = position[:, 0]
    lags = np.unique(np.geomspace(1, options.steps / 40, 40).astype(int))
    r2 = np.array([((path[:, lag:] - path[:, :-lag]) ** 2).sum(axis=0).mean() for lag in lags])
    t, tau = lags * TIME_STEP, enskog(options.mass, m.size - 1, side)
    law, slope = 4 * tau / options.mass * (t + tau * np.expm1(-t / tau)), np.gradient(np.log(r2), np.log(t))
    print(f"tau = {tau:.2f}\n{'time':>10} {'<r^2>':>10} {'Langevin':>10} {'slope':>6}")
    for k in range(0, lags.size, 3):
        print(f"{t[k]:10.2f} {r2[k]:10.3g} {law[k]:10.3g} {slope[k]:6.2f}")
    if options.save:
        draw(options.save, path, position[:, 1:], side, t, r2, law, tau, options.mass)


if __name__ == "__main__":
    main()
