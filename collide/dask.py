"""The batch functions over Dask arrays: lazy, chunk by chunk, on threads, processes or machines. Needs dask.

    import collide.dask
    u = collide.dask.resolve_2d(m1, m2, v1x, v1y, v2x, v2y, nx, ny)     # dask arrays, nothing computed yet

The arguments are those of the functions of the same names in `collide`: Dask arrays, or whatever those take, that
broadcast together. There is no `out`. A result is in the chunks of the arguments; those that are not in the same chunks
are put into common ones. The results of one call share a task for each chunk: computed together, by `dask.compute(*u)`
or `dask.array.store`, each chunk is resolved once.

Each task runs on its own thread only. How many run at a time is Dask's business, whatever `set_num_threads` says.

Raises ValueError for chunks of unknown sizes; and at once whatever the functions say of options, dtypes and shapes. An
invalid pair raises InvalidPairError when it is computed; its index is that in the whole array, its count is that of the
chunk. `invalid` and all the rest are as documented there.
"""

from __future__ import annotations

# Long by its docstrings, which stand in full where editors look for them: the work is in _pairs/chunks.py.
from typing import Any

try:
    import dask.array as da
except ModuleNotFoundError:
    raise ModuleNotFoundError("collide.dask needs dask: pip install 'dask[array]'", name="dask") from None

from . import batch
from ._pairs import vectors
from ._pairs.chunks import as_dask, lazily
from ._typing import Invalid, InvalidTime

__all__ = [
    "impulse_2d",
    "impulse_3d",
    "resolve",
    "resolve_1d",
    "resolve_2d",
    "resolve_3d",
    "resolve_polar",
    "time_of_impact",
    "time_of_impact_3d",
]


def __dir__() -> list[str]:
    return __all__


def resolve_1d(
    m1: Any,
    m2: Any,
    v1: Any,
    v2: Any,
    *,
    restitution: Any = 1.0,
    approaching_only: bool = False,
    invalid: Invalid = "raise",
) -> batch.Velocities1D[da.Array]:
    """Compute the velocities after collisions on a line, chunk by chunk.

        u1 = v1 - (1+e) m2/(m1+m2) (v1-v2)        u2 = v2 + (1+e) m1/(m1+m2) (v1-v2)

    Parameters
    ----------
    m1, m2 : array_like or dask.array.Array
        Masses, >= 0. inf is an immovable ball (a wall), 0 a test particle; not both of a pair inf, nor both 0.
    v1, v2 : array_like or dask.array.Array
        Velocities before, ball 1 on the left, in any consistent set of units.
    restitution : array_like or dask.array.Array, optional
        Coefficient of restitution e, finite and >= 0: 1 is elastic, 0 takes away all relative velocity along the line
        of centres. Above 1 the collision adds energy.
    approaching_only : bool, optional
        True leaves as they are the pairs that do not approach (v1 <= v2), two immovable balls among them.
    invalid : {"raise", "keep", "nan"}, optional
        What happens to a pair that breaks a rule above, or whose result is too large for its dtype. "raise":
        InvalidPairError is raised when its chunk is computed. "keep": it keeps its velocities. "nan": it gets NaN.

    Returns
    -------
    Velocities1D
        The named tuple (u1, u2) of Dask arrays, in the unit of the velocities before: in the chunks of the
        arguments, of the dtype that `collide.resolve_1d` gives.

    Raises
    ------
    InvalidPairError
        When it is computed, as said under `invalid`; its `index` is that in the whole array, its `count` that of the
        chunk.
    ValueError
        At once: for shapes that do not match, chunks of unknown sizes, an unknown `invalid`.
    TypeError
        At once: for other dtypes, and masked arrays.

    See Also
    --------
    collide.resolve_1d : The same at once, of NumPy arrays; how exact it is.

    Notes
    -----
    The results are lazy, and share a task for each chunk: computed together, by ``dask.compute(*u)`` or
    ``dask.array.store``, each chunk is resolved once. A task runs on its own thread only.

    Examples
    --------
    >>> v1 = da.from_array(np.array([4.0, 8.0]), chunks=1)
    >>> [u.compute() for u in collide.dask.resolve_1d(0.5, 3.5, v1, 0.0)]
    [array([-3., -6.]), array([1., 2.])]
    """
    return batch.Velocities1D(*lazily("1d", (m1, m2, v1, v2, restitution), approaching_only, invalid))


