"""The formulas of the two-ball collision, each written once, for ONE pair.

Every function runs as plain Python on floats and NumPy arrays, compiles inside anyone's `@njit` code, and is what the
batch functions run. Masses m1 and m2, velocities v before and u after, e the coefficient of restitution.

    in 1D       ball 1 is on the left: the pair approaches when v1 > v2
    in 2D       n = (nx, ny), any non-zero length, points from ball 1 to ball 2: it approaches when (v1 - v2).n > 0
    in polar    phi is the direction of n, and v1, theta1, v2, theta2 are speeds and directions; angles in radians

Momentum and the definition of e give, along the line of centres,

    u1 = v1 - (1+e) m2/(m1+m2) (v1-v2)        u2 = v2 + (1+e) m1/(m1+m2) (v1-v2)

which at e = 1 is the textbook's u1 = (2 m2 v2 + (m1-m2) v1)/(m1+m2); across it nothing changes. m = inf is an immovable
ball, m = 0 a test particle. The arithmetic is float64, whatever the arguments. A velocity is off by at most 8 * 2**-52
of the pair's largest component (10 in polar form), for masses and normals of any size and speeds from 1e-290 to 1e290;
at e > 1 by (1+e)/2 times as much. Nothing is checked here: an invalid pair gives unspecified values. Numba's rule for a
kernel of yours with `cache=True`: it does not see that these formulas have changed; clear its cache after an upgrade.
"""

from __future__ import annotations

import math
from typing import Any

from ._compile.elementwise import as_float64, inverse_power_of_two, is_beyond, select, square_root
from ._compile.lanes import any_lane
from ._compile.options import formula
from ._formulas.exact import dot, dot_in_two, fused, two_dot, two_product, two_sum
from ._formulas.sincos import sincos

__all__ = ["impulse_2d", "resolve_1d", "resolve_2d", "resolve_polar", "time_of_impact"]


@formula
def resolve_1d(m1: Any, m2: Any, v1: Any, v2: Any, restitution: Any = 1.0) -> tuple[Any, Any]:
    """Velocities (u1, u2) after a collision on a line.

    m1, m2: masses; v1, v2: velocities, ball 1 on the left; restitution: e. Numbers, in any consistent set of units.

    >>> collide.scalar.resolve_1d(0.5, 3.5, 4.0, 0.0)
    (np.float64(-3.0), np.float64(1.0))
    """
    after, _, _ = on_line(m1, m2, v1, v2, restitution)
    return after  # type: ignore[no-any-return]


@formula
def resolve_2d(
    m1: Any, m2: Any, v1x: Any, v1y: Any, v2x: Any, v2y: Any, nx: Any, ny: Any, restitution: Any = 1.0
) -> tuple[Any, Any, Any, Any]:
    """Velocities (u1x, u1y, u2x, u2y) after a collision in the plane.

        u1 = v1 - (1+e) m2/(m1+m2) ((v1-v2).n / n.n) n        u2 = v2 + (1+e) m1/(m1+m2) ((v1-v2).n / n.n) n

    m1, m2: masses; v1x, v1y, v2x, v2y: velocity components; nx, ny: a vector of any length from ball 1 to ball 2 along
    the line of centres; restitution: e. Numbers, in any consistent set of units.

    >>> @numba.njit
    ... def bounce(v, angle):
    ...     return collide.scalar.resolve_2d(1.0, np.inf, v, 0.0, 0.0, 0.0, np.cos(angle), np.sin(angle))[0]
    >>> bounce(2.0, 0.0)
    -2.0
    """
    nx, ny, square, low = normal(as_float64(nx), as_float64(ny))
    after, _, _ = in_plane(m1, m2, v1x, v1y, v2x, v2y, nx, ny, square, low, restitution)
    return after  # type: ignore[no-any-return]


@formula
def resolve_polar(
    m1: Any, m2: Any, v1: Any, theta1: Any, v2: Any, theta2: Any, phi: Any, restitution: Any = 1.0
) -> tuple[Any, Any, Any, Any]:
    """Velocities (u1x, u1y, u2x, u2y) after a collision in the plane, from speeds and directions.

    m1, m2: masses; v1, v2: speeds; theta1, theta2: their directions; phi: that of the line of centres, from ball 1 to
    ball 2; restitution: e. Numbers, in any consistent set of units, angles in radians. The formula is that of
    `resolve_2d`; compiled, sin and cos are within 1 ulp for angles of any size, uncompiled they are NumPy's.

    >>> [round(float(u), 15) for u in collide.scalar.resolve_polar(1.0, 1.0, 2.0, 0.0, 0.0, 0.0, np.pi / 4)]
    [1.0, -1.0, 1.0, 1.0]
    """
    v1x, v1y, v2x, v2y, nx, ny = from_polar(v1, theta1, v2, theta2, phi)
    # cos**2 + sin**2 is as near to 1 as its own rounding would leave it.
    after, _, _ = in_plane(m1, m2, v1x, v1y, v2x, v2y, nx, ny, 1.0, None, restitution)
    return after  # type: ignore[no-any-return]


