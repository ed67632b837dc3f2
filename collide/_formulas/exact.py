"""Sums and products with their rounding errors, exactly: what keeps a difference of nearly equal terms.

Compiled by way of fma; uncompiled, where there is none for arrays, in some fifty operations that give the same bits.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from .._compile.elementwise import fma
from .._compile.options import compiles, formula


@formula
def two_sum(a: Any, b: Any) -> Any:
    """a + b and its rounding error (Knuth)."""
    s = a + b
    t = s - a
    return s, (a - (s - t)) + (b - t)


@formula
def two_product(x: Any, y: Any) -> Any:
    """x*y and its rounding error."""
    p = x * y
    return p, fused(x, y, -p)


# Products of vectors, which are tuples of components.


# Of vectors in space whose third components are 0 all have the bits of the plane.


@formula
def dot_in_two(x: Any, y: Any) -> Any:
    """x.y as a sum of two: the first one's rounding is lost, on a line nothing, in space also 2**-104 of the terms."""
    if len(x) == 1:
        return two_product(x[0], y[0])
    p, low = two_product(x[1], y[1])
    if len(x) == 3:
        q, q_low = two_product(x[2], y[2])
        p, sum_low = two_sum(p, q)
        low = low + (sum_low + q_low)
    return fused(x[0], y[0], p), low


@formula
def dot(x: Any, y: Any) -> Any:
    """x.y to one and a half units in the last place, even where it cancels (Kahan); in space to 2**-104 of terms."""
    high, low = dot_in_two(x, y)
    return high + low


@formula
def two_dot(x: Any, y: Any) -> Any:
    """x.y to twice the precision, as a sum of two; where that cancels they may be of one size."""
    p, e = two_product(x[0], y[0])
    q, f = two_product(x[1], y[1])
    s, t = two_sum(p, q)
    low = t + (e + f)
    if len(x) == 3:
        r, g = two_product(x[2], y[2])
        s, t = two_sum(s, r)
        low = low + (t + g)
    return s, low


@formula
def square(x: Any) -> Any:
    """x.x, to half a unit in the last place for each component."""
    if len(x) == 1:
        return x[0] * x[0]
    if len(x) == 2:
        return fused(x[0], x[0], x[1] * x[1])
    return fused(x[0], x[0], fused(x[1], x[1], x[2] * x[2]))


@formula
def factors_of_cross(x: Any, y: Any) -> Any:
    """The components of x cross y, each as the product of two vectors in the plane; that of the plane is the last."""
    in_the_plane, turned = (x[0], -x[1]), (y[1], y[0])
    if len(x) == 2:
        return (in_the_plane,), (turned,)
    return ((x[1], -x[2]), (x[2], -x[0]), in_the_plane), ((y[2], y[1]), (y[0], y[2]), turned)


def fused(x: Any, y: Any, z: Any) -> Any:
    """x*y + z, rounded once (uncompiled by rounding to odd: Boldo and Melquiond, "Emulation of a FMA", 2008)."""
    with np.errstate(all="ignore"):
        p, e = _halved_product(x, y)
        s, low = two_sum(z, e)
        total, middle = two_sum(p, s)
        tail, rest = two_sum(middle, low)
        bits = np.asarray(tail, np.float64).view(np.int64)
        to_odd = np.where(np.equal(rest > 0.0, tail > 0.0), 1, -1) * ((rest != 0.0) & (bits % 2 == 0))
        total = total + (bits + to_odd).view(np.float64)
        total = np.where(total == 0.0, x * y + z, total)  # which has the sign of a zero right
        # Not so where halves overflow, or a product's error falls below the smallest number.
        safe = (abs(x) < _LARGE) & (abs(y) < _LARGE) & (abs(z) < _LARGE) & (abs(p) < _LARGE)
        safe = safe & ((abs(p) > _SMALL) | (x == 0.0) | (y == 0.0))
    if not np.all(safe):
        rest = (v[~safe].tolist() for v in np.broadcast_arrays(x, y, z))
        total[~safe] = [_in_integers(*numbers) for numbers in zip(*rest, strict=True)]
    return total[()]


@compiles(fused)
def _fused(x: Any, y: Any, z: Any) -> Any:
    return lambda x, y, z: fma(x, y, z)


_LARGE, _SMALL = 2.0**990, 2.0**-900


def _halved_product(x: Any, y: Any) -> Any:
    """x*y and its rounding error (Dekker)."""
    p = x * y
    (a, b), (c, d) = _halves(x), _halves(y)
    return p, ((a * c - p) + a * d + b * c) + b * d


def _halves(x: Any) -> Any:
    c = 134217729.0 * x  # 2**27 + 1
    high = c - (c - x)
    return high, x - high


def _in_integers(x: float, y: float, z: float) -> float:
    """x*y + z of any size, by whole numbers; Python rounds their quotient once."""
    if not (math.isfinite(x) and math.isfinite(y)):
        return x * y + z
    if not math.isfinite(z):
        return z
    (a, i), (b, j), (c, k) = (math.frexp(v) for v in (x, y, z))
    shift = min(i + j - 106, k - 53)
    product, addend = int(a * 2.0**53) * int(b * 2.0**53), int(c * 2.0**53)
    total = (product << (i + j - 106 - shift)) + (addend << (k - 53 - shift))
    if total == 0:
        return x * y + z
    try:
        return total / (1 << -shift) if shift < 0 else float(total << shift)
    except OverflowError:
        return math.inf if total > 0 else -math.inf