def resolve_2d(
    m1: Any,
    m2: Any,
    v1x: Any,
    v1y: Any,
    v2x: Any,
    v2y: Any,
    nx: Any,
    ny: Any,
    *,
    restitution: Any = 1.0,
    approaching_only: bool = False,
    invalid: Invalid = "raise",
) -> batch.Velocities2D[da.Array]:
    """Compute the velocities after collisions in the plane, chunk by chunk.

        u1 = v1 - (1+e) m2/(m1+m2) ((v1-v2).n / n.n) n        u2 = v2 + (1+e) m1/(m1+m2) ((v1-v2).n / n.n) n

    Parameters
    ----------
    m1, m2 : array_like or dask.array.Array
        Masses, >= 0. inf is an immovable ball (a wall), 0 a test particle; not both of a pair inf, nor both 0.
    v1x, v1y, v2x, v2y : array_like or dask.array.Array
        Velocity components before, in any consistent set of units.
    nx, ny : array_like or dask.array.Array
        A vector n along the line of centres, from ball 1 to ball 2, of any length but 0; x2-x1, y2-y1 will do.
    restitution : array_like or dask.array.Array, optional
        Coefficient of restitution e, finite and >= 0: 1 is elastic, 0 takes away all relative velocity along the line
        of centres. Above 1 the collision adds energy.
    approaching_only : bool, optional
        True leaves as they are the pairs that do not approach ((v1-v2).n <= 0), two immovable balls among them.
    invalid : {"raise", "keep", "nan"}, optional
        What happens to a pair that breaks a rule above, or whose result is too large for its dtype. "raise":
        InvalidPairError is raised when its chunk is computed. "keep": it keeps its velocities. "nan": it gets NaN.

    Returns
    -------
    Velocities2D
        The named tuple (u1x, u1y, u2x, u2y) of Dask arrays, in the unit of the velocities before: in the chunks of the
        arguments, of the dtype that `collide.resolve_2d` gives.

    Raises
    ------
    InvalidPairError
        When it is computed, as said under `invalid`; its `index` is that in the whole array, its `count` that of the
        chunk.
    ValueError
        At once: for shapes that do not match, chunks of unknown sizes, an unknown `invalid`.
    TypeError
        At once: for other dtypes, and masked arrays.

    See Also
    --------
    collide.resolve_2d : The same at once, of NumPy arrays; how exact it is.

    Notes
    -----
    The results are lazy, and share a task for each chunk: computed together, by ``dask.compute(*u)`` or
    ``dask.array.store``, each chunk is resolved once. A task runs on its own thread only.

    Examples
    --------
    >>> v1x = da.from_array(np.array([1.0, 2.0, 3.0]), chunks=2)
    >>> u = collide.dask.resolve_2d(1.0, 1.0, v1x, 0.0, 0.0, 0.0, 1.0, 1.0)
    >>> u.u2y.compute()
    array([0.5, 1. , 1.5])
    """
    inputs = m1, m2, v1x, v1y, v2x, v2y, nx, ny, restitution
    return batch.Velocities2D(*lazily("2d", inputs, approaching_only, invalid))


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
    *,
    restitution: Any = 1.0,
    approaching_only: bool = False,
    invalid: Invalid = "raise",
) -> batch.Velocities3D[da.Array]:
    """Compute the velocities after collisions in space, chunk by chunk.

        u1 = v1 - (1+e) m2/(m1+m2) ((v1-v2).n / n.n) n        u2 = v2 + (1+e) m1/(m1+m2) ((v1-v2).n / n.n) n

    Parameters
    ----------
    m1, m2 : array_like or dask.array.Array
        Masses, >= 0. inf is an immovable ball (a wall), 0 a test particle; not both of a pair inf, nor both 0.
    v1x, v1y, v1z, v2x, v2y, v2z : array_like or dask.array.Array
        Velocity components before, in any consistent set of units.
    nx, ny, nz : array_like or dask.array.Array
        A vector n along the line of centres, from ball 1 to ball 2, of any length but 0; x2-x1, y2-y1, z2-z1 will do.
    restitution : array_like or dask.array.Array, optional
        Coefficient of restitution e, finite and >= 0: 1 is elastic, 0 takes away all relative velocity along the line
        of centres. Above 1 the collision adds energy.
    approaching_only : bool, optional
        True leaves as they are the pairs that do not approach ((v1-v2).n <= 0), two immovable balls among them.
    invalid : {"raise", "keep", "nan"}, optional
        What happens to a pair that breaks a rule above, or whose result is too large for its dtype. "raise":
        InvalidPairError is raised when its chunk is computed. "keep": it keeps its velocities. "nan": it gets NaN.

    Returns
    -------
    Velocities3D
        The named tuple (u1x, u1y, u1z, u2x, u2y, u2z) of Dask arrays, in the unit of the velocities before: in the
        chunks of the arguments, of the dtype that `collide.resolve_3d` gives.

    Raises
    ------
    InvalidPairError
        When it is computed, as said under `invalid`; its `index` is that in the whole array, its `count` that of the
        chunk.
    ValueError
        At once: for shapes that do not match, chunks of unknown sizes, an unknown `invalid`.
    TypeError
        At once: for other dtypes, and masked arrays.

    See Also
    --------
    collide.resolve_3d : The same at once, of NumPy arrays; how exact it is.

    Notes
    -----
    The results are lazy, and share a task for each chunk: computed together, by ``dask.compute(*u)`` or
    ``dask.array.store``, each chunk is resolved once. A task runs on its own thread only.

    Examples
    --------
    >>> v1z = da.from_array(np.array([1.0, 2.0, 3.0]), chunks=2)
    >>> u = collide.dask.resolve_3d(1.0, 1.0, 0.0, 0.0, v1z, 0.0, 0.0, 0.0, 0.0, 1.0, 1.0)
    >>> u.u2z.compute()
    array([0.5, 1. , 1.5])
    """
    inputs = m1, m2, v1x, v1y, v1z, v2x, v2y, v2z, nx, ny, nz, restitution
    return batch.Velocities3D(*lazily("3d", inputs, approaching_only, invalid))


