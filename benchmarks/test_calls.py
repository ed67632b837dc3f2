"""Pairs a second of the calls that people make, from one pair up, and of the loops that they would write instead."""

from __future__ import annotations

import pytest
from calls import WAYS, make
from rounds import calls_a_round

SIZES = [1, 100, 10_000, 1_000_000, 10_000_000]


@pytest.mark.parametrize("by", ["collide", "prange", "NumPy"])
@pytest.mark.parametrize("n", SIZES)
@pytest.mark.parametrize("way", WAYS)
def test_call(race, benchmark, way, n, by):
    calls = make(way, n)
    benchmark.group = f"calls: {way}, {n:,} pairs"
    race(getattr(calls, by), calls.collide, calls_a_round(n), 15, way=way, n=n, by=by)
