"""The functions for ONE pair; their formulas are in _formulas/.

Every function takes numbers, runs as plain Python, compiles inside anyone's `@njit` code, and is what the batch
functions run. (On NumPy arrays it runs by NumPy's own operations, which tests use; types do not tell of it.) Masses m1
and m2, velocities v before and u after, e the coefficient of restitution.

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

# Long by its docstrings, which stand in full where editors look for them: each function is a line.
from ._compile.options import one_pair
from ._formulas.collision import collision, impulse, in_polar_form, in_space, in_the_plane, on_a_line
from ._formulas.impact import impact
from ._typing import Number

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


def __dir__() -> list[str]:
    return __all__


@one_pair
def resolve_1d(m1: Number, m2: Number, v1: Number, v2: Number, restitution: Number = 1.0) -> tuple[float, float]:
    """Compute the velocities after a collision on a line.

        u1 = v1 - (1+e) m2/(m1+m2) (v1-v2)        u2 = v2 + (1+e) m1/(m1+m2) (v1-v2)

    From conservation of momentum and the definition of e; at e = 1 the textbook's [1]_ u1 = (2 m2 v2 + (m1-m2)
    v1)/(m1+m2) and u2 = (2 m1 v1 + (m2-m1) v2)/(m1+m2).

    Parameters
    ----------
    m1, m2 : float
        Masses, >= 0. inf is an immovable ball (a wall), 0 a test particle; not both of a pair inf, nor both 0.
    v1, v2 : float
        Velocities before, ball 1 on the left, in any consistent set of units.
    restitution : float, optional
        Coefficient of restitution e, finite and >= 0: 1 is elastic, 0 takes away all relative velocity along the line
        of centres. Above 1 the collision adds energy.

    Returns
    -------
    tuple of 2 floats
        (u1, u2), in the unit of the velocities before.

    Raises
    ------
    numba.TypingError
        In compiled code, where an argument is an array, a tuple or a list.

    See Also
    --------
    resolve_2d, resolve_3d : In the plane and in space.
    collide.resolve_1d : The same for batches of pairs, with checks.

    Notes
    -----
    The arithmetic is float64, whatever the arguments are. Nothing is checked: a pair that breaks a rule above gives
    unspecified values, and one that does not approach (v1 <= v2) collides like any other. A velocity is off by at most
    8 * 2**-52 of the pair's largest component before or after, and (1+e)/2 times that where e > 1.

    References
    ----------
    .. [1] L. D. Landau, E. M. Lifshitz, Mechanics, 3rd edition, Butterworth-Heinemann, 1976, section 17.

    Examples
    --------
    >>> collide.scalar.resolve_1d(0.5, 3.5, 4.0, 0.0)
    (np.float64(-3.0), np.float64(1.0))
    """
    u1, u2, _, _ = collision(*on_a_line(m1, m2, v1, v2, restitution))
    return (*u1, *u2)


@one_pair
def resolve_2d(
    m1: Number,
    m2: Number,
    v1x: Number,
    v1y: Number,
    v2x: Number,
    v2y: Number,
    nx: Number,
    ny: Number,
    restitution: Number = 1.0,
) -> tuple[float, float, float, float]:
    """Compute the velocities after a collision in the plane, between smooth balls that do not spin.

        u1 = v1 - (1+e) m2/(m1+m2) ((v1-v2).n / n.n) n        u2 = v2 + (1+e) m1/(m1+m2) ((v1-v2).n / n.n) n

    The collision on a line, along the line of centres; across it nothing changes.

    Parameters
    ----------
    m1, m2 : float
        Masses, >= 0. inf is an immovable ball (a wall), 0 a test particle; not both of a pair inf, nor both 0.
    v1x, v1y, v2x, v2y : float
        Velocity components before, in any consistent set of units.
    nx, ny : float
        A vector n along the line of centres, from ball 1 to ball 2, of any length but 0; x2-x1, y2-y1 will do.
    restitution : float, optional
        Coefficient of restitution e, finite and >= 0: 1 is elastic, 0 takes away all relative velocity along the line
        of centres. Above 1 the collision adds energy.

    Returns
    -------
    tuple of 4 floats
        (u1x, u1y, u2x, u2y), in the unit of the velocities before.

    Raises
    ------
    numba.TypingError
        In compiled code, where an argument is an array, a tuple or a list.

    See Also
    --------
    resolve_polar : The same from speeds and directions.
    impulse_2d : What such a collision transfers.
    collide.resolve_2d : The same for batches of pairs, with checks.

    Notes
    -----
    The arithmetic is float64, whatever the arguments are. Nothing is checked: a pair that breaks a rule above gives
    unspecified values, and one that does not approach ((v1-v2).n <= 0) collides like any other. A velocity is off by at
    most 8 * 2**-52 of the pair's largest component before or after, and (1+e)/2 times that where e > 1.

    Examples
    --------
    A ball bounces off a wall that is at an angle, in a kernel of one's own:

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
    m1: Number,
    m2: Number,
    v1x: Number,
    v1y: Number,
    v1z: Number,
    v2x: Number,
    v2y: Number,
    v2z: Number,
    nx: Number,
    ny: Number,
    nz: Number,
    restitution: Number = 1.0,
) -> tuple[float, float, float, float, float, float]:
    """Compute the velocities after a collision in space, between smooth balls that do not spin.

        u1 = v1 - (1+e) m2/(m1+m2) ((v1-v2).n / n.n) n        u2 = v2 + (1+e) m1/(m1+m2) ((v1-v2).n / n.n) n

    The collision on a line, along the line of centres; across it nothing changes. Where v1z, v2z and nz are 0 the other
    components have the bits of `resolve_2d`, but for the signs of zeros.

    Parameters
    ----------
    m1, m2 : float
        Masses, >= 0. inf is an immovable ball (a wall), 0 a test particle; not both of a pair inf, nor both 0.
    v1x, v1y, v1z, v2x, v2y, v2z : float
        Velocity components before, in any consistent set of units.
    nx, ny, nz : float
        A vector n along the line of centres, from ball 1 to ball 2, of any length but 0; x2-x1, y2-y1, z2-z1 will do.
    restitution : float, optional
        Coefficient of restitution e, finite and >= 0: 1 is elastic, 0 takes away all relative velocity along the line
        of centres. Above 1 the collision adds energy.

    Returns
    -------
    tuple of 6 floats
        (u1x, u1y, u1z, u2x, u2y, u2z), in the unit of the velocities before.

    Raises
    ------
    numba.TypingError
        In compiled code, where an argument is an array, a tuple or a list.

    See Also
    --------
    impulse_3d : What such a collision transfers.
    collide.resolve_3d : The same for batches of pairs, with checks.

    Notes
    -----
    The arithmetic is float64, whatever the arguments are. Nothing is checked: a pair that breaks a rule above gives
    unspecified values, and one that does not approach ((v1-v2).n <= 0) collides like any other. A velocity is off by at
    most 8 * 2**-52 of the pair's largest component before or after, and (1+e)/2 times that where e > 1.

    Examples
    --------
    >>> [float(u) for u in collide.scalar.resolve_3d(1.0, 1.0, 0.0, 0.0, 3.0, 0.0, 0.0, 0.0, 0.0, 1.0, 1.0)]
    [0.0, -1.5, 1.5, 0.0, 1.5, 1.5]
    """
    u1, u2, _, _ = collision(*in_space(m1, m2, v1x, v1y, v1z, v2x, v2y, v2z, nx, ny, nz, restitution))
    return (*u1, *u2)