def resolve(
    m1: Any,
    m2: Any,
    v1: Any,
    v2: Any,
    n: Any,
    *,
    restitution: Any = 1.0,
    approaching_only: bool = False,
    invalid: Invalid = "raise",
) -> batch.Velocities[da.Array]:
    """Compute the velocities after collisions of vectors along the last axis, chunk by chunk.

        u1 = v1 - (1+e) m2/(m1+m2) ((v1-v2).n / n.n) n        u2 = v2 + (1+e) m1/(m1+m2) ((v1-v2).n / n.n) n

    Parameters
    ----------
    m1, m2 : array_like or dask.array.Array, shape (...)
        Masses, >= 0. inf is an immovable ball (a wall), 0 a test particle; not both of a pair inf, nor both 0.
    v1, v2 : array_like or dask.array.Array, shape (..., d), d = 2 or 3
        Velocities before, in any consistent set of units.
    n : array_like or dask.array.Array, shape (..., d)
        Vectors along the line of centres, from ball 1 to ball 2, of any length but 0; x2-x1 will do.
    restitution : array_like or dask.array.Array, shape (...), optional
        Coefficient of restitution e, finite and >= 0: 1 is elastic, 0 takes away all relative velocity along the line
        of centres. Above 1 the collision adds energy.
    approaching_only : bool, optional
        True leaves as they are the pairs that do not approach ((v1-v2).n <= 0), two immovable balls among them.
    invalid : {"raise", "keep", "nan"}, optional
        What happens to a pair that breaks a rule above, or whose result is too large for its dtype. "raise":
        InvalidPairError is raised when its chunk is computed. "keep": it keeps its velocities. "nan": it gets NaN.

    Returns
    -------
    Velocities
        The named tuple (u1, u2) of Dask arrays, in the unit of the velocities before: in the chunks of the
        arguments, of the dtype that `collide.resolve` gives.

    Raises
    ------
    InvalidPairError
        When it is computed, as said under `invalid`; its `index` is that in the whole array, its `count` that of the
        chunk.
    ValueError
        At once: for shapes that do not match, chunks of unknown sizes, an unknown `invalid`.
    TypeError
        At once: for other dtypes, and masked arrays.

    See Also
    --------
    collide.resolve : The same at once, of NumPy arrays; how exact it is.

    Notes
    -----
    The results are lazy, and share a task for each chunk: computed together, by ``dask.compute(*u)`` or
    ``dask.array.store``, each chunk is resolved once. A task runs on its own thread only.

    Examples
    --------
    >>> v1 = da.from_array(np.array([[2.0, 0.0], [4.0, 0.0]]), chunks=(1, 2))
    >>> collide.dask.resolve(1.0, 1.0, v1, [0.0, 0.0], [1.0, 1.0]).u2.compute()
    array([[1., 1.],
           [2., 2.]])
    """
    arrays = {name: as_dask(name, value) for name, value in (("v1", v1), ("v2", v2), ("n", n))}
    d = vectors.length_of({name: () if array is None else array.shape for name, array in arrays.items()})
    inputs = m1, m2, *(array[..., k] for array in arrays.values() for k in range(d)), restitution
    u = lazily(vectors.FORMS[d].name, inputs, approaching_only, invalid)
    return batch.Velocities(*(da.stack(ball, axis=-1).rechunk({ball[0].ndim: -1}) for ball in (u[:d], u[d:])))


