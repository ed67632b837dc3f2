"""The product and sum that are rounded once."""

from fractions import Fraction

import numba
import numpy as np
import pytest

from collide._formulas import exact as _exact

pytestmark = pytest.mark.fast


def test_uncompiled_fused_products_are_rounded_once():
    """Against rational numbers, and against the instruction: near cancellation, exact, and with far parts."""
    rng = np.random.default_rng(5)
    x, y = rng.normal(size=(2, 20_000))
    near = -x * y * (1.0 + rng.integers(-3, 4, x.size) * 2.0**-52)
    far = rng.normal(size=x.size) * 2.0 ** rng.integers(-120, 120, x.size)
    z = np.select([np.arange(x.size) % 4 == k for k in range(3)], [near, -x * y, far], rng.normal(size=x.size))
    halves = np.float64(2.0**26 + 1), np.float64(2.0**26 + 1), -np.float64(2.0**52 + 2.0**27)  # exactly 1
    x, y, z = (np.append(a, h) for a, h in zip((x, y, z), halves, strict=True))
    exact = [Fraction(a) * Fraction(b) + Fraction(c) for a, b, c in zip(*(v.tolist() for v in (x, y, z)), strict=True)]
    right = np.array([f.numerator / f.denominator for f in exact])
    np.testing.assert_array_equal(_exact.fused(x, y, z), right)
    compiled = numba.vectorize(nopython=True)(lambda x, y, z: _exact.fused(x, y, z))
    np.testing.assert_array_equal(compiled(x, y, z), right)
