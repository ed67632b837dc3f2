"""A formula of collide.scalar in a user's kernel costs what the same expression costs, written out there by hand."""

from __future__ import annotations

import statistics

import numba
import numpy as np
import pytest
from yardsticks import calls_a_round, make_case

import collide

INFINITY = 0x7FF << 52
LOW, HIGH = (1023 - 400) << 52, (1023 + 400) << 52


@numba.njit(error_model="numpy")
def embedded(m1, m2, v1x, v1y, v2x, v2y, nx, ny, u1x, u1y, u2x, u2y):
    for k in range(m1.size):
        u1x[k], u1y[k], u2x[k], u2y[k] = collide.scalar.resolve_2d(
            m1[k], m2[k], v1x[k], v1y[k], v2x[k], v2y[k], nx[k], ny[k]
        )


@numba.njit(error_model="numpy", forceinline=True)
def power(x, y):
    exponent_x, exponent_y = np.float64(x).view(np.int64) & INFINITY, np.float64(y).view(np.int64) & INFINITY
    return np.int64(INFINITY - max(max(exponent_x, exponent_y), 1 << 52)).view(np.float64)


@numba.njit(error_model="numpy")
def by_hand(m1, m2, v1x, v1y, v2x, v2y, nx, ny, u1x, u1y, u2x, u2y):
    """The same operations, those for masses beyond 2**400 and walls included."""
    for k in range(m1.size):
        x, y, first, second = nx[k], ny[k], m1[k], m2[k]
        scale = power(x, y)
        x, y = scale * x, scale * y
        bits = np.float64(first + second).view(np.int64)
        extreme = bits < LOW or bits >= HIGH
        if extreme:
            wall1, wall2 = first == np.inf, second == np.inf
            none1, none2 = 0.0 if first >= 0.0 else first, 0.0 if second >= 0.0 else second
            first = none1 if wall2 else 1.0 if wall1 else first
            second = none2 if wall1 else 1.0 if wall2 else second
            scale = power(first, second) if extreme else 1.0
            first, second = scale * first, scale * second
        total = (first + second) * (x * x + y * y)
        q = 2.0 * ((v1x[k] - v2x[k]) * x + (v1y[k] - v2y[k]) * y)
        j1, j2 = second / total * q, first / total * q
        u1x[k], u1y[k], u2x[k], u2y[k] = v1x[k] - j1 * x, v1y[k] - j1 * y, v2x[k] + j2 * x, v2y[k] + j2 * y


@pytest.mark.parametrize("n", [1000, 10_000])
def test_a_formula_costs_nothing_to_call(race, benchmark, n):
    case = make_case("plane", n)
    embedded(*case.columns, *case.out)
    want = [u.copy() for u in case.out]
    by_hand(*case.columns, *case.out)
    for u, w in zip(case.out, want, strict=True):
        np.testing.assert_array_equal(u, w)

    def ratio(ratios):
        return statistics.median(ratios)

    benchmark.group = f"embedding: {n:,} pairs, by hand and by collide.scalar"
    found = ratio(
        race(
            lambda: embedded(*case.columns, *case.out),
            lambda: by_hand(*case.columns, *case.out),
            calls_a_round(n),
            30,
            enough=lambda ratios: ratio(ratios) >= 0.95,
        )
    )
    print(f"\n{n:,} pairs: {found:.2f} times as fast as by hand, at least 0.95", end=" ")
    assert found >= 0.95