def resolve_polar(
    m1: Any,
    m2: Any,
    v1: Any,
    theta1: Any,
    v2: Any,
    theta2: Any,
    phi: Any,
    *,
    restitution: Any = 1.0,
    approaching_only: bool = False,
    invalid: Invalid = "raise",
) -> batch.Velocities2D[da.Array]:
    """Compute velocity components after collisions in the plane, chunk by chunk, from speeds and directions.

        u1x = [(m1 - e m2) v1 cos(theta1-phi) + (1+e) m2 v2 cos(theta2-phi)]/(m1+m2) * cos(phi)
              + v1 sin(theta1-phi) cos(phi + pi/2)

    u1y with sin in place of the last cosines, u2 with 1 and 2 exchanged.

    Parameters
    ----------
    m1, m2 : array_like or dask.array.Array
        Masses, >= 0. inf is an immovable ball (a wall), 0 a test particle; not both of a pair inf, nor both 0.
    v1, theta1, v2, theta2 : array_like or dask.array.Array
        Speeds before, in any consistent set of units, and their directions, in radians.
    phi : array_like or dask.array.Array
        Direction of the line of centres, from ball 1 to ball 2, in radians.
    restitution : array_like or dask.array.Array, optional
        Coefficient of restitution e, finite and >= 0: 1 is elastic, 0 takes away all relative velocity along the line
        of centres. Above 1 the collision adds energy.
    approaching_only : bool, optional
        True leaves as they are the pairs that do not approach (v1 cos(theta1-phi) <= v2 cos(theta2-phi)), two immovable
        balls among them.
    invalid : {"raise", "keep", "nan"}, optional
        What happens to a pair that breaks a rule above, or whose result is too large for its dtype. "raise":
        InvalidPairError is raised when its chunk is computed. "keep": it keeps its velocities v cos(theta),
        v sin(theta). "nan": it gets NaN.

    Returns
    -------
    Velocities2D
        The named tuple (u1x, u1y, u2x, u2y) of Dask arrays, in the unit of the velocities before: in the chunks of the
        arguments, of the dtype that `collide.resolve_polar` gives.

    Raises
    ------
    InvalidPairError
        When it is computed, as said under `invalid`; its `index` is that in the whole array, its `count` that of the
        chunk.
    ValueError
        At once: for shapes that do not match, chunks of unknown sizes, an unknown `invalid`.
    TypeError
        At once: for other dtypes, and masked arrays.

    See Also
    --------
    collide.resolve_polar : The same at once, of NumPy arrays; how exact it is.

    Notes
    -----
    The results are lazy, and share a task for each chunk: computed together, by ``dask.compute(*u)`` or
    ``dask.array.store``, each chunk is resolved once. A task runs on its own thread only.

    Examples
    --------
    >>> phi = da.linspace(0.0, np.pi / 2, 3, chunks=2)
    >>> collide.dask.resolve_polar(1.0, 1.0, 2.0, 0.0, 0.0, 0.0, phi).u2x.compute().round(15)
    array([2., 1., 0.])
    """
    inputs = m1, m2, v1, theta1, v2, theta2, phi, restitution
    return batch.Velocities2D(*lazily("polar", inputs, approaching_only, invalid))


