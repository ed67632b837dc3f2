"""Sine and cosine together, to within 1 ulp for every finite argument, the same bits on every processor.

Cody-Waite reduction by pi/2 in three parts with fma, kept in two words, then minimax polynomials on [-pi/4, pi/4] (the
coefficients of fdlibm's k_sin.c and k_cos.c). libm is out: in a compiled loop it stays scalar, 15 times slower, and its
bits vary with version and processor. test_sincos.py holds the bound, against 50 digits.
"""

from __future__ import annotations

import functools
import math
from typing import Any

import numpy as np

from .._compile.elementwise import differ_above, flip_sign, fma, lowest_bit, select
from .._compile.lanes import Lanes, any_lane, get, out_of_line, put
from .._compile.options import compiles, formula, rare
from .exact import two_sum

_TWO_OVER_PI = 2 / math.pi
# pi/2 in three doubles.
_P1, _P2, _P3 = 1.5707963267948966, 6.123233995736766e-17, -1.4973849048591698e-33
# Adding 1.5 * 2**52 rounds to the nearest integer k and leaves it in the last bits of the mantissa. The further 2**31
# keeps what stands in the last 32 from borrowing: the bits above tell whether |k| < 2**31.
_BASE = 1.5 * 2.0**52
_ROUND = _BASE + 2.0**31


def sincos(x: Any, y: Any, z: Any) -> tuple[tuple[Any, Any], tuple[Any, Any], tuple[Any, Any]]:
    """(sin, cos) of three angles in radians. Uncompiled, NumPy's.

    Three at a time, as a collision has them: one look for large arguments instead of three.
    """
    return (np.sin(x), np.cos(x)), (np.sin(y), np.cos(y)), (np.sin(z), np.cos(z))


@compiles(sincos)
def _sincos(x: Any, y: Any, z: Any) -> Any:
    def compiled(x: Any, y: Any, z: Any) -> Any:
        a, b, c = _reduce(x), _reduce(y), _reduce(z)
        # |k| < 2**31: k*pi/2 could be subtracted without loss. Beyond, and for NaN, by table, a lane at a time.
        if any_lane(differ_above(a[0], b[0], c[0], _BASE, 32)):
            a, b, c = _reduce_large(x, a), _reduce_large(y, b), _reduce_large(z, c)
        return _evaluate(*a), _evaluate(*b), _evaluate(*c)

    return compiled


@formula
def _reduce(x: Any) -> Any:
    """x = k*pi/2 + r + tail, |r| <= pi/4 and a little, k in the last bits of the first value."""
    quadrant = fma(x, _TWO_OVER_PI, _ROUND)
    k = quadrant - _ROUND
    # Exact: both sides are multiples of 2**-53, and the difference is below 1.
    r0 = fma(-k, _P1, x)
    # Fast2Sum, good in spite of |r0| < |k*P2| near a multiple of pi/2, as r0 is a multiple of ulp(k*P2).
    r = r0 - k * _P2
    return quadrant, r, fma(-k, _P3, fma(-k, _P2, r0 - r))


@formula
def _evaluate(quadrant: Any, r: Any, tail: Any) -> Any:
    z = r * r
    s = fma(z, 1.58969099521155010221e-10, -2.50507602534068634195e-08)
    s = fma(z, s, 2.75573137070700676789e-06)
    s = fma(z, s, -1.98412698298579493134e-04)
    s = fma(z, s, 8.33333333332248946124e-03)
    s = fma(z, s, -1.66666666666666324348e-01)
    # The tail of r, times cos(r) in principle: leaving the cosine out costs at most 0.15 ulp.
    sine = r + fma(z * r, s, tail)
    c = fma(z, -1.13596475577881948265e-11, 2.08757232129817482790e-09)
    c = fma(z, c, -2.75573143513906633035e-07)
    c = fma(z, c, 2.48015872894767294178e-05)
    c = fma(z, c, -1.38888888888741095749e-03)
    c = fma(z, c, 4.16666666666666019037e-02)
    # 1 - z/2 loses up to half an ulp; what it lost comes back with the small terms.
    half = 0.5 * z
    main = 1.0 - half
    cosine = main + fma(z * z, c, fma(-r, tail, (1.0 - main) - half))
    swap = lowest_bit(quadrant)
    return (
        flip_sign(select(swap, cosine, sine), quadrant, 1),
        flip_sign(flip_sign(select(swap, sine, cosine), quadrant, 1), quadrant, 0),
    )


