"""The batch functions: one collision for every element of arrays that broadcast together."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from typing import Any, NamedTuple, TypeVar

from numpy.typing import ArrayLike

from ._pairs import execution, vectors
from ._pairs.forms import FORM_1D, FORM_2D, FORM_3D, FORM_POLAR, IMPACT, IMPACT_3D, IMPULSE_2D, IMPULSE_3D
from ._typing import Array

Function = TypeVar("Function", bound=Callable[..., Any])


class Velocities1D(NamedTuple):
    """Velocities after the collisions, in the unit of the velocities before."""

    u1: Any
    u2: Any


class Velocities(NamedTuple):
    """Velocity vectors after the collisions, in the unit of the velocities before."""

    u1: Any
    u2: Any


class Velocities2D(NamedTuple):
    """Velocity components after the collisions, in the unit of the velocities before."""

    u1x: Any
    u1y: Any
    u2x: Any
    u2y: Any


class Velocities3D(NamedTuple):
    """Velocity components after the collisions, in the unit of the velocities before."""

    u1x: Any
    u1y: Any
    u1z: Any
    u2x: Any
    u2y: Any
    u2z: Any


_new = tuple.__new__  # a named tuple's own takes twice as long, a fortieth of a small call

_SHARED = """
    All arguments are numbers or arrays of bool, integer, float16, float32 or float64, and broadcast together by NumPy's
    rules; a scalar stays one. Units: any consistent set; angles in radians.

    m1, m2: masses, >= 0. inf is an immovable ball (a wall), 0 a test particle; not both of a pair inf, nor both 0.{own}
    restitution: e, finite and >= 0. 1 is elastic; 0 takes away all relative velocity along the line of centres.
    approaching_only: bool. True {leaves} pairs that do not approach{approach}, two immovable balls among
        them.
    invalid: what happens to a pair that breaks a rule above, or whose result is too large for its dtype:
        "raise"  InvalidPairError; all other pairs are resolved, and this one gets what "keep" gives
        "keep"   it {kept}
        "nan"    it gets NaN
    out: None, or {out} of the result's shape and dtype to write to. The inputs themselves will do,
        which is the in-place form; any other overlap gives what copies of the inputs would have given.

    Returns {returns}: float32 where np.result_type of the inputs is float32 or float16 (Python scalars are weak), else
    float64; scalars if all inputs are scalars. The arithmetic is float64 throughout, so a float32 result is the float64
    result rounded once.

    Raises InvalidPairError (a ValueError) as said; ValueError for shapes that do not match, a read-only or doubled out,
    an unknown `invalid`; TypeError for other dtypes, masked arrays, an out of another dtype.
"""


_IN_PLANE = {
    "own": """