def impulse_2d(
    m1: Any,
    m2: Any,
    v1x: Any,
    v1y: Any,
    v2x: Any,
    v2y: Any,
    nx: Any,
    ny: Any,
    *,
    restitution: Any = 1.0,
    approaching_only: bool = False,
    invalid: Invalid = "raise",
) -> da.Array:
    """Compute the impulse on ball 2 along n/|n| in collisions in the plane, chunk by chunk.

        p = (1+e) m1 m2/(m1+m2) (v1-v2).n / |n|

    Parameters
    ----------
    m1, m2 : array_like or dask.array.Array
        Masses, >= 0. inf is an immovable ball (a wall), 0 a test particle; not both of a pair inf, nor both 0.
    v1x, v1y, v2x, v2y : array_like or dask.array.Array
        Velocity components before, in any consistent set of units.
    nx, ny : array_like or dask.array.Array
        A vector n along the line of centres, from ball 1 to ball 2, of any length but 0; x2-x1, y2-y1 will do.
    restitution : array_like or dask.array.Array, optional
        Coefficient of restitution e, finite and >= 0: 1 is elastic, 0 takes away all relative velocity along the line
        of centres. Above 1 the collision adds energy.
    approaching_only : bool, optional
        True gives 0 for pairs that do not approach ((v1-v2).n <= 0), two immovable balls among them.
    invalid : {"raise", "keep", "nan"}, optional
        What happens to a pair that breaks a rule above, or whose result is too large for its dtype. "raise":
        InvalidPairError is raised when its chunk is computed. "keep": it gets 0. "nan": it gets NaN.

    Returns
    -------
    dask.array.Array
        Impulses, mass times velocity: in the chunks of the arguments, of the dtype that `collide.impulse_2d` gives.

    Raises
    ------
    InvalidPairError
        When it is computed, as said under `invalid`; its `index` is that in the whole array, its `count` that of the
        chunk.
    ValueError
        At once: for shapes that do not match, chunks of unknown sizes, an unknown `invalid`.
    TypeError
        At once: for other dtypes, and masked arrays.

    See Also
    --------
    collide.impulse_2d : The same at once, of NumPy arrays; how exact it is.

    Notes
    -----
    The result is lazy. A task resolves a chunk, and runs on its own thread only.

    Examples
    --------
    >>> collide.dask.impulse_2d(1.0, np.inf, da.ones(3), 0.0, 0.0, 0.0, 1.0, 0.0).compute()
    array([2., 2., 2.])
    """
    inputs = m1, m2, v1x, v1y, v2x, v2y, nx, ny, restitution
    return lazily("impulse_2d", inputs, approaching_only, invalid)[0]


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
    *,
    restitution: Any = 1.0,
    approaching_only: bool = False,
    invalid: Invalid = "raise",
) -> da.Array:
    """Compute the impulse on ball 2 along n/|n| in collisions in space, chunk by chunk.

        p = (1+e) m1 m2/(m1+m2) (v1-v2).n / |n|

    Parameters
    ----------
    m1, m2 : array_like or dask.array.Array
        Masses, >= 0. inf is an immovable ball (a wall), 0 a test particle; not both of a pair inf, nor both 0.
    v1x, v1y, v1z, v2x, v2y, v2z : array_like or dask.array.Array
        Velocity components before, in any consistent set of units.
    nx, ny, nz : array_like or dask.array.Array
        A vector n along the line of centres, from ball 1 to ball 2, of any length but 0; x2-x1, y2-y1, z2-z1 will do.
    restitution : array_like or dask.array.Array, optional
        Coefficient of restitution e, finite and >= 0: 1 is elastic, 0 takes away all relative velocity along the line
        of centres. Above 1 the collision adds energy.
    approaching_only : bool, optional
        True gives 0 for pairs that do not approach ((v1-v2).n <= 0), two immovable balls among them.
    invalid : {"raise", "keep", "nan"}, optional
        What happens to a pair that breaks a rule above, or whose result is too large for its dtype. "raise":
        InvalidPairError is raised when its chunk is computed. "keep": it gets 0. "nan": it gets NaN.

    Returns
    -------
    dask.array.Array
        Impulses, mass times velocity: in the chunks of the arguments, of the dtype that `collide.impulse_3d` gives.

    Raises
    ------
    InvalidPairError
        When it is computed, as said under `invalid`; its `index` is that in the whole array, its `count` that of the
        chunk.
    ValueError
        At once: for shapes that do not match, chunks of unknown sizes, an unknown `invalid`.
    TypeError
        At once: for other dtypes, and masked arrays.

    See Also
    --------
    collide.impulse_3d : The same at once, of NumPy arrays; how exact it is.

    Notes
    -----
    The result is lazy. A task resolves a chunk, and runs on its own thread only.

    Examples
    --------
    >>> collide.dask.impulse_3d(1.0, np.inf, 0.0, 0.0, da.ones(3), 0.0, 0.0, 0.0, 0.0, 0.0, 1.0).compute()
    array([2., 2., 2.])
    """
    inputs = m1, m2, v1x, v1y, v1z, v2x, v2y, v2z, nx, ny, nz, restitution
    return lazily("impulse_3d", inputs, approaching_only, invalid)[0]