def _reduce_large(x: Any, reduced: Any) -> Any:
    """The reduction, redone where |k| >= 2**31; elsewhere as it was."""
    raise NotImplementedError("compiled only")


@compiles(_reduce_large, inline=False)
def _reduce_large_overload(x: Any, reduced: Any) -> Any:
    if not isinstance(x, Lanes):
        return lambda x, reduced: _reduce_one(x, reduced)
    width = x.width

    def compiled(x: Any, reduced: Any) -> Any:
        out_of_line()
        quadrant, r, tail = reduced
        for i in range(width):
            q, high, low = _reduce_one(get(x, i), (get(quadrant, i), get(r, i), get(tail, i)))
            quadrant, r, tail = put(quadrant, i, q), put(r, i, high), put(tail, i, low)
        return quadrant, r, tail

    return compiled


@functools.cache
def _four_chunks() -> Any:
    """For every x = M * 2**s with |x| >= 2**30, M an integer of 53 bits: 2**s * 2/pi modulo 4, in chunks of 53 bits.

    Row s - _FIRST. Four chunks leave 2**-62, the closest that a double comes to a multiple of pi/2, 53 bits and more.
    """
    bits = 1300
    one = 1 << bits

    def arctan_of_inverse(n: int) -> int:
        total, term, k = 0, one // n, 0
        while term:
            total += (-1) ** k * (term // (2 * k + 1))
            term, k = term // n**2, k + 1
        return total

    pi = 4 * (4 * arctan_of_inverse(5) - arctan_of_inverse(239))  # Machin
    two_over_pi = (one * one * 2) // pi
    rows = np.empty((_LAST - _FIRST + 1, 4))
    for row, s in zip(rows, range(_FIRST, _LAST + 1), strict=True):
        rest = (two_over_pi << (s - _FIRST)) % (one << (2 - _FIRST))  # in units of 2**(_FIRST - bits)
        for j in range(4):
            shift = bits - _FIRST + 2 - 53 * (j + 1)
            row[j] = math.ldexp(rest >> shift, 2 - 53 * (j + 1))
            rest &= (1 << shift) - 1
    return rows


_FIRST, _LAST = 30 - 52, 1023 - 52
_CHUNKS = _four_chunks()


@rare
def _reduce_one(x: Any, reduced: Any) -> Any:
    """Payne and Hanek's reduction: only the bits of 2/pi that matter. NaN for inf."""
    out_of_line()
    if not differ_above(reduced[0], reduced[0], reduced[0], _BASE, 32):
        return reduced
    if not abs(x) < math.inf:
        return x - x, x - x, x - x
    mantissa, exponent = math.frexp(x)
    m = mantissa * 2.0**53
    c = _CHUNKS[exponent - 53 - _FIRST]
    # x*2/pi modulo 4 = m*c, in exact products; whole multiples of 4 are dropped as they arise.
    p0 = m * c[0]
    a = (p0 - 4.0 * math.floor(0.25 * p0)) + fma(m, c[0], -p0)
    k = math.floor(a + 0.5)
    p1 = m * c[1]
    a, a1 = two_sum(a - k, p1)
    j = math.floor(a + 0.5)
    p2 = m * c[2]
    b, b1 = two_sum(fma(m, c[1], -p1), p2)
    b, b2 = two_sum(a1, b)
    high, low = two_sum(a - j, b)
    low += (b1 + b2) + (fma(m, c[2], -p2) + m * c[3])
    # Back from quarter turns to radians.
    r = high * _P1
    return _ROUND + (k + j), r, fma(high, _P1, -r) + (high * _P2 + low * _P1)