v1x, v1y, v2x, v2y: velocity components.
nx, ny: a vector n along the line of centres, from ball 1 to ball 2, of any length but 0; x2-x1, y2-y1 will do.""",
    "approach": " ((v1-v2).n <= 0)",
}


def _shared(**words: str) -> Callable[[Function], Function]:
    def documented(function: Function) -> Function:
        if function.__doc__:  # not so under python -OO
            opening, _, example = inspect.cleandoc(function.__doc__).partition("---\n")
            function.__doc__ = f"{opening}\n{inspect.cleandoc(_SHARED).format(**words)}\n\n{example}"
        return function

    return documented


@_shared(
    own="\nv1, v2: velocities, ball 1 on the left.",
    approach=" (v1 <= v2)",
    leaves="leaves as they are the",
    kept="keeps its velocities",
    out="a tuple of 2 arrays",
    returns="the named tuple (u1, u2)",
)
def resolve_1d(
    m1: ArrayLike,
    m2: ArrayLike,
    v1: ArrayLike,
    v2: ArrayLike,
    *,
    restitution: ArrayLike = 1.0,
    approaching_only: bool = False,
    invalid: str = "raise",
    out: tuple[Array, Array] | None = None,
) -> Velocities1D:
    """Velocities after collisions on a line.

        u1 = v1 - (1+e) m2/(m1+m2) (v1-v2)        u2 = v2 + (1+e) m1/(m1+m2) (v1-v2)

    From conservation of momentum and the definition of e; at e = 1 the textbook's
    u1 = (2 m2 v2 + (m1-m2) v1)/(m1+m2) and u2 = (2 m1 v1 + (m2-m1) v2)/(m1+m2).
    ---
    >>> collide.resolve_1d(0.5, 3.5, [4.0, 8.0], 0.0)
    Velocities1D(u1=array([-3., -6.]), u2=array([1., 2.]))
    """
    inputs = m1, m2, v1, v2, restitution
    return _new(Velocities1D, execution.call(FORM_1D, inputs, approaching_only, invalid, out))


@_shared(
    **_IN_PLANE,
    leaves="leaves as they are the",
    kept="keeps its velocities",
    out="a tuple of 4 arrays",
    returns="the named tuple (u1x, u1y, u2x, u2y)",
)
def resolve_2d(
    m1: ArrayLike,
    m2: ArrayLike,
    v1x: ArrayLike,
    v1y: ArrayLike,
    v2x: ArrayLike,
    v2y: ArrayLike,
    nx: ArrayLike,
    ny: ArrayLike,
    *,
    restitution: ArrayLike = 1.0,
    approaching_only: bool = False,
    invalid: str = "raise",
    out: tuple[Array, Array, Array, Array] | None = None,
) -> Velocities2D:
    """Velocities after collisions in the plane, between smooth balls that do not spin.

        u1 = v1 - (1+e) m2/(m1+m2) ((v1-v2).n / n.n) n        u2 = v2 + (1+e) m1/(m1+m2) ((v1-v2).n / n.n) n

    The collision on a line, along the line of centres; across it nothing changes.
    ---
    A ball meets its equal, at rest, 45 degrees off centre:

    >>> collide.resolve_2d(1.0, 1.0, [2.0], 0.0, 0.0, 0.0, 1.0, 1.0)
    Velocities2D(u1x=array([1.]), u1y=array([-1.]), u2x=array([1.]), u2y=array([1.]))
    """
    inputs = m1, m2, v1x, v1y, v2x, v2y, nx, ny, restitution
    return _new(Velocities2D, execution.call(FORM_2D, inputs, approaching_only, invalid, out))


def resolve_3d(
    m1: ArrayLike,
    m2: ArrayLike,
    v1x: ArrayLike,
    v1y: ArrayLike,
    v1z: ArrayLike,
    v2x: ArrayLike,
    v2y: ArrayLike,
    v2z: ArrayLike,
    nx: ArrayLike,
    ny: ArrayLike,
    nz: ArrayLike,
    *,
    restitution: ArrayLike = 1.0,
    approaching_only: bool = False,
    invalid: str = "raise",
    out: tuple[Array, Array, Array, Array, Array, Array] | None = None,
) -> Velocities3D:
    """Velocities after collisions in space, between smooth balls that do not spin.

        u1 = v1 - (1+e) m2/(m1+m2) ((v1-v2).n / n.n) n        u2 = v2 + (1+e) m1/(m1+m2) ((v1-v2).n / n.n) n

    The collision on a line, along the line of centres; across it nothing changes. Where v1z, v2z and nz are 0 the other
    components have the bits of `resolve_2d`.

    Parameters
    ----------
    m1, m2 : array_like
        Masses, >= 0. inf is an immovable ball (a wall), 0 a test particle; not both of a pair inf, nor both 0.
    v1x, v1y, v1z, v2x, v2y, v2z : array_like
        Velocity components before. Any consistent set of units.
    nx, ny, nz : array_like
        A vector n along the line of centres, from ball 1 to ball 2, of any length but 0; x2-x1, y2-y1, z2-z1 will do.
    restitution : array_like, optional
        e, finite and >= 0. 1 is elastic; 0 takes away all relative velocity along the line of centres.
    approaching_only : bool, optional
        True leaves as they are the pairs that do not approach ((v1-v2).n <= 0), two immovable balls among them.
    invalid : {"raise", "keep", "nan"}, optional
        What happens to a pair that breaks a rule above, or whose result is too large for its dtype: "raise"
        raises InvalidPairError when all other pairs are resolved, and this one has what "keep" gives it; under "keep"
        it keeps its velocities; under "nan" it gets NaN.
    out : tuple of 6 arrays of the result's shape and dtype, optional
        Where the results go. The inputs themselves will do, which is the in-place form; any other overlap gives what
        copies of the inputs would have given.

    Returns
    -------
    Velocities3D
        The named tuple (u1x, u1y, u1z, u2x, u2y, u2z): float32 where np.result_type of the inputs is float32 or float16
        (Python scalars are weak), else float64; scalars if all inputs are scalars. The arithmetic is float64
        throughout. All arguments broadcast together by NumPy's rules; bool, integers, float16, float32 and float64 are
        taken.

    Raises
    ------
    InvalidPairError
        As said. It is a ValueError.
    ValueError
        For shapes that do not match, a read-only or doubled out, an unknown `invalid`.
    TypeError
        For other dtypes, masked arrays, an out of another dtype.

    Examples
    --------
    A ball that falls meets its equal, at rest, 45 degrees off centre:

    >>> u = collide.resolve_3d(1.0, 1.0, 0.0, 0.0, [-2.0], 0.0, 0.0, 0.0, 0.0, 1.0, -1.0)
    >>> u.u1y, u.u1z, u.u2y, u.u2z
    (array([-1.]), array([-1.]), array([1.]), array([-1.]))
    """
    inputs = m1, m2, v1x, v1y, v1z, v2x, v2y, v2z, nx, ny, nz, restitution
    return _new(Velocities3D, execution.call(FORM_3D, inputs, approaching_only, invalid, out))


def resolve(
    m1: ArrayLike,
    m2: ArrayLike,
    v1: ArrayLike,
    v2: ArrayLike,
    n: ArrayLike,
    *,
    restitution: ArrayLike = 1.0,
    approaching_only: bool = False,
    invalid: str = "raise",
    out: tuple[Array, Array] | None = None,
) -> Velocities:
    """Velocities after collisions, of vectors that lie along the last axis of arrays: the rows of (N, 2) or (N, 3).

        u1 = v1 - (1+e) m2/(m1+m2) ((v1-v2).n / n.n) n        u2 = v2 + (1+e) m1/(m1+m2) ((v1-v2).n / n.n) n

    The bits of `resolve_2d` and `resolve_3d`, which say where the formula is from, at the speed of columns.

    Parameters
    ----------
    m1, m2 : array_like, shape (...)
        Masses, >= 0. inf is an immovable ball (a wall), 0 a test particle; not both of a pair inf, nor both 0.
    v1, v2 : array_like, shape (..., d), d = 2 or 3
        Velocities before. Any consistent set of units.
    n : array_like, shape (..., d)
        Vectors along the line of centres, from ball 1 to ball 2, of any length but 0; x2-x1 will do.
    restitution : array_like, shape (...), optional
        e, finite and >= 0. 1 is elastic; 0 takes away all relative velocity along the line of centres.
    approaching_only : bool, optional
        True leaves as they are the pairs that do not approach ((v1-v2).n <= 0), two immovable balls among them.
    invalid : {"raise", "keep", "nan"}, optional
        What happens to a pair that breaks a rule above, or whose result is too large for its dtype: "raise"
        raises InvalidPairError when all other pairs are resolved, and this one has what "keep" gives it; under "keep"
        it keeps its velocities; under "nan" it gets NaN.
    out : tuple of 2 arrays of the result's shape and dtype, optional
        Where the results go. v1 and v2 themselves will do, which is the in-place form; any other overlap gives what
        copies of the inputs would have given.

    Returns
    -------
    Velocities
        The named tuple (u1, u2), C-contiguous arrays of shape (..., d) unless `out` is given: float32 where
        np.result_type of the inputs is float32 or float16 (Python scalars are weak), else float64. The arithmetic is
        float64 throughout. Axes before the last broadcast together by NumPy's rules; bool, integers, float16, float32
        and float64 are taken.

    Raises
    ------
    InvalidPairError
        As said; its `index` is that of the pair, without the last axis. It is a ValueError.
    ValueError
        For vectors of another length, shapes that do not match, a read-only or doubled out, an unknown `invalid`.
    TypeError
        For other dtypes, masked arrays, an out of another dtype.

    Examples
    --------
    A ball meets its equal, at rest, 45 degrees off centre:

    >>> collide.resolve(1.0, 1.0, [[2.0, 0.0]], [0.0, 0.0], [1.0, 1.0])
    Velocities(u1=array([[ 1., -1.]]), u2=array([[1., 1.]]))
    """
    inputs = m1, m2, v1, v2, n, restitution
    return _new(Velocities, vectors.call(inputs, approaching_only, invalid, out))


@_shared(
    own="""
