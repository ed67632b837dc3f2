"""Sums and products with their rounding errors, exactly: what keeps a difference of nearly equal terms.

Compiled by way of fma; uncompiled, where there is none for arrays, by way of Dekker's halves, with the same bits.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ._elementwise import fma
from ._jit import compiles, formula


@formula
def two_sum(a: Any, b: Any) -> Any:
    """a + b and its rounding error (Knuth)."""
    s = a + b
    t = s - a
    return s, (a - (s - t)) + (b - t)


def two_product(x: Any, y: Any) -> Any:
    """x*y and its rounding error."""
    p = x * y
    (a, b), (c, d) = _halves(x), _halves(y)
    return p, ((a * c - p) + a * d + b * c) + b * d


def _halves(x: Any) -> Any:
    c = 134217729.0 * x  # 2**27 + 1
    high = c - (c - x)
    return high, x - high


@compiles(two_product)
def _two_product(x: Any, y: Any) -> Any:
    def compiled(x: Any, y: Any) -> Any:
        p = x * y
        return p, fma(x, y, -p)

    return compiled


def fused(x: Any, y: Any, z: Any) -> Any:
    """x*y + z, rounded once (uncompiled by rounding to odd: Boldo and Melquiond, "Emulation of a FMA", 2008)."""
    p, e = two_product(x, y)
    s, low = two_sum(z, e)
    total, middle = two_sum(p, s)
    tail, rest = two_sum(middle, low)
    bits = np.asarray(tail, np.float64).view(np.int64)
    to_odd = np.where(np.equal(rest > 0.0, tail > 0.0), 1, -1) * ((rest != 0.0) & (bits % 2 == 0))
    return total + (bits + to_odd).view(np.float64)[()]


@compiles(fused)
def _fused(x: Any, y: Any, z: Any) -> Any:
    return lambda x, y, z: fma(x, y, z)


@formula
def dot(a: Any, b: Any, c: Any, d: Any) -> Any:
    """a*b + c*d to one and a half units in the last place, even where it cancels (Kahan)."""
    p, e = two_product(c, d)
    return fused(a, b, p) + e


@formula
def two_dot(a: Any, b: Any, c: Any, d: Any) -> Any:
    """a*b + c*d to twice the precision, as a sum of two; the second may be as large as the first where that cancels."""
    p, e = two_product(a, b)
    q, f = two_product(c, d)
    s, t = two_sum(p, q)
    return s, t + (e + f)