def time_of_impact(dx: Any, dy: Any, dvx: Any, dvy: Any, distance: Any, *, invalid: InvalidTime = "raise") -> da.Array:
    """Compute the earliest times t >= 0 at which balls in the plane touch, chunk by chunk.

        t = (d^2 - R^2) / (sqrt(R^2 w^2 - (d x w)^2) - d.w)

    inf for pairs that never touch, 0 for one that touches or overlaps and approaches.

    Parameters
    ----------
    dx, dy : array_like or dask.array.Array
        Components of d = x2-x1, from ball 1 to ball 2, in any consistent set of units.
    dvx, dvy : array_like or dask.array.Array
        Components of w = v2-v1, the velocity of ball 2 seen from ball 1.
    distance : array_like or dask.array.Array
        The distance R = r1+r2 of the centres at which the balls touch, finite and >= 0.
    invalid : {"raise", "nan"}, optional
        What happens where an argument is not finite, the distance negative or the time of an impact too large for the
        dtype of the result (inf means never). "raise": InvalidPairError is raised when its chunk is computed. "nan": it
        gets NaN.

    Returns
    -------
    dask.array.Array
        Times: in the chunks of the arguments, of the dtype that `collide.time_of_impact` gives.

    Raises
    ------
    InvalidPairError
        When it is computed, as said under `invalid`; its `index` is that in the whole array, its `count` that of the
        chunk.
    ValueError
        At once: for shapes that do not match, chunks of unknown sizes, an unknown `invalid`.
    TypeError
        At once: for other dtypes, and masked arrays.

    See Also
    --------
    collide.time_of_impact : The same at once, of NumPy arrays; how exact it is.

    Notes
    -----
    The result is lazy. A task resolves a chunk, and runs on its own thread only.

    Examples
    --------
    >>> collide.dask.time_of_impact(da.from_array(np.array([3.0, 5.0])), 0.0, -1.0, 0.0, 1.0).compute()
    array([2., 4.])
    """
    return lazily("impact", (dx, dy, dvx, dvy, distance), False, invalid)[0]


def time_of_impact_3d(
    dx: Any, dy: Any, dz: Any, dvx: Any, dvy: Any, dvz: Any, distance: Any, *, invalid: InvalidTime = "raise"
) -> da.Array:
    """Compute the earliest times t >= 0 at which balls in space touch, chunk by chunk.

        t = (d^2 - R^2) / (sqrt(R^2 w^2 - |d x w|^2) - d.w)

    inf for pairs that never touch, 0 for one that touches or overlaps and approaches.

    Parameters
    ----------
    dx, dy, dz : array_like or dask.array.Array
        Components of d = x2-x1, from ball 1 to ball 2, in any consistent set of units.
    dvx, dvy, dvz : array_like or dask.array.Array
        Components of w = v2-v1, the velocity of ball 2 seen from ball 1.
    distance : array_like or dask.array.Array
        The distance R = r1+r2 of the centres at which the balls touch, finite and >= 0.
    invalid : {"raise", "nan"}, optional
        What happens where an argument is not finite, the distance negative or the time of an impact too large for the
        dtype of the result (inf means never). "raise": InvalidPairError is raised when its chunk is computed. "nan": it
        gets NaN.

    Returns
    -------
    dask.array.Array
        Times: in the chunks of the arguments, of the dtype that `collide.time_of_impact_3d` gives.

    Raises
    ------
    InvalidPairError
        When it is computed, as said under `invalid`; its `index` is that in the whole array, its `count` that of the
        chunk.
    ValueError
        At once: for shapes that do not match, chunks of unknown sizes, an unknown `invalid`.
    TypeError
        At once: for other dtypes, and masked arrays.

    See Also
    --------
    collide.time_of_impact_3d : The same at once, of NumPy arrays; how exact it is.

    Notes
    -----
    The result is lazy. A task resolves a chunk, and runs on its own thread only.

    Examples
    --------
    >>> collide.dask.time_of_impact_3d(0.0, 0.0, da.from_array(np.array([3.0, 5.0])), 0.0, 0.0, -1.0, 1.0).compute()
    array([2., 4.])
    """
    return lazily("impact_3d", (dx, dy, dz, dvx, dvy, dvz, distance), False, invalid)[0]
