"""The batch functions: one collision for every element of arrays that broadcast together. batch.pyi has their types."""

from __future__ import annotations

# Long by its docstrings, which stand in full where editors look for them: the work is in _pairs.
from typing import Any, Generic, NamedTuple, TypeVar

from numpy.typing import ArrayLike

from ._pairs import execution, vectors
from ._pairs.forms import FORM_1D, FORM_2D, FORM_3D, FORM_POLAR, IMPACT, IMPACT_3D, IMPULSE_2D, IMPULSE_3D
from ._typing import Array, Invalid, InvalidTime

Result = TypeVar("Result")  # numbers or arrays; batch.pyi says which


class Velocities1D(NamedTuple, Generic[Result]):
    """Velocities after the collisions, in the unit of the velocities before."""

    u1: Result
    u2: Result


class Velocities(NamedTuple, Generic[Result]):
    """Velocity vectors after the collisions, in the unit of the velocities before."""

    u1: Result
    u2: Result


class Velocities2D(NamedTuple, Generic[Result]):
    """Velocity components after the collisions, in the unit of the velocities before."""

    u1x: Result
    u1y: Result
    u2x: Result
    u2y: Result


class Velocities3D(NamedTuple, Generic[Result]):
    """Velocity components after the collisions, in the unit of the velocities before."""

    u1x: Result
    u1y: Result
    u1z: Result
    u2x: Result
    u2y: Result
    u2z: Result


_new = tuple.__new__  # a named tuple's own takes twice as long, a fortieth of a small call