@one_pair
def resolve_polar(
    m1: Number,
    m2: Number,
    v1: Number,
    theta1: Number,
    v2: Number,
    theta2: Number,
    phi: Number,
    restitution: Number = 1.0,
) -> tuple[float, float, float, float]:
    """Compute velocity components after a collision in the plane, from speeds and directions.

        u1x = [(m1 - e m2) v1 cos(theta1-phi) + (1+e) m2 v2 cos(theta2-phi)]/(m1+m2) * cos(phi)
              + v1 sin(theta1-phi) cos(phi + pi/2)

    u1y with sin in place of the last cosines, u2 with 1 and 2 exchanged. Computed as `resolve_2d` of
    v1 (cos(theta1), sin(theta1)), v2 (cos(theta2), sin(theta2)) and n = (cos(phi), sin(phi)), which is the same and
    keeps its accuracy for angles of any size.

    Parameters
    ----------
    m1, m2 : float
        Masses, >= 0. inf is an immovable ball (a wall), 0 a test particle; not both of a pair inf, nor both 0.
    v1, theta1, v2, theta2 : float
        Speeds before, in any consistent set of units, and their directions, in radians.
    phi : float
        Direction of the line of centres, from ball 1 to ball 2, in radians.
    restitution : float, optional
        Coefficient of restitution e, finite and >= 0: 1 is elastic, 0 takes away all relative velocity along the line
        of centres. Above 1 the collision adds energy.

    Returns
    -------
    tuple of 4 floats
        (u1x, u1y, u2x, u2y), in the unit of the velocities before.

    Raises
    ------
    numba.TypingError
        In compiled code, where an argument is an array, a tuple or a list.

    See Also
    --------
    resolve_2d : The same from components.
    collide.resolve_polar : The same for batches of pairs, with checks.

    Notes
    -----
    The arithmetic is float64, whatever the arguments are. Nothing is checked: a pair that breaks a rule above gives
    unspecified values, and one that does not approach (v1 cos(theta1-phi) <= v2 cos(theta2-phi)) collides like any
    other. A velocity is off by at most 10 * 2**-52 of the pair's largest component before or after, and (1+e)/2 times
    that where e > 1. Sine and cosine are reduced as in [1]_ and within 1 ulp for every finite angle; uncompiled they
    are NumPy's.

    References
    ----------
    .. [1] W. J. Cody, W. Waite, Software Manual for the Elementary Functions, Prentice-Hall, 1980.

    Examples
    --------
    >>> [round(float(u), 15) for u in collide.scalar.resolve_polar(1.0, 1.0, 2.0, 0.0, 0.0, 0.0, np.pi / 4)]
    [1.0, -1.0, 1.0, 1.0]
    """
    u1, u2, _, _ = collision(*in_polar_form(m1, m2, v1, theta1, v2, theta2, phi, restitution))
    return (*u1, *u2)


