"""Disks in a box, and the list of those that may touch: what the gases have in common."""

from __future__ import annotations

from typing import Any

import numpy as np

import collide

RADIUS = 0.5


def lattice(disks: int, packing: float) -> tuple[Any, float]:
    """Positions on a square lattice, of shape (2, disks), and the side of the box that they fill."""
    side = float(np.sqrt(disks * np.pi * RADIUS**2 / packing))
    rows = int(np.ceil(np.sqrt(disks)))
    return side / rows * (np.stack(np.divmod(np.arange(disks), rows)) + 0.5), side


def start(disks: int, packing: float, rng: np.random.Generator) -> tuple[Any, Any, float]:
    """The same, and velocities of one speed in random directions, at kT = 1 for a mass of 1."""
    position, side = lattice(disks, packing)
    angle = rng.uniform(0.0, 2.0 * np.pi, disks)
    return position, np.sqrt(2.0) * np.stack([np.cos(angle), np.sin(angle)]), side


class Neighbours:
    """The pairs of disks nearer than a margin. They serve until some disk has moved half the margin: no two that are
    not listed can touch before. A wide margin makes for long lists, a narrow one for many.
    """

    def __init__(self, radius: Any = RADIUS, box: tuple[float, float] | None = None, margin: float = 0.3) -> None:
        self.radius, self.box, self.margin, self.listed_at = radius, box, margin, None

    def of(self, position: Any) -> Any:
        if self.listed_at is None or ((position - self.listed_at) ** 2).sum(axis=0).max() > (self.margin / 2) ** 2:
            self.listed_at = position.copy()
            x, y = position
            self.pairs = collide.find_contacts(x, y, self.radius, box=self.box, margin=self.margin)
        return self.pairs
