"""A formula of collide.scalar in a user's kernel costs what the same expression costs, written out there by hand."""

from __future__ import annotations

import statistics

import duels
import pytest

from . import hold


@pytest.mark.parametrize("n", [1000, 10_000])
def test_a_formula_costs_nothing_to_call(n):
    hold(f"{n:,} pairs, as fast as by hand", *duels.embedding(n), 30, statistics.median, least=0.95)