@one_pair
def impulse_2d(
    m1: Number,
    m2: Number,
    v1x: Number,
    v1y: Number,
    v2x: Number,
    v2y: Number,
    nx: Number,
    ny: Number,
    restitution: Number = 1.0,
) -> float:
    """Compute the impulse on ball 2 along n/|n| in a collision in the plane.

        p = (1+e) m1 m2/(m1+m2) (v1-v2).n / |n|

    What `resolve_2d` transfers: m2 (u2-v2) = p n/|n| = -m1 (u1-v1). It is positive for a pair that approaches.

    Parameters
    ----------
    m1, m2 : float
        Masses, >= 0. inf is an immovable ball (a wall), 0 a test particle; not both of a pair inf, nor both 0.
    v1x, v1y, v2x, v2y : float
        Velocity components before, in any consistent set of units.
    nx, ny : float
        A vector n along the line of centres, from ball 1 to ball 2, of any length but 0; x2-x1, y2-y1 will do.
    restitution : float, optional
        Coefficient of restitution e, finite and >= 0: 1 is elastic, 0 takes away all relative velocity along the line
        of centres. Above 1 the collision adds energy.

    Returns
    -------
    float
        The impulse p, mass times velocity.

    Raises
    ------
    numba.TypingError
        In compiled code, where an argument is an array, a tuple or a list.

    See Also
    --------
    resolve_2d : The velocities after the same collision.
    collide.impulse_2d : The same for batches of pairs, with checks.

    Notes
    -----
    The arithmetic is float64, whatever the arguments are. Nothing is checked: a pair that breaks a rule above gives
    unspecified values, and one that does not approach ((v1-v2).n <= 0) collides like any other. An impulse is off by at
    most 16 * 2**-52 of the lighter mass times the largest velocity component before or after.

    Examples
    --------
    >>> collide.scalar.impulse_2d(1.0, 1.0, 2.0, 0.0, 0.0, 0.0, 3.0, 0.0)
    np.float64(2.0)
    """
    p: float = impulse(*in_the_plane(m1, m2, v1x, v1y, v2x, v2y, nx, ny, restitution))[0]
    return p


