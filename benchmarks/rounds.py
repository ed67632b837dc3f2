"""How long the rounds of a race are, and what they come to."""

from __future__ import annotations

import statistics


def calls_a_round(n: int, seconds: float = 2.5e-9) -> int:
    """How many calls of n elements, of so many seconds each, a round has: some 2 ms of collide's.

    Short calls are timed many at a time; a long one has left the caches before it ends. It follows from the case alone:
    if it were measured, two runs would compare rounds of different lengths.
    """
    return max(1, round(2e-3 / (5e-6 + seconds * n)))


def spells(ratios: list[float], rounds: int) -> list[float]:
    """The median of each third of `rounds`."""
    size = rounds // 3
    return [statistics.median(ratios[i : i + size]) for i in range(0, len(ratios) - size + 1, size)]
