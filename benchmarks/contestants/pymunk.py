"""pymunk: a physics engine, which finds the contacts too."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from cases import Array, Call, Case
from rounds import After

from collide.examples.neighbours import RADIUS

from .missing import MissingError, collisions_on_all_threads_only, peer


@dataclasses.dataclass
class Step(After):
    """A step of the engine, of whose results only the answer is compared."""

    answer: Call


def batch(case: Case) -> Call:
    """One step of n isolated touching pairs of disks.

    On one thread: its threaded solver gives wrong velocities at one iteration, from some thousands of pairs on.
    """
    collisions_on_all_threads_only(case)
    if case.form != "2d" or case.n > 10_000:
        raise MissingError("an engine is asked for pairs in the plane, up to 10,000")
    pm = peer("pymunk")
    space = pm.Space()
    space.iterations = 1
    m1, m2, v1x, v1y, v2x, v2y, nx, ny = case.columns
    bodies = []
    side = math.isqrt(case.n) + 1
    # Touching: a thousandth of a radius of overlap, which the solver leaves alone. Radius 1/2, 4 apart.
    length = np.hypot(nx, ny) / 0.999
    for k in range(case.n):
        for m, x, y in ((m1[k], 0.0, 0.0), (m2[k], nx[k] / length[k], ny[k] / length[k])):
            body = pm.Body(m, math.inf)
            body.position = 4.0 * (k % side) + x, 4.0 * (k // side) + y
            shape = pm.Circle(body, 0.5)
            shape.elasticity = 1.0
            space.add(body, shape)
            bodies.append(body)
    places = [body.position for body in bodies]
    velocities = np.stack([v1x, v1y, v2x, v2y], 1).reshape(-1, 2).tolist()

    def step() -> Sequence[Array]:
        space.step(1e-9)
        return case.out

    def reset() -> None:
        for body, place, velocity in zip(bodies, places, velocities, strict=True):
            body.position, body.velocity = place, velocity

    def answer() -> Sequence[Array]:
        return tuple(np.array([body.velocity for body in bodies]).reshape(-1, 4).T)

    return Step(reset, step, answer)


def gas(position: Array, v: Array, side: float, threads: int) -> Any:
    """The same disks in a box of segments."""
    pm = peer("pymunk")
    space = pm.Space(threaded=threads > 1)
    if threads > 1:
        space.threads = threads
    space.iterations, space.collision_slop = 1, 0.0
    corners = [(0, 0), (side, 0), (side, side), (0, side)]
    for a, b in zip(corners, [*corners[1:], corners[0]], strict=True):
        wall = pm.Segment(space.static_body, a, b, 0.0)
        wall.elasticity = 1.0
        space.add(wall)
    for place, velocity in zip(position.T.tolist(), v.T.tolist(), strict=True):
        body = pm.Body(1.0, float("inf"))
        body.position, body.velocity = place, velocity
        shape = pm.Circle(body, RADIUS)
        shape.elasticity = 1.0
        space.add(body, shape)
    return space


def energy(space: Any) -> float:
    return float(sum(body.velocity.length**2 for body in space.bodies))