v1, v2: speeds; theta1, theta2: their directions.
phi: direction of the line of centres, from ball 1 to ball 2.""",
    approach=" (v1 cos(theta1-phi) <= v2 cos(theta2-phi))",
    leaves="leaves as they are the",
    kept="keeps its velocities, v cos(theta) and v sin(theta)",
    out="a tuple of 4 arrays",
    returns="the named tuple (u1x, u1y, u2x, u2y)",
)
def resolve_polar(
    m1: ArrayLike,
    m2: ArrayLike,
    v1: ArrayLike,
    theta1: ArrayLike,
    v2: ArrayLike,
    theta2: ArrayLike,
    phi: ArrayLike,
    *,
    restitution: ArrayLike = 1.0,
    approaching_only: bool = False,
    invalid: str = "raise",
    out: tuple[Array, Array, Array, Array] | None = None,
) -> Velocities2D:
    """Velocity components after collisions in the plane, from speeds and directions.

        u1x = [(m1 - e m2) v1 cos(theta1-phi) + (1+e) m2 v2 cos(theta2-phi)]/(m1+m2) * cos(phi)
              + v1 sin(theta1-phi) cos(phi + pi/2)

    u1y with sin in place of the last cosines, u2 with 1 and 2 exchanged. Computed as `resolve_2d` of
    v1 (cos(theta1), sin(theta1)), v2 (cos(theta2), sin(theta2)) and n = (cos(phi), sin(phi)), which is the same and
    keeps its accuracy for angles of any size.
    ---
    >>> collide.resolve_polar(1.0, 1.0, [2.0], 0.0, 0.0, 0.0, np.pi / 4)[0].round(15)
    array([1.])
    """
    inputs = m1, m2, v1, theta1, v2, theta2, phi, restitution
    return _new(Velocities2D, execution.call(FORM_POLAR, inputs, approaching_only, invalid, out))


@_shared(
    **_IN_PLANE,
    leaves="gives 0 for",
    kept="gets 0",
    out="an array",
    returns="an array of impulses, mass times velocity",
)
def impulse_2d(
    m1: ArrayLike,
    m2: ArrayLike,
    v1x: ArrayLike,
    v1y: ArrayLike,
    v2x: ArrayLike,
    v2y: ArrayLike,
    nx: ArrayLike,
    ny: ArrayLike,
    *,
    restitution: ArrayLike = 1.0,
    approaching_only: bool = False,
    invalid: str = "raise",
    out: Array | None = None,
) -> Any:
    """The impulse on ball 2 along n/|n| in collisions in the plane: positive for a pair that approaches.

        p = (1+e) m1 m2/(m1+m2) (v1-v2).n / |n|

    What `resolve_2d` transfers: m2 (u2-v2) = p n/|n| = -m1 (u1-v1). For pressure and other tallies.
    ---
    >>> collide.impulse_2d(1.0, np.inf, [2.0, 3.0], 0.0, 0.0, 0.0, 1.0, 0.0)
    array([4., 6.])
    """
    inputs = m1, m2, v1x, v1y, v2x, v2y, nx, ny, restitution
    return execution.call(IMPULSE_2D, inputs, approaching_only, invalid, _one(out))[0]


def impulse_3d(
    m1: ArrayLike,
    m2: ArrayLike,
    v1x: ArrayLike,
    v1y: ArrayLike,
    v1z: ArrayLike,
    v2x: ArrayLike,
    v2y: ArrayLike,
    v2z: ArrayLike,
    nx: ArrayLike,
    ny: ArrayLike,
    nz: ArrayLike,
    *,
    restitution: ArrayLike = 1.0,
    approaching_only: bool = False,
    invalid: str = "raise",
    out: Array | None = None,
) -> Any:
    """The impulse on ball 2 along n/|n| in collisions in space: positive for a pair that approaches.

        p = (1+e) m1 m2/(m1+m2) (v1-v2).n / |n|

    What `resolve_3d` transfers: m2 (u2-v2) = p n/|n| = -m1 (u1-v1). For pressure and other tallies.

    Parameters
    ----------
    m1, m2 : array_like
        Masses, >= 0. inf is an immovable ball (a wall), 0 a test particle; not both of a pair inf, nor both 0.
    v1x, v1y, v1z, v2x, v2y, v2z : array_like
        Velocity components before. Any consistent set of units.
    nx, ny, nz : array_like
        A vector n along the line of centres, from ball 1 to ball 2, of any length but 0; x2-x1, y2-y1, z2-z1 will do.
    restitution : array_like, optional
        e, finite and >= 0. 1 is elastic; 0 takes away all relative velocity along the line of centres.
    approaching_only : bool, optional
        True gives 0 for pairs that do not approach ((v1-v2).n <= 0), two immovable balls among them.
    invalid : {"raise", "keep", "nan"}, optional
        What happens to a pair that breaks a rule above, or whose result is too large for its dtype: "raise"
        raises InvalidPairError when all other pairs have their impulse, and this one has what "keep" gives it; under
        "keep" it gets 0; under "nan" it gets NaN.
    out : array of the result's shape and dtype, optional
        Where the result goes. An input will do; any other overlap gives what copies of the inputs would have given.

    Returns
    -------
    array or scalar
        Impulses, mass times velocity: float32 where np.result_type of the inputs is float32 or float16 (Python scalars
        are weak), else float64; a scalar if all inputs are scalars. The arithmetic is float64 throughout. All arguments
        broadcast together by NumPy's rules; bool, integers, float16, float32 and float64 are taken.

    Raises
    ------
    InvalidPairError
        As said. It is a ValueError.
    ValueError
        For shapes that do not match, a read-only out, an unknown `invalid`.
    TypeError
        For other dtypes, masked arrays, an out of another dtype.

    Examples
    --------
    >>> collide.impulse_3d(1.0, np.inf, 0.0, 0.0, [-2.0, -3.0], 0.0, 0.0, 0.0, 0.0, 0.0, -1.0)
    array([4., 6.])
    """
    inputs = m1, m2, v1x, v1y, v1z, v2x, v2y, v2z, nx, ny, nz, restitution
    return execution.call(IMPULSE_3D, inputs, approaching_only, invalid, _one(out))[0]


def time_of_impact(
    dx: ArrayLike,
    dy: ArrayLike,
    dvx: ArrayLike,
    dvy: ArrayLike,
    distance: ArrayLike,
    *,
    invalid: str = "raise",
    out: Array | None = None,
) -> Any:
    """The earliest times t >= 0 at which pairs of balls that move uniformly touch; inf for those that never do.

        t = (d^2 - R^2) / (sqrt(R^2 w^2 - (d x w)^2) - d.w)

    The root of |d + w t| = R that does not cancel. 0 for a pair that touches or overlaps and approaches; inf wherever
    d.w >= 0, apart or not; an exact graze counts as touching. The error is at most 8 eps t + eps^2 d^2/|d.w|, with
    eps = 2^-52: see `collide.scalar.time_of_impact` for that, and for what happens next to a graze.

    All arguments are numbers or arrays of bool, integer, float16, float32 or float64, and broadcast together by NumPy's
    rules; a scalar stays one. Units: any consistent set.

    dx, dy: d = x2-x1, from ball 1 to ball 2.
    dvx, dvy: w = v2-v1, the velocity of ball 2 seen from ball 1.
    distance: R = r1+r2, the distance of the centres at which the balls touch, >= 0.
    invalid: what happens where an argument is not finite, the distance negative or the time of an impact too large for
        the dtype of the result (inf means never), besides the NaN in the result:
        "raise"  InvalidPairError, after all other pairs have got their times
        "nan"    nothing
    out: None, or an array of the result's shape and dtype to write to. An input will do; any other overlap gives what
        copies of the inputs would have given.

    Returns an array: float32 where np.result_type of the inputs is float32 or float16 (Python scalars are weak), else
    float64; a scalar if all inputs are scalars. The arithmetic is float64 throughout.

    Raises InvalidPairError (a ValueError) as said; ValueError for shapes that do not match, a read-only out, an unknown
    `invalid`; TypeError for other dtypes, masked arrays, an out of another dtype.

    >>> collide.time_of_impact([5.0, 5.0], 0.0, [-1.0, 1.0], 0.0, 2.0)
    array([ 3., inf])
    """
    return execution.call(IMPACT, (dx, dy, dvx, dvy, distance), False, invalid, _one(out))[0]


def time_of_impact_3d(
    dx: ArrayLike,
    dy: ArrayLike,
    dz: ArrayLike,
    dvx: ArrayLike,
    dvy: ArrayLike,
    dvz: ArrayLike,
    distance: ArrayLike,
    *,
    invalid: str = "raise",
    out: Array | None = None,
) -> Any:
    """The earliest times t >= 0 at which balls that move uniformly in space touch; inf for those that never do.

        t = (d^2 - R^2) / (sqrt(R^2 w^2 - |d x w|^2) - d.w)

    The root of |d + w t| = R that does not cancel. 0 for a pair that touches or overlaps and approaches; inf wherever
    d.w >= 0, apart or not; an exact graze counts as touching. The error is at most 8 eps t + eps^2 d^2/|d.w|, with
    eps = 2^-52: see `collide.scalar.time_of_impact_3d`. Where dz and dvz are 0 it has the bits of `time_of_impact`.

    Parameters
    ----------
    dx, dy, dz : array_like
        d = x2-x1, from ball 1 to ball 2. Any consistent set of units.
    dvx, dvy, dvz : array_like
        w = v2-v1, the velocity of ball 2 seen from ball 1.
    distance : array_like
        R = r1+r2, the distance of the centres at which the balls touch, >= 0.
    invalid : {"raise", "nan"}, optional
        What happens where an argument is not finite, the distance negative or the time of an impact too large for the
        dtype of the result (inf means never), besides the NaN in the result: "raise" raises InvalidPairError when all
        other pairs have their times; "nan" does nothing.
    out : array of the result's shape and dtype, optional
        Where the result goes. An input will do; any other overlap gives what copies of the inputs would have given.

    Returns
    -------
    array or scalar
        Times: float32 where np.result_type of the inputs is float32 or float16 (Python scalars are weak), else float64;
        a scalar if all inputs are scalars. The arithmetic is float64 throughout. All arguments broadcast together by
        NumPy's rules; bool, integers, float16, float32 and float64 are taken.

    Raises
    ------
    InvalidPairError
        As said. It is a ValueError.
    ValueError
        For shapes that do not match, a read-only out, an unknown `invalid`.
    TypeError
        For other dtypes, masked arrays, an out of another dtype.

    Examples
    --------
    >>> collide.time_of_impact_3d([0.0, 2.0], 0.0, 5.0, 0.0, 0.0, -1.0, 2.0)
    array([3., 5.])
    """
    return execution.call(IMPACT_3D, (dx, dy, dz, dvx, dvy, dvz, distance), False, invalid, _one(out))[0]


def _one(out: Any) -> Any:
    """The `out` of a function with one output, as the tuple of all outputs."""
    return None if out is None else (out,)
