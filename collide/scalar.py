"""The functions for ONE pair; their formulas are in _formulas/.

Every function runs as plain Python on floats and NumPy arrays, compiles inside anyone's `@njit` code, and is what the
batch functions run. Masses m1 and m2, velocities v before and u after, e the coefficient of restitution.

    in 1D       ball 1 is on the left: the pair approaches when v1 > v2
    in 2D, 3D   n, of any length but 0, points from ball 1 to ball 2: it approaches when (v1 - v2).n > 0
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

from typing import Any

from ._compile.options import one_pair
from ._formulas.collision import collision, impulse, in_polar_form, in_space, in_the_plane, on_a_line
from ._formulas.impact import impact

__all__ = [
    "impulse_2d",
    "impulse_3d",
    "resolve_1d",
    "resolve_2d",
    "resolve_3d",
    "resolve_polar",
    "time_of_impact",
    "time_of_impact_3d",
]


@one_pair
def resolve_1d(m1: Any, m2: Any, v1: Any, v2: Any, restitution: Any = 1.0) -> tuple[Any, Any]:
    """Velocities (u1, u2) after a collision on a line.

    m1, m2: masses; v1, v2: velocities, ball 1 on the left; restitution: e. Numbers, in any consistent set of units.

    >>> collide.scalar.resolve_1d(0.5, 3.5, 4.0, 0.0)
    (np.float64(-3.0), np.float64(1.0))
    """
    u1, u2, _, _ = collision(*on_a_line(m1, m2, v1, v2, restitution))
    return (*u1, *u2)


@one_pair
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
    u1, u2, _, _ = collision(*in_the_plane(m1, m2, v1x, v1y, v2x, v2y, nx, ny, restitution))
    return (*u1, *u2)


@one_pair
def resolve_3d(
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
    restitution: Any = 1.0,
) -> tuple[Any, Any, Any, Any, Any, Any]:
    """Velocities (u1x, u1y, u1z, u2x, u2y, u2z) after a collision in space.

        u1 = v1 - (1+e) m2/(m1+m2) ((v1-v2).n / n.n) n        u2 = v2 + (1+e) m1/(m1+m2) ((v1-v2).n / n.n) n

    m1, m2: masses; v1x, v1y, v1z, v2x, v2y, v2z: velocity components; nx, ny, nz: a vector of any length from ball 1 to
    ball 2 along the line of centres; restitution: e. Numbers, in any consistent set of units. Where v1z, v2z and nz are
    0 the other components have the bits of `resolve_2d`.

    >>> [float(u) for u in collide.scalar.resolve_3d(1.0, 1.0, 0.0, 0.0, 3.0, 0.0, 0.0, 0.0, 0.0, 1.0, 1.0)]
    [0.0, -1.5, 1.5, 0.0, 1.5, 1.5]
    """
    u1, u2, _, _ = collision(*in_space(m1, m2, v1x, v1y, v1z, v2x, v2y, v2z, nx, ny, nz, restitution))
    return (*u1, *u2)


@one_pair
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
    u1, u2, _, _ = collision(*in_polar_form(m1, m2, v1, theta1, v2, theta2, phi, restitution))
    return (*u1, *u2)


@one_pair
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
    p, _ = impulse(*in_the_plane(m1, m2, v1x, v1y, v2x, v2y, nx, ny, restitution))
    return p


@one_pair
def impulse_3d(
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
    restitution: Any = 1.0,
) -> Any:
    """The impulse on ball 2 along n/|n| in a collision in space, positive for a pair that approaches.

        p = (1+e) m1 m2/(m1+m2) (v1-v2).n / |n|

    The arguments are those of `resolve_3d`; the result is in units of mass times velocity. It is off by at most
    20 * 2**-52 of the lighter mass times the largest velocity component before or after, and where v1z, v2z and nz are
    0 it has the bits of `impulse_2d`.

    >>> collide.scalar.impulse_3d(1.0, 1.0, 2.0, 0.0, 0.0, 0.0, 0.0, 0.0, 3.0, 0.0, 0.0)
    np.float64(2.0)
    """
    p, _ = impulse(*in_space(m1, m2, v1x, v1y, v1z, v2x, v2y, v2z, nx, ny, nz, restitution))
    return p


@one_pair
def time_of_impact(dx: Any, dy: Any, dvx: Any, dvy: Any, distance: Any) -> Any:
    """The earliest t >= 0 at which two balls that move uniformly touch; inf if they never do.

        t = c / (sqrt(R^2 w^2 - (d x w)^2) - d.w),    c = d^2 - R^2

    for d = (dx, dy) = x2-x1, w = (dvx, dvy) = v2-v1 and R = distance = r1+r2 >= 0, in any consistent set of units.
    0 if they touch or overlap and approach, inf if d.w >= 0, apart or not, NaN where they meet at a time that is too
    large for a float64. An exact graze counts as touching, and so does what only a hundred bits can tell from one.

    The root of |d + w t| = R that does not cancel, in twice the precision wherever plain one may not do: its error is
    at most 8 eps t + eps^2 d^2/|d.w|, eps = 2^-52, and 2 eps R/|w| more within 2^-100 of a graze. The second term is
    all there is to t where the balls all but touch, when d^2 - R^2 is no more than the rounding of its terms. In a near
    graze t is as good as the arguments: an error of eps in one of them moves it by some eps R^2 /
    (R^2 - (d x w)^2/w^2), of R/|w|, and more. Where R is below 1e-140 |d|, or d.w below 1e-290 of |d||w| or R|w|,
    products underflow: a graze may be decided wrongly then, and balls that overlap be taken to move apart.

    >>> collide.scalar.time_of_impact(5.0, 0.0, -1.0, 0.0, 2.0)
    np.float64(3.0)
    """
    t, _ = impact((dx, dy), (dvx, dvy), distance)
    return t


@one_pair
def time_of_impact_3d(dx: Any, dy: Any, dz: Any, dvx: Any, dvy: Any, dvz: Any, distance: Any) -> Any:
    """The earliest t >= 0 at which two balls that move uniformly in space touch; inf if they never do.

        t = c / (sqrt(R^2 w^2 - |d x w|^2) - d.w),    c = d^2 - R^2

    for d = (dx, dy, dz) = x2-x1, w = (dvx, dvy, dvz) = v2-v1 and R = distance = r1+r2 >= 0, in any consistent set of
    units. All that `time_of_impact` says of its result holds here, and where dz and dvz are 0 it is the same number. Of
    d.w only what is above 2^-100 |d||w| has a sign: below it a pair may be taken to move apart.

    >>> collide.scalar.time_of_impact_3d(2.0, 3.0, 6.0, -2.0, -3.0, -6.0, 3.5)
    np.float64(0.5)
    """
    t, _ = impact((dx, dy, dz), (dvx, dvy, dvz), distance)
    return t
