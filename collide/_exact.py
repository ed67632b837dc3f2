"""Sums and products with their rounding errors, exactly: what keeps a difference of nearly equal terms."""

from __future__ import annotations

from typing import Any

from ._elementwise import fma
from ._jit import compiles, formula


@formula
def two_sum(a: Any, b: Any) -> Any:
    """a + b and its rounding error (Knuth)."""
    s = a + b
    t = s - a
    return s, (a - (s - t)) + (b - t)


def two_product(x: Any, y: Any) -> Any:
    """x*y and its rounding error: by fma where compiled, uncompiled by Dekker's halves, with the same bits."""
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


@formula
def two_dot(a: Any, b: Any, c: Any, d: Any) -> Any:
    """a*b + c*d to twice the precision, as a sum of two; the second may be as large as the first where that cancels."""
    p, e = two_product(a, b)
    q, f = two_product(c, d)
    s, t = two_sum(p, q)
    return s, t + (e + f)