def resolve_1d(
    m1: ArrayLike,
    m2: ArrayLike,
    v1: ArrayLike,
    v2: ArrayLike,
    *,
    restitution: ArrayLike = 1.0,
    approaching_only: bool = False,
    invalid: Invalid = "raise",
    out: tuple[Array, ...] | None = None,
) -> Velocities1D[Any]:
    """Compute the velocities after collisions on a line.

        u1 = v1 - (1+e) m2/(m1+m2) (v1-v2)        u2 = v2 + (1+e) m1/(m1+m2) (v1-v2)

    From conservation of momentum and the definition of e; at e = 1 the textbook's u1 = (2 m2 v2 + (m1-m2) v1)/(m1+m2)
    and u2 = (2 m1 v1 + (m2-m1) v2)/(m1+m2).

    Parameters
    ----------
    m1, m2 : array_like
        Masses, >= 0. inf is an immovable ball (a wall), 0 a test particle; not both of a pair inf, nor both 0.
    v1, v2 : array_like
        Velocities before, ball 1 on the left, in any consistent set of units.
    restitution : array_like, optional
        Coefficient of restitution e, finite and >= 0: 1 is elastic, 0 takes away all relative velocity along the line
        of centres. Above 1 the collision adds energy.
    approaching_only : bool, optional
        True leaves as they are the pairs that do not approach (v1 <= v2), two immovable balls among them.
    invalid : {"raise", "keep", "nan"}, optional
        What happens to a pair that breaks a rule above, or whose result is too large for its dtype. "raise": all other
        pairs are resolved, this one keeps its velocities, and InvalidPairError is raised; without `out` the results are
        lost then. "keep": the same without an error. "nan": it gets NaN.
    out : tuple of 2 arrays of the result's shape and dtype, optional
        Where the results go. The inputs themselves will do, which is the in-place form; any other overlap gives what
        copies of the inputs would have given.

    Returns
    -------
    Velocities1D
        The named tuple (u1, u2), in the unit of the velocities before: arrays of float32 where np.result_type of the
        inputs is float32 or float16 (Python scalars are weak), else of float64; scalars if all inputs are scalars.

    Raises
    ------
    InvalidPairError
        As said under `invalid`. It is a ValueError.
    ValueError
        For shapes that do not match, a read-only or doubled out, an unknown `invalid`.
    TypeError
        For other dtypes, masked arrays, an out of another dtype.

    See Also
    --------
    resolve_2d, resolve_3d : In the plane and in space.
    scalar.resolve_1d : The formula of one pair, for compiled code.

    Notes
    -----
    All arguments are numbers or arrays of bool, integers, float16, float32 or float64, and broadcast together by
    NumPy's rules; a scalar stays one. The arithmetic is float64 throughout, so that a float32 result is the float64
    result rounded once. A velocity is off by at most 8 * 2**-52 of the pair's largest component before or after, and
    (1+e)/2 times that where e > 1.

    The first call compiles, which takes some 2 to 7 seconds, and keeps the kernel on disk: in the folder
    NUMBA_CACHE_DIR if that is set, else beside the package, else among the user's caches. ``collide compile`` makes all
    kernels ahead.

    Examples
    --------
    >>> collide.resolve_1d(0.5, 3.5, [4.0, 8.0], 0.0)
    Velocities1D(u1=array([-3., -6.]), u2=array([1., 2.]))
    """
    inputs = m1, m2, v1, v2, restitution
    return _new(Velocities1D, execution.call(FORM_1D, inputs, approaching_only, invalid, out))


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
    invalid: Invalid = "raise",
    out: tuple[Array, ...] | None = None,
) -> Velocities2D[Any]:
    """Compute the velocities after collisions in the plane, between smooth balls that do not spin.

        u1 = v1 - (1+e) m2/(m1+m2) ((v1-v2).n / n.n) n        u2 = v2 + (1+e) m1/(m1+m2) ((v1-v2).n / n.n) n

    The collision on a line, along the line of centres; across it nothing changes.

    Parameters
    ----------
    m1, m2 : array_like
        Masses, >= 0. inf is an immovable ball (a wall), 0 a test particle; not both of a pair inf, nor both 0.
    v1x, v1y, v2x, v2y : array_like
        Velocity components before, in any consistent set of units.
    nx, ny : array_like
        A vector n along the line of centres, from ball 1 to ball 2, of any length but 0; x2-x1, y2-y1 will do.
    restitution : array_like, optional
        Coefficient of restitution e, finite and >= 0: 1 is elastic, 0 takes away all relative velocity along the line
        of centres. Above 1 the collision adds energy.
    approaching_only : bool, optional
        True leaves as they are the pairs that do not approach ((v1-v2).n <= 0), two immovable balls among them.
    invalid : {"raise", "keep", "nan"}, optional
        What happens to a pair that breaks a rule above, or whose result is too large for its dtype. "raise": all other
        pairs are resolved, this one keeps its velocities, and InvalidPairError is raised; without `out` the results are
        lost then. "keep": the same without an error. "nan": it gets NaN.
    out : tuple of 4 arrays of the result's shape and dtype, optional
        Where the results go. The inputs themselves will do, which is the in-place form; any other overlap gives what
        copies of the inputs would have given.

    Returns
    -------
    Velocities2D
        The named tuple (u1x, u1y, u2x, u2y), in the unit of the velocities before: arrays of float32 where
        np.result_type of the inputs is float32 or float16 (Python scalars are weak), else of float64; scalars if all
        inputs are scalars.

    Raises
    ------
    InvalidPairError
        As said under `invalid`. It is a ValueError.
    ValueError
        For shapes that do not match, a read-only or doubled out, an unknown `invalid`.
    TypeError
        For other dtypes, masked arrays, an out of another dtype.

    See Also
    --------
    resolve : The same for vectors along the last axis of arrays.
    resolve_polar : The same from speeds and directions.
    impulse_2d : What such a collision transfers.
    scalar.resolve_2d : The formula of one pair, for compiled code.

    Notes
    -----
    All arguments are numbers or arrays of bool, integers, float16, float32 or float64, and broadcast together by
    NumPy's rules; a scalar stays one. The arithmetic is float64 throughout, so that a float32 result is the float64
    result rounded once. A velocity is off by at most 8 * 2**-52 of the pair's largest component before or after, and
    (1+e)/2 times that where e > 1.

    The first call compiles, which takes some 2 to 7 seconds, and keeps the kernel on disk: in the folder
    NUMBA_CACHE_DIR if that is set, else beside the package, else among the user's caches. ``collide compile`` makes all
    kernels ahead.

    Examples
    --------
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
    invalid: Invalid = "raise",
    out: tuple[Array, ...] | None = None,
) -> Velocities3D[Any]:
    """Compute the velocities after collisions in space, between smooth balls that do not spin.

        u1 = v1 - (1+e) m2/(m1+m2) ((v1-v2).n / n.n) n        u2 = v2 + (1+e) m1/(m1+m2) ((v1-v2).n / n.n) n

    The collision on a line, along the line of centres; across it nothing changes. Where v1z, v2z and nz are 0 the other
    components have the bits of `resolve_2d`, but for the signs of zeros.

    Parameters
    ----------
    m1, m2 : array_like
        Masses, >= 0. inf is an immovable ball (a wall), 0 a test particle; not both of a pair inf, nor both 0.
    v1x, v1y, v1z, v2x, v2y, v2z : array_like
        Velocity components before, in any consistent set of units.
    nx, ny, nz : array_like
        A vector n along the line of centres, from ball 1 to ball 2, of any length but 0; x2-x1, y2-y1, z2-z1 will do.
    restitution : array_like, optional
        Coefficient of restitution e, finite and >= 0: 1 is elastic, 0 takes away all relative velocity along the line
        of centres. Above 1 the collision adds energy.
    approaching_only : bool, optional
        True leaves as they are the pairs that do not approach ((v1-v2).n <= 0), two immovable balls among them.
    invalid : {"raise", "keep", "nan"}, optional
        What happens to a pair that breaks a rule above, or whose result is too large for its dtype. "raise": all other
        pairs are resolved, this one keeps its velocities, and InvalidPairError is raised; without `out` the results are
        lost then. "keep": the same without an error. "nan": it gets NaN.
    out : tuple of 6 arrays of the result's shape and dtype, optional
        Where the results go. The inputs themselves will do, which is the in-place form; any other overlap gives what
        copies of the inputs would have given.

    Returns
    -------
    Velocities3D
        The named tuple (u1x, u1y, u1z, u2x, u2y, u2z), in the unit of the velocities before: arrays of float32 where
        np.result_type of the inputs is float32 or float16 (Python scalars are weak), else of float64; scalars if all
        inputs are scalars.

    Raises
    ------
    InvalidPairError
        As said under `invalid`. It is a ValueError.
    ValueError
        For shapes that do not match, a read-only or doubled out, an unknown `invalid`.
    TypeError
        For other dtypes, masked arrays, an out of another dtype.

    See Also
    --------
    resolve : The same for vectors along the last axis of arrays.
    impulse_3d : What such a collision transfers.
    scalar.resolve_3d : The formula of one pair, for compiled code.

    Notes
    -----
    All arguments are numbers or arrays of bool, integers, float16, float32 or float64, and broadcast together by
    NumPy's rules; a scalar stays one. The arithmetic is float64 throughout, so that a float32 result is the float64
    result rounded once. A velocity is off by at most 8 * 2**-52 of the pair's largest component before or after, and
    (1+e)/2 times that where e > 1.

    The first call compiles, which takes some 2 to 7 seconds, and keeps the kernel on disk: in the folder
    NUMBA_CACHE_DIR if that is set, else beside the package, else among the user's caches. ``collide compile`` makes all
    kernels ahead.

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
    invalid: Invalid = "raise",
    out: tuple[Array, ...] | None = None,
) -> Velocities[Any]:
    """Compute the velocities after collisions of vectors along the last axis: the rows of (N, 2) or (N, 3) arrays.

        u1 = v1 - (1+e) m2/(m1+m2) ((v1-v2).n / n.n) n        u2 = v2 + (1+e) m1/(m1+m2) ((v1-v2).n / n.n) n

    The bits of `resolve_2d` and `resolve_3d`, at the speed of columns.

    Parameters
    ----------
    m1, m2 : array_like, shape (...)
        Masses, >= 0. inf is an immovable ball (a wall), 0 a test particle; not both of a pair inf, nor both 0.
    v1, v2 : array_like, shape (..., d), d = 2 or 3
        Velocities before, in any consistent set of units.
    n : array_like, shape (..., d)
        Vectors along the line of centres, from ball 1 to ball 2, of any length but 0; x2-x1 will do.
    restitution : array_like, shape (...), optional
        Coefficient of restitution e, finite and >= 0: 1 is elastic, 0 takes away all relative velocity along the line
        of centres. Above 1 the collision adds energy.
    approaching_only : bool, optional
        True leaves as they are the pairs that do not approach ((v1-v2).n <= 0), two immovable balls among them.
    invalid : {"raise", "keep", "nan"}, optional
        What happens to a pair that breaks a rule above, or whose result is too large for its dtype. "raise": all other
        pairs are resolved, this one keeps its velocities, and InvalidPairError is raised; without `out` the results are
        lost then. "keep": the same without an error. "nan": it gets NaN.
    out : tuple of 2 arrays of the result's shape and dtype, optional
        Where the results go. v1 and v2 themselves will do, which is the in-place form; any other overlap gives what
        copies of the inputs would have given.

    Returns
    -------
    Velocities
        The named tuple (u1, u2), C-contiguous arrays of shape (..., d) unless `out` is given: of float32 where
        np.result_type of the inputs is float32 or float16 (Python scalars are weak), else of float64.

    Raises
    ------
    InvalidPairError
        As said under `invalid`; its `index` is that of the pair, without the last axis. It is a ValueError.
    ValueError
        For vectors of another length, shapes that do not match, a read-only or doubled out, an unknown `invalid`.
    TypeError
        For other dtypes, masked arrays, an out of another dtype.

    See Also
    --------
    resolve_2d, resolve_3d : The same for columns.

    Notes
    -----
    All arguments are numbers or arrays of bool, integers, float16, float32 or float64, and their axes before the last
    broadcast together by NumPy's rules; a scalar stays one. The arithmetic is float64 throughout, so that a float32
    result is the float64 result rounded once. A velocity is off by at most 8 * 2**-52 of the pair's largest component
    before or after, and (1+e)/2 times that where e > 1.

    The first call compiles, which takes some 2 to 7 seconds, and keeps the kernel on disk: in the folder
    NUMBA_CACHE_DIR if that is set, else beside the package, else among the user's caches. ``collide compile`` makes all
    kernels ahead.

    Examples
    --------
    A ball meets its equal, at rest, 45 degrees off centre:

    >>> collide.resolve(1.0, 1.0, [[2.0, 0.0]], [0.0, 0.0], [1.0, 1.0])
    Velocities(u1=array([[ 1., -1.]]), u2=array([[1., 1.]]))
    """
    inputs = m1, m2, v1, v2, n, restitution
    return _new(Velocities, vectors.call(inputs, approaching_only, invalid, out))


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
    invalid: Invalid = "raise",
    out: tuple[Array, ...] | None = None,
) -> Velocities2D[Any]:
    """Compute velocity components after collisions in the plane, from speeds and directions.

        u1x = [(m1 - e m2) v1 cos(theta1-phi) + (1+e) m2 v2 cos(theta2-phi)]/(m1+m2) * cos(phi)
              + v1 sin(theta1-phi) cos(phi + pi/2)

    u1y with sin in place of the last cosines, u2 with 1 and 2 exchanged. Computed as `resolve_2d` of
    v1 (cos(theta1), sin(theta1)), v2 (cos(theta2), sin(theta2)) and n = (cos(phi), sin(phi)), which is the same and
    keeps its accuracy for angles of any size.

    Parameters
    ----------
    m1, m2 : array_like
        Masses, >= 0. inf is an immovable ball (a wall), 0 a test particle; not both of a pair inf, nor both 0.
    v1, theta1, v2, theta2 : array_like
        Speeds before, in any consistent set of units, and their directions, in radians.
    phi : array_like
        Direction of the line of centres, from ball 1 to ball 2, in radians.
    restitution : array_like, optional
        Coefficient of restitution e, finite and >= 0: 1 is elastic, 0 takes away all relative velocity along the line
        of centres. Above 1 the collision adds energy.
    approaching_only : bool, optional
        True leaves as they are the pairs that do not approach (v1 cos(theta1-phi) <= v2 cos(theta2-phi)), two immovable
        balls among them.
    invalid : {"raise", "keep", "nan"}, optional
        What happens to a pair that breaks a rule above, or whose result is too large for its dtype. "raise": all other
        pairs are resolved, this one keeps its velocities v cos(theta), v sin(theta), and InvalidPairError is raised;
        without `out` the results are lost then. "keep": the same without an error. "nan": it gets NaN.
    out : tuple of 4 arrays of the result's shape and dtype, optional
        Where the results go. The inputs themselves will do, which is the in-place form; any other overlap gives what
        copies of the inputs would have given.

    Returns
    -------
    Velocities2D
        The named tuple (u1x, u1y, u2x, u2y), in the unit of the velocities before: arrays of float32 where
        np.result_type of the inputs is float32 or float16 (Python scalars are weak), else of float64; scalars if all
        inputs are scalars.

    Raises
    ------
    InvalidPairError
        As said under `invalid`. It is a ValueError.
    ValueError
        For shapes that do not match, a read-only or doubled out, an unknown `invalid`.
    TypeError
        For other dtypes, masked arrays, an out of another dtype.

    See Also
    --------
    resolve_2d : The same from components.
    scalar.resolve_polar : The formula of one pair, for compiled code.

    Notes
    -----
    All arguments are numbers or arrays of bool, integers, float16, float32 or float64, and broadcast together by
    NumPy's rules; a scalar stays one. The arithmetic is float64 throughout, so that a float32 result is the float64
    result rounded once. A velocity is off by at most 10 * 2**-52 of the pair's largest component before or after, and
    (1+e)/2 times that where e > 1.

    The first call compiles, which takes some 2 to 7 seconds, and keeps the kernel on disk: in the folder
    NUMBA_CACHE_DIR if that is set, else beside the package, else among the user's caches. ``collide compile`` makes all
    kernels ahead.

    Examples
    --------
    >>> collide.resolve_polar(1.0, 1.0, [2.0], 0.0, 0.0, 0.0, np.pi / 4)[0].round(15)
    array([1.])
    """
    inputs = m1, m2, v1, theta1, v2, theta2, phi, restitution
    return _new(Velocities2D, execution.call(FORM_POLAR, inputs, approaching_only, invalid, out))


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
    invalid: Invalid = "raise",
    out: Array | None = None,
) -> Any:
    """Compute the impulse on ball 2 along n/|n| in collisions in the plane.

        p = (1+e) m1 m2/(m1+m2) (v1-v2).n / |n|

    What `resolve_2d` transfers: m2 (u2-v2) = p n/|n| = -m1 (u1-v1). It is positive for a pair that approaches. For
    pressure and other tallies.

    Parameters
    ----------
    m1, m2 : array_like
        Masses, >= 0. inf is an immovable ball (a wall), 0 a test particle; not both of a pair inf, nor both 0.
    v1x, v1y, v2x, v2y : array_like
        Velocity components before, in any consistent set of units.
    nx, ny : array_like
        A vector n along the line of centres, from ball 1 to ball 2, of any length but 0; x2-x1, y2-y1 will do.
    restitution : array_like, optional
        Coefficient of restitution e, finite and >= 0: 1 is elastic, 0 takes away all relative velocity along the line
        of centres. Above 1 the collision adds energy.
    approaching_only : bool, optional
        True gives 0 for pairs that do not approach ((v1-v2).n <= 0), two immovable balls among them.
    invalid : {"raise", "keep", "nan"}, optional
        What happens to a pair that breaks a rule above, or whose result is too large for its dtype. "raise": all other
        pairs get their impulses, this one gets 0, and InvalidPairError is raised; without `out` the results are lost
        then. "keep": the same without an error. "nan": it gets NaN.
    out : array of the result's shape and dtype, optional
        Where the result goes. An input will do; any other overlap gives what copies of the inputs would have given.

    Returns
    -------
    array or scalar
        Impulses, mass times velocity: float32 where np.result_type of the inputs is float32 or float16 (Python scalars
        are weak), else float64; a scalar if all inputs are scalars.

    Raises
    ------
    InvalidPairError
        As said under `invalid`. It is a ValueError.
    ValueError
        For shapes that do not match, a read-only out, an unknown `invalid`.
    TypeError
        For other dtypes, masked arrays, an out of another dtype.

    See Also
    --------
    resolve_2d : The velocities after the same collisions.

    Notes
    -----
    All arguments are numbers or arrays of bool, integers, float16, float32 or float64, and broadcast together by
    NumPy's rules; a scalar stays one. The arithmetic is float64 throughout, so that a float32 result is the float64
    result rounded once. An impulse is off by at most 16 * 2**-52 of the lighter mass times the largest velocity
    component before or after.

    The first call compiles, which takes some 2 to 7 seconds, and keeps the kernel on disk: in the folder
    NUMBA_CACHE_DIR if that is set, else beside the package, else among the user's caches. ``collide compile`` makes all
    kernels ahead.

    Examples
    --------
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
    invalid: Invalid = "raise",
    out: Array | None = None,
) -> Any:
    """Compute the impulse on ball 2 along n/|n| in collisions in space.

        p = (1+e) m1 m2/(m1+m2) (v1-v2).n / |n|

    What `resolve_3d` transfers: m2 (u2-v2) = p n/|n| = -m1 (u1-v1). It is positive for a pair that approaches. For
    pressure and other tallies.

    Parameters
    ----------
    m1, m2 : array_like
        Masses, >= 0. inf is an immovable ball (a wall), 0 a test particle; not both of a pair inf, nor both 0.
    v1x, v1y, v1z, v2x, v2y, v2z : array_like
        Velocity components before, in any consistent set of units.
    nx, ny, nz : array_like
        A vector n along the line of centres, from ball 1 to ball 2, of any length but 0; x2-x1, y2-y1, z2-z1 will do.
    restitution : array_like, optional
        Coefficient of restitution e, finite and >= 0: 1 is elastic, 0 takes away all relative velocity along the line
        of centres. Above 1 the collision adds energy.
    approaching_only : bool, optional
        True gives 0 for pairs that do not approach ((v1-v2).n <= 0), two immovable balls among them.
    invalid : {"raise", "keep", "nan"}, optional
        What happens to a pair that breaks a rule above, or whose result is too large for its dtype. "raise": all other
        pairs get their impulses, this one gets 0, and InvalidPairError is raised; without `out` the results are lost
        then. "keep": the same without an error. "nan": it gets NaN.
    out : array of the result's shape and dtype, optional
        Where the result goes. An input will do; any other overlap gives what copies of the inputs would have given.

    Returns
    -------
    array or scalar
        Impulses, mass times velocity: float32 where np.result_type of the inputs is float32 or float16 (Python scalars
        are weak), else float64; a scalar if all inputs are scalars.

    Raises
    ------
    InvalidPairError
        As said under `invalid`. It is a ValueError.
    ValueError
        For shapes that do not match, a read-only out, an unknown `invalid`.
    TypeError
        For other dtypes, masked arrays, an out of another dtype.

    See Also
    --------
    resolve_3d : The velocities after the same collisions.

    Notes
    -----
    All arguments are numbers or arrays of bool, integers, float16, float32 or float64, and broadcast together by
    NumPy's rules; a scalar stays one. The arithmetic is float64 throughout, so that a float32 result is the float64
    result rounded once. An impulse is off by at most 20 * 2**-52 of the lighter mass times the largest velocity
    component before or after.

    The first call compiles, which takes some 2 to 7 seconds, and keeps the kernel on disk: in the folder
    NUMBA_CACHE_DIR if that is set, else beside the package, else among the user's caches. ``collide compile`` makes all
    kernels ahead.

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
    invalid: InvalidTime = "raise",
    out: Array | None = None,
) -> Any:
    """Compute the earliest times t >= 0 at which balls that move uniformly in the plane touch.

        t = (d^2 - R^2) / (sqrt(R^2 w^2 - (d x w)^2) - d.w)

    The root of |d + w t| = R that does not cancel; inf for pairs that never touch. 0 for a pair that touches or
    overlaps and approaches; inf wherever d.w >= 0, apart or not; an exact graze counts as touching.

    Parameters
    ----------
    dx, dy : array_like
        Components of d = x2-x1, from ball 1 to ball 2, in any consistent set of units.
    dvx, dvy : array_like
        Components of w = v2-v1, the velocity of ball 2 seen from ball 1.
    distance : array_like
        The distance R = r1+r2 of the centres at which the balls touch, finite and >= 0.
    invalid : {"raise", "nan"}, optional
        What happens where an argument is not finite, the distance negative or the time of an impact too large for the
        dtype of the result (inf means never), besides the NaN in the result. "raise": InvalidPairError is raised when
        all other pairs have their times. "nan": nothing.
    out : array of the result's shape and dtype, optional
        Where the result goes. An input will do; any other overlap gives what copies of the inputs would have given.

    Returns
    -------
    array or scalar
        Times: float32 where np.result_type of the inputs is float32 or float16 (Python scalars are weak), else float64;
        a scalar if all inputs are scalars.

    Raises
    ------
    InvalidPairError
        As said under `invalid`. It is a ValueError.
    ValueError
        For shapes that do not match, a read-only out, an unknown `invalid`.
    TypeError
        For other dtypes, masked arrays, an out of another dtype.

    See Also
    --------
    scalar.time_of_impact : What is exact of t, and what happens next to a graze.
    time_of_impact_3d : The same in space.

    Notes
    -----
    All arguments are numbers or arrays of bool, integers, float16, float32 or float64, and broadcast together by
    NumPy's rules; a scalar stays one. The arithmetic is float64 throughout, so that a float32 result is the float64
    result rounded once. A time is off by at most 8 eps t + eps**2 d^2/|d.w|, with eps = 2**-52.

    The first call compiles, which takes some 2 to 7 seconds, and keeps the kernel on disk: in the folder
    NUMBA_CACHE_DIR if that is set, else beside the package, else among the user's caches. ``collide compile`` makes all
    kernels ahead.

    Examples
    --------
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
    invalid: InvalidTime = "raise",
    out: Array | None = None,
) -> Any:
    """Compute the earliest times t >= 0 at which balls that move uniformly in space touch.

        t = (d^2 - R^2) / (sqrt(R^2 w^2 - |d x w|^2) - d.w)

    The root of |d + w t| = R that does not cancel; inf for pairs that never touch. 0 for a pair that touches or
    overlaps and approaches; inf wherever d.w >= 0, apart or not; an exact graze counts as touching.

    Parameters
    ----------
    dx, dy, dz : array_like
        Components of d = x2-x1, from ball 1 to ball 2, in any consistent set of units.
    dvx, dvy, dvz : array_like
        Components of w = v2-v1, the velocity of ball 2 seen from ball 1.
    distance : array_like
        The distance R = r1+r2 of the centres at which the balls touch, finite and >= 0.
    invalid : {"raise", "nan"}, optional
        What happens where an argument is not finite, the distance negative or the time of an impact too large for the
        dtype of the result (inf means never), besides the NaN in the result. "raise": InvalidPairError is raised when
        all other pairs have their times. "nan": nothing.
    out : array of the result's shape and dtype, optional
        Where the result goes. An input will do; any other overlap gives what copies of the inputs would have given.

    Returns
    -------
    array or scalar
        Times: float32 where np.result_type of the inputs is float32 or float16 (Python scalars are weak), else float64;
        a scalar if all inputs are scalars.

    Raises
    ------
    InvalidPairError
        As said under `invalid`. It is a ValueError.
    ValueError
        For shapes that do not match, a read-only out, an unknown `invalid`.
    TypeError
        For other dtypes, masked arrays, an out of another dtype.

    See Also
    --------
    scalar.time_of_impact_3d : What is exact of t, and what happens next to a graze.
    time_of_impact : The same in the plane, and its bits where dz and dvz are 0.

    Notes
    -----
    All arguments are numbers or arrays of bool, integers, float16, float32 or float64, and broadcast together by
    NumPy's rules; a scalar stays one. The arithmetic is float64 throughout, so that a float32 result is the float64
    result rounded once. A time is off by at most 8 eps t + eps**2 d^2/|d.w|, with eps = 2**-52.

    The first call compiles, which takes some 2 to 7 seconds, and keeps the kernel on disk: in the folder
    NUMBA_CACHE_DIR if that is set, else beside the package, else among the user's caches. ``collide compile`` makes all
    kernels ahead.

    Examples
    --------
    >>> collide.time_of_impact_3d([0.0, 2.0], 0.0, 5.0, 0.0, 0.0, -1.0, 2.0)
    array([3., 5.])
    """
    return execution.call(IMPACT_3D, (dx, dy, dz, dvx, dvy, dvz, distance), False, invalid, _one(out))[0]


def _one(out: Any) -> Any:
    """The `out` of a function with one output, as the tuple of all outputs."""
    return None if out is None else (out,)
