"""The formula of a collision, for any number of dimensions: n, v and u are tuples of components.

    u1 = v1 - j1 n        j1 = (1+e) m2/(m1+m2) (v1-v2).n / n.n
    u2 = v2 + j2 n        j2 = (1+e) m1/(m1+m2) (v1-v2).n / n.n

The first half of this file says what m1, m2, v1, v2, n, n.n and e of a pair are in each way to state one.
"""

from __future__ import annotations

import math
from operator import mul, sub
from typing import Any

from .._compile.components import each
from .._compile.elementwise import as_float64, inverse_power_of_two, is_beyond, select, square_root
from .._compile.lanes import any_lane
from .._compile.options import formula
from .exact import dot, dot_in_two, fused
from .sincos import sincos

# Each gives what `collision` and `impulse` take: m1, m2, v1, v2, n, the high and the low part of n.n, e. The low part
# is None where n.n is 1, and where its price is too high: beside angles, whose own rounding is more, it costs 2 %.


@formula
def on_a_line(m1: Any, m2: Any, v1: Any, v2: Any, e: Any) -> Any:
    return m1, m2, (v1,), (v2,), (1.0,), 1.0, None, e


@formula
def in_the_plane(m1: Any, m2: Any, v1x: Any, v1y: Any, v2x: Any, v2y: Any, nx: Any, ny: Any, e: Any) -> Any:
    n, square, low = normal((nx, ny))
    return m1, m2, (v1x, v1y), (v2x, v2y), n, square, low, e


@formula
def in_space(
    m1: Any,
    m2: Any,
    v1x: Any,
    v1y: Any,
    v1z: Any,
    v2x: Any,
    v2y: Any,
    v2z: Any,
    nx: Any,
    ny: Any,
    nz: Any,
    e: Any,
) -> Any:
    n, square, low = normal((nx, ny, nz))
    return m1, m2, (v1x, v1y, v1z), (v2x, v2y, v2z), n, square, low, e


@formula
def in_polar_form(m1: Any, m2: Any, v1: Any, theta1: Any, v2: Any, theta2: Any, phi: Any, e: Any) -> Any:
    (s1, c1), (s2, c2), (s, c) = sincos(as_float64(theta1), as_float64(theta2), as_float64(phi))
    # cos**2 + sin**2 is as near to 1 as its own rounding would leave it.
    return m1, m2, (v1 * c1, v1 * s1), (v2 * c2, v2 * s2), (c, s), 1.0, None, e


@formula
def collision(m1: Any, m2: Any, v1: Any, v2: Any, n: Any, square: Any, low: Any, e: Any) -> Any:
    """u1, u2, the closing speed (v1-v2).n, which is positive when the pair approaches, and about j1 + j2."""
    v1, v2 = each(as_float64, v1), each(as_float64, v2)
    closing, closing_low = dot_in_two(each(sub, v1, v2), n)
    j1, j2, j = changes(m1, m2, closing, closing_low, square, low, e)
    u1, u2 = each(fused, -j1, n, v1), each(fused, j2, n, v2)
    return u1, u2, closing if low is None else closing + closing_low, j


@formula
def changes(
    m1: Any, m2: Any, closing: Any, closing_low: Any, square: Any, square_low: Any, e: Any
) -> tuple[Any, Any, Any]:
    """j1, j2 and about j1 + j2.

    A first approximation and one correction: what it leaves of (j1+j2) n.n = (1+e) (v1-v2).n is shared out by the same
    weights, which takes away the errors that both have in common; and one division serves both. What remains is
    counted in tests/formulas/test_exact.py.
    """
    m1, m2 = comparable(as_float64(m1), as_float64(m2))
    e = as_float64(e)
    inverse = 1.0 / ((m1 + m2) * square)
    w1, w2 = m2 * inverse, m1 * inverse
    q = fused(e, closing, closing)
    j1, j2 = w1 * q, w2 * q
    j = j1 + j2
    # From the closing speed on, not from q: of equal masses the first step is then exact, and they exchange exactly.
    left = fused(e, closing, fused(-j2, square, fused(-j1, square, closing)))
    if square_low is not None:
        left = left + fused(-j, square_low, fused(e, closing_low, closing_low))
    return fused(w1, left, j1), fused(w2, left, j2), j


@formula
def impulse(m1: Any, m2: Any, v1: Any, v2: Any, n: Any, square: Any, low: Any, e: Any) -> tuple[Any, Any]:
    """(1+e) m1 m2/(m1+m2) (v1-v2).n / |n| and the closing speed. By the lighter ball: the other may be immovable."""
    m1, m2, e = as_float64(m1), as_float64(m2), as_float64(e)
    closing = dot(each(sub, each(as_float64, v1), each(as_float64, v2)), n)
    first = m1 <= m2
    mass = select(first, m1, m2)
    light, heavy = comparable(mass, select(first, m2, m1))
    return mass * (heavy / ((light + heavy) * square_root(square)) * fused(e, closing, closing)), closing


# Masses and normals may have any size, and only their ratios matter: those far from 1, whose products could overflow or
# underflow, are first brought near it by a power of two, which is exact. Element by element: a pair's bits do not
# depend on its neighbours.


@formula
def comparable(m1: Any, m2: Any) -> tuple[Any, Any]:
    """Masses of the same ratio, whose sum can be multiplied by the square of a normal."""
    extreme = is_beyond(m1 + m2, 400)
    if any_lane(extreme):
        # Infinite and finite are as 1 and 0; NaN stays NaN, and two infinite masses give 0/0.
        wall1, wall2 = m1 == math.inf, m2 == math.inf
        none1, none2 = select(m1 >= 0.0, 0.0, m1), select(m2 >= 0.0, 0.0, m2)
        m1, m2 = select(wall2, none1, select(wall1, 1.0, m1)), select(wall1, none2, select(wall2, 1.0, m2))
        scale = select(extreme, inverse_power_of_two((m1, m2)), 1.0)
        m1, m2 = scale * m1, scale * m2
    return m1, m2


@formula
def normal(n: Any) -> tuple[Any, Any, Any]:
    """n at a length between 2**-35 and 2**35, a subnormal one from 2**-51 on, and its square as a sum of two."""
    n = each(as_float64, n)
    square, low = dot_in_two(n, n)
    extreme = is_beyond(square, 70)
    if any_lane(extreme):
        n = each(mul, select(extreme, inverse_power_of_two(n), 1.0), n)
        square, low = dot_in_two(n, n)
    return n, square, low