@formula
def impulse_2d(
    m1: Any, m2: Any, v1x: Any, v1y: Any, v2x: Any, v2y: Any, nx: Any, ny: Any, restitution: Any = 1.0
) -> Any:
    """The impulse on ball 2 along n/|n| in a collision in the plane, positive for a pair that approaches.

        p = (1+e) m1 m2/(m1+m2) (v1-v2).n / |n|

    The arguments are those of `resolve_2d`; the result is in units of mass times velocity. It is off by at most
    16 * 2**-52 of the lighter mass times the largest velocity component before or after.

    >>> collide.scalar.impulse_2d(1.0, 1.0, 2.0, 0.0, 0.0, 0.0, 3.0, 0.0)
    np.float64(2.0)
    """
    p, _ = impulse(m1, m2, v1x, v1y, v2x, v2y, nx, ny, restitution)
    return p


@formula
def impulse(
    m1: Any, m2: Any, v1x: Any, v1y: Any, v2x: Any, v2y: Any, nx: Any, ny: Any, restitution: Any
) -> tuple[Any, Any]:
    """The impulse and the closing speed. By the lighter ball: the other may be immovable."""
    m1, m2, e = as_float64(m1), as_float64(m2), as_float64(restitution)
    v1x, v1y, v2x, v2y = as_float64(v1x), as_float64(v1y), as_float64(v2x), as_float64(v2y)
    nx, ny, square, _ = normal(as_float64(nx), as_float64(ny))
    closing = dot(v1x - v2x, nx, v1y - v2y, ny)
    first = m1 <= m2
    mass = select(first, m1, m2)
    light, heavy = comparable(mass, select(first, m2, m1))
    return mass * (heavy / ((light + heavy) * square_root(square)) * fused(e, closing, closing)), closing


@formula
def time_of_impact(dx: Any, dy: Any, dvx: Any, dvy: Any, distance: Any) -> Any:
    """The earliest t >= 0 at which two balls that move uniformly touch; inf if they never do.

        t = c / (sqrt(R^2 w^2 - (d x w)^2) - d.w),    c = d^2 - R^2

    for d = (dx, dy) = x2-x1, w = (dvx, dvy) = v2-v1 and R = distance = r1+r2 >= 0, in any consistent set of units.
    0 if they touch or overlap and approach, inf if d.w >= 0, apart or not, NaN where they meet at a time that is too
    large for a float64. An exact graze counts as touching, and so does what only a hundred bits can tell from one.

    The root of |d + w t| = R that does not cancel, from sums of products in twice the precision: its error is at most
    8 eps t + eps^2 d^2/|d.w|, eps = 2^-52, and 2 eps R/|w| more within 2^-100 of a graze. The second term is all there
    is to t where the balls all but touch, when d^2 - R^2 is no more than the rounding of its terms. In a near graze t
    is as good as the arguments: an error of eps in one of them moves it by some eps R^2 / (R^2 - (d x w)^2/w^2), of
    R/|w|, and more. Where R is below 1e-140 |d|, or d.w below 1e-290 of |d||w| or R|w|, products underflow: a graze may
    be decided wrongly then, and balls that overlap be taken to move apart.

    >>> collide.scalar.time_of_impact(5.0, 0.0, -1.0, 0.0, 2.0)
    np.float64(3.0)
    """
    t, _ = impact(dx, dy, dvx, dvy, distance)
    return t


