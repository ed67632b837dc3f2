"""A formula of collide.scalar in a user's kernel, beside the same expression written out there by hand."""

from __future__ import annotations

import duels
import pytest


@pytest.mark.parametrize("n", [1000, 10_000])
def test_a_formula_costs_nothing_to_call(race, benchmark, n):
    benchmark.group = f"embedding: {n:,} pairs, by hand and by collide.scalar"
    race(*duels.embedding(n), 30)
