"""The calls that people make against the loops that they would write over the same arrays. The best spell counts."""

from __future__ import annotations

import numpy as np
import pytest
from calls import make
from rounds import calls_a_round

from . import best_spell, hold

# The way, pairs, one thread?, by whom, how many times as fast as that collide has to be. Two thirds to four fifths of
# what was found: 0.97, 0.92 to 1.2, 1.2, 0.9 to 1.2, 2.0, 2.4 and 2.4; of rows of three 1.0 to 1.2, 1.1 and 1.3.
BOUNDS = [
    ("rows, out given", 10_000, True, "prange", 0.75),
    ("rows, out given", 1_000_000, False, "prange", 0.75),
    ("rows in place", 100_000, True, "prange", 0.75),
    ("rows", 1_000_000, False, "prange", 0.75),
    ("columns", 1, False, "NumPy", 1.5),
    ("columns, out given", 1, False, "NumPy", 1.7),
    ("columns, out given", 100, False, "NumPy", 1.7),
    ("rows of three, out given", 1_000_000, False, "prange", 0.75),
    ("rows of three in place", 100_000, True, "prange", 0.75),
    ("rows of three", 1_000_000, True, "prange", 0.85),
]
ROUNDS = 45


@pytest.mark.parametrize(("way", "n", "one_thread", "by", "bound"), BOUNDS)
def test_calls(set_threads, way, n, one_thread, by, bound):
    if one_thread:
        set_threads(1)
    calls = make(way, n)
    what = f"{way}, {n:,} pairs, as fast as {by}"
    hold(what, getattr(calls, by), calls.collide, calls_a_round(n), ROUNDS, best_spell(ROUNDS), least=bound)


@pytest.mark.parametrize("n", [30_000, 100_000, 1_000_000])
def test_results_of_its_own(n):
    """A process with a past: what has been allocated and freed before does not count."""
    past = [np.empty(int(size)) for size in np.random.default_rng(0).uniform(1e3, 1e6, 100)]
    del past[::2]
    calls, with_out = make("columns", n), make("columns, out given", n).collide
    what = f"without out, {n:,} pairs, as fast as with it"
    hold(what, with_out, calls.collide, calls_a_round(n), ROUNDS, best_spell(ROUNDS), least=0.7)
    assert len(past) == 50