@one_pair
def impulse_3d(
    m1: Number,
    m2: Number,
    v1x: Number,
    v1y: Number,
    v1z: Number,
    v2x: Number,
    v2y: Number,
    v2z: Number,
    nx: Number,
    ny: Number,
    nz: Number,
    restitution: Number = 1.0,
) -> float:
    """Compute the impulse on ball 2 along n/|n| in a collision in space.

        p = (1+e) m1 m2/(m1+m2) (v1-v2).n / |n|

    What `resolve_3d` transfers: m2 (u2-v2) = p n/|n| = -m1 (u1-v1). It is positive for a pair that approaches. Where
    v1z, v2z and nz are 0 it has the bits of `impulse_2d`.

    Parameters
    ----------
    m1, m2 : float
        Masses, >= 0. inf is an immovable ball (a wall), 0 a test particle; not both of a pair inf, nor both 0.
    v1x, v1y, v1z, v2x, v2y, v2z : float
        Velocity components before, in any consistent set of units.
    nx, ny, nz : float
        A vector n along the line of centres, from ball 1 to ball 2, of any length but 0; x2-x1, y2-y1, z2-z1 will do.
    restitution : float, optional
        Coefficient of restitution e, finite and >= 0: 1 is elastic, 0 takes away all relative velocity along the line
        of centres. Above 1 the collision adds energy.

    Returns
    -------
    float
        The impulse p, mass times velocity.

    Raises
    ------
    numba.TypingError
        In compiled code, where an argument is an array, a tuple or a list.

    See Also
    --------
    resolve_3d : The velocities after the same collision.
    collide.impulse_3d : The same for batches of pairs, with checks.

    Notes
    -----
    The arithmetic is float64, whatever the arguments are. Nothing is checked: a pair that breaks a rule above gives
    unspecified values, and one that does not approach ((v1-v2).n <= 0) collides like any other. An impulse is off by at
    most 20 * 2**-52 of the lighter mass times the largest velocity component before or after.

    Examples
    --------
    >>> collide.scalar.impulse_3d(1.0, 1.0, 2.0, 0.0, 0.0, 0.0, 0.0, 0.0, 3.0, 0.0, 0.0)
    np.float64(2.0)
    """
    p: float = impulse(*in_space(m1, m2, v1x, v1y, v1z, v2x, v2y, v2z, nx, ny, nz, restitution))[0]
    return p