@formula
def impact(dx: Any, dy: Any, dvx: Any, dvy: Any, distance: Any) -> tuple[Any, Any]:
    """The time of impact, NaN if it is too large for a float64, and a number that is small if all is well."""
    dx, dy, dvx, dvy = as_float64(dx), as_float64(dy), as_float64(dvx), as_float64(dvy)
    distance = as_float64(distance)
    # Lengths and velocities near 1, by powers of two: no product overflows, and few underflow.
    length, speed = inverse_power_of_two((dx, dy, distance)), inverse_power_of_two((dvx, dvy))
    dx, dy, reach, wx, wy = length * dx, length * dy, length * distance, speed * dvx, speed * dvy
    along = dot(dx, wx, dy, wy)
    across, across_low = two_dot(dx, wy, -dy, wx)
    square, square_low = two_dot(wx, wx, wy, wy)
    away, away_low = two_dot(dx, dx, dy, dy)
    touching, touching_low = two_product(reach, reach)
    gap, gap_low = two_sum(away, -touching)
    gap = gap + (gap_low + (away_low - touching_low))
    most, most_low = two_product(touching, square)
    least, least_low = two_product(across, across)
    most_low = most_low + (touching * square_low + touching_low * square)
    least_low = least_low + (2.0 * across + across_low) * across_low
    under = (most - least) + (most_low - least_low)
    approach = along < 0.0
    # Within its own error it is 0: an exact graze is a contact, and the root of an error would be some 2**-52 of R|w|.
    slack = 2.0**-102 * most
    t = gap / select(approach, square_root(select(under > slack, under, 0.0)) - along, 1.0)
    # speed / length, where 2/length is the power of two for a length that is one.
    speed, unit = select(approach, speed, 1.0), inverse_power_of_two((length,))
    size, scaled = along + gap, t * (0.5 * speed * unit)
    large = scaled > 2.0**127  # what a float32 does not hold
    if any_lane(large):
        # Perhaps only the product of the factors is too large: the larger first, with room for the t of subnormal
        # velocities, up to 2**54.
        slower = speed < unit
        again = (t * (2.0**-60 * select(slower, unit, speed))) * (2.0**59 * select(slower, speed, unit))
        scaled = select(large, select(again < math.inf, again, math.nan), scaled)
        size = size + scaled
    meet = select(gap <= 0.0, 0.0, select(under >= -slack, scaled, math.inf))
    return select(approach, meet, math.inf), size


# The velocities after, the closing speed, positive when the pair approaches, and the changes (j1, j2, about j1+j2).


@formula
def on_line(m1: Any, m2: Any, v1: Any, v2: Any, restitution: Any) -> tuple[Any, Any, Any]:
    """u = v -+ j and the closing speed v1-v2."""
    v1, v2 = as_float64(v1), as_float64(v2)
    closing = v1 - v2
    j1, j2, j = changes(m1, m2, closing, 0.0, 1.0, None, restitution)
    return (v1 - j1, v2 + j2), closing, (j1, j2, j)


@formula
def in_plane(
    m1: Any, m2: Any, v1x: Any, v1y: Any, v2x: Any, v2y: Any, nx: Any, ny: Any, square: Any, low: Any, restitution: Any
) -> tuple[Any, Any, Any]:
    """u = v -+ j n and the closing speed (v1-v2).n, given n.n = square + low."""
    v1x, v1y, v2x, v2y = as_float64(v1x), as_float64(v1y), as_float64(v2x), as_float64(v2y)
    closing, closing_low = dot_in_two(v1x - v2x, nx, v1y - v2y, ny)
    j1, j2, j = changes(m1, m2, closing, closing_low, square, low, restitution)
    after = fused(-j1, nx, v1x), fused(-j1, ny, v1y), fused(j2, nx, v2x), fused(j2, ny, v2y)
    return after, closing if low is None else closing + closing_low, (j1, j2, j)


@formula
def changes(
    m1: Any, m2: Any, closing: Any, closing_low: Any, square: Any, square_low: Any, restitution: Any
) -> tuple[Any, Any, Any]:
    """j = (1+e) (the other's share of the mass) (v1-v2).n / n.n: how much the velocities of 1 and 2 change along n.

    A first try, and what it leaves of (j1+j2) n.n = (1+e) (v1-v2).n, shared out in the same way: this takes away each
    error that the two have in common, and one division does for both. tests/test_exact.py counts what remains. Without
    `square_low` the low parts are left out: beside angles, whose own rounding is more, they cost 2 % and gain little.
    """
    m1, m2 = comparable(as_float64(m1), as_float64(m2))
    e = as_float64(restitution)
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
def normal(nx: Any, ny: Any) -> tuple[Any, Any, Any, Any]:
    """(nx, ny) at a length between 2**-35 and 2**35, a subnormal one from 2**-51 on, and its square as a sum of two."""
    square, low = dot_in_two(nx, nx, ny, ny)
    extreme = is_beyond(square, 70)
    if any_lane(extreme):
        scale = select(extreme, inverse_power_of_two((nx, ny)), 1.0)
        nx, ny = scale * nx, scale * ny
        square, low = dot_in_two(nx, nx, ny, ny)
    return nx, ny, square, low


@formula
def from_polar(v1: Any, theta1: Any, v2: Any, theta2: Any, phi: Any) -> tuple[Any, Any, Any, Any, Any, Any]:
    """v1x, v1y, v2x, v2y, nx, ny."""
    (s1, c1), (s2, c2), (s, c) = sincos(as_float64(theta1), as_float64(theta2), as_float64(phi))
    return v1 * c1, v1 * s1, v2 * c2, v2 * s2, c, s