@one_pair
def time_of_impact(dx: Number, dy: Number, dvx: Number, dvy: Number, distance: Number) -> float:
    """Compute the earliest time t >= 0 at which two balls that move uniformly in the plane touch.

        t = c / (sqrt(R^2 w^2 - (d x w)^2) - d.w),    c = d^2 - R^2

    The root of |d + w t| = R [1]_ that does not cancel; inf if they never touch. 0 for a pair that touches or overlaps
    and approaches; inf wherever d.w >= 0, apart or not; an exact graze counts as touching, and so does what only a
    hundred bits can tell from one.

    Parameters
    ----------
    dx, dy : float
        Components of d = x2-x1, from ball 1 to ball 2, in any consistent set of units.
    dvx, dvy : float
        Components of w = v2-v1, the velocity of ball 2 seen from ball 1.
    distance : float
        The distance R = r1+r2 of the centres at which the balls touch, finite and >= 0.

    Returns
    -------
    float
        The time t; NaN where they meet at a time that is too large for a float64.

    Raises
    ------
    numba.TypingError
        In compiled code, where an argument is an array, a tuple or a list.

    See Also
    --------
    time_of_impact_3d : The same in space.
    collide.time_of_impact : The same for batches of pairs, with checks.

    Notes
    -----
    The arithmetic is float64, whatever the arguments are, and twice that precision [2]_ wherever plain one may not do.
    Nothing is checked: a pair that breaks a rule above gives unspecified values. A time is off by at most 8 eps t +
    eps**2 d^2/|d.w|, with eps = 2**-52, and 2 eps R/|w| more within 2**-100 of a graze. The second term is all there is
    to t where the balls all but touch, when d^2 - R^2 is no more than the rounding of its terms.

    In a near graze t is as good as the arguments: an error of eps in one of them moves it by some
    eps R^2 / (R^2 - (d x w)^2/w^2), of R/|w|, and more. Where R is below 1e-140 |d|, or d.w below 1e-290 of |d||w| or
    R|w|, products underflow: a graze may be decided wrongly then, and balls that overlap be taken to move apart.

    References
    ----------
    .. [1] B. J. Alder, T. E. Wainwright, Studies in Molecular Dynamics. I. General Method, J. Chem. Phys. 31, 459,
       1959.
    .. [2] T. J. Dekker, A floating-point technique for extending the available precision, Numer. Math. 18, 224, 1971.

    Examples
    --------
    >>> collide.scalar.time_of_impact(5.0, 0.0, -1.0, 0.0, 2.0)
    np.float64(3.0)
    """
    t: float = impact((dx, dy), (dvx, dvy), distance)[0]
    return t


@one_pair
def time_of_impact_3d(
    dx: Number, dy: Number, dz: Number, dvx: Number, dvy: Number, dvz: Number, distance: Number
) -> float:
    """Compute the earliest time t >= 0 at which two balls that move uniformly in space touch.

        t = c / (sqrt(R^2 w^2 - |d x w|^2) - d.w),    c = d^2 - R^2

    The root of |d + w t| = R that does not cancel; inf if they never touch. 0 for a pair that touches or overlaps
    and approaches; inf wherever d.w >= 0, apart or not; an exact graze counts as touching, and so does what only a
    hundred bits can tell from one.

    Parameters
    ----------
    dx, dy, dz : float
        Components of d = x2-x1, from ball 1 to ball 2, in any consistent set of units.
    dvx, dvy, dvz : float
        Components of w = v2-v1, the velocity of ball 2 seen from ball 1.
    distance : float
        The distance R = r1+r2 of the centres at which the balls touch, finite and >= 0.

    Returns
    -------
    float
        The time t; NaN where they meet at a time that is too large for a float64.

    Raises
    ------
    numba.TypingError
        In compiled code, where an argument is an array, a tuple or a list.

    See Also
    --------
    time_of_impact : The same in the plane; where dz and dvz are 0 it is the same number.
    collide.time_of_impact_3d : The same for batches of pairs, with checks.

    Notes
    -----
    All that `time_of_impact` says of its error and of near grazes holds here. Of d.w only what is above 2**-100 |d||w|
    has a sign: below it a pair may be taken to move apart. Nothing is checked: a pair that breaks a rule above gives
    unspecified values.

    Examples
    --------
    >>> collide.scalar.time_of_impact_3d(2.0, 3.0, 6.0, -2.0, -3.0, -6.0, 3.5)
    np.float64(0.5)
    """
    t: float = impact((dx, dy, dz), (dvx, dvy, dvz), distance)[0]
    return t
