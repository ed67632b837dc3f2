"""The facade for a ball state: which balls touch, and collisions of balls by number, one after another."""

from __future__ import annotations

# Long by its docstrings, which stand in full where editors look for them: the work is in _contacts.
import math
import reprlib
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._contacts import resolution, search, state, walls
from ._contacts.in_order import CONTACTS, PAIRS, TOUCHING
from ._pairs.arguments import as_array, gives_nan, truth
from ._pairs.forms import FORM_2D
from ._pairs.vectors import FORMS
from ._typing import Array, Invalid

_MOST_BALLS = (1 << 29) - 1024  # the numbers of their cells, four a ball, are kept as int32


class Contacts(NamedTuple):
    """Pairs of balls, by their numbers."""

    i: NDArray[np.intp]
    j: NDArray[np.intp]


def find_contacts(
    x: ArrayLike,
    y: ArrayLike,
    radius: ArrayLike,
    *,
    box: tuple[float | None, float | None] | None = None,
    margin: float = 0.0,
) -> Contacts:
    """All pairs of balls that touch or overlap, or are nearer than that by a margin.

        (x_j - x_i)^2 + (y_j - y_i)^2 <= (r_i + r_j + margin)^2        in float64, as written

    Parameters
    ----------
    x, y : array_like, shape (n,)
        Positions of the centres, finite, of any extent. Any consistent set of units.
    radius : array_like, scalar or shape (n,)
        Radii, finite and >= 0. Sizes may differ by any ratio.
    box : (Lx, Ly), optional
        The sides of a periodic box; without it space is open. Positions outside wrap into [0, Lx) x [0, Ly) as x % Lx
        does, and of a ball's images the nearest counts, |dx| or Lx - |dx|. Each side has to be at least twice the
        longest distance 2 r + margin at which balls may touch. A side of None is open: (Lx, None) is a channel along x.
    margin : float, optional
        Finite and >= 0. A list with a margin serves until some ball has moved half of it; `resolve_contacts` then needs
        its `radius`, or it lets balls collide that are only near.

    Returns
    -------
    Contacts
        The named tuple (i, j): two intp arrays, i < j, each pair once. Their order is always the same for the same
        arguments, whatever the number of threads, and has no other meaning, but that neighbours in space are near each
        other in the list.

    Raises
    ------
    ValueError
        For positions that are not finite, negative radii, shapes that do not match, a box that is too small.
    TypeError
        For dtypes other than bool, integers, float16, float32 and float64, and for masked arrays.
    MemoryError
        For a list that cannot fit into memory.

    Notes
    -----
    Balls are sorted into cells: the time grows as the number of balls and contacts, unless a few large balls cover
    dense clusters of much smaller ones. Besides the list, up to 100 bytes a ball are needed for a while, and 8 more
    for each column that is not contiguous float64.

    The first call compiles, which takes some 2 to 7 seconds, and keeps the kernel on disk: in the folder
    NUMBA_CACHE_DIR if that is set, else beside the package, else among the user's caches. ``collide compile`` makes all
    kernels ahead.

    Examples
    --------
    >>> i, j = collide.find_contacts([0.0, 1.5, 9.5], [0.0, 0.0, 0.0], 1.0)
    >>> i, j
    (array([0]), array([1]))
    >>> collide.find_contacts([0.0, 1.5, 9.5], [0.0, 0.0, 0.0], 1.0, box=(10.0, None)).i.size
    3
    """
    x, y = state.columns(x, y)
    radius = state.column("radius", radius, "x", x.size)
    sides = state.sides(box)
    one = as_array("margin", margin)
    gap = math.nan if one.ndim else float(one)  # or float16 would be computed with, and warn
    if not 0.0 <= gap < math.inf:
        raise ValueError(f"margin = {reprlib.repr(margin)}: must be one finite number >= 0")
    bounds = state.bounds("x", x), state.bounds("y", y), state.bounds_from_zero("radius", radius)
    reach = 2.0 * bounds[2][1] + gap
    if reach > state.LONGEST:
        raise ValueError(f"2 radius + margin = {reach} for the largest ball: must be at most {state.LONGEST}")
    for k, side in enumerate(sides):
        if side and side < 2.0 * reach:
            raise ValueError(f"box[{k}] = {side}: must be at least {2.0 * reach}, twice as far as balls touch")
    if x.size > _MOST_BALLS:
        raise ValueError(f"x has {x.size} elements: at most {_MOST_BALLS} balls can be searched")
    return Contacts(*search.contacts(x, y, radius, bounds, sides, gap))


def resolve_contacts(
    i: ArrayLike,
    j: ArrayLike,
    m: ArrayLike,
    x: ArrayLike,
    y: ArrayLike,
    vx: Array,
    vy: Array,
    *,
    radius: ArrayLike | None = None,
    restitution: ArrayLike = 1.0,
    box: tuple[float | None, float | None] | None = None,
    invalid: Invalid = "raise",
    impulse: Array | None = None,
) -> int:
    """Resolve the contacts of a ball state in place, one after another in the order of the list.

    A ball in several pairs enters each with the velocity that the earlier ones have left it. The collision is that of
    `resolve_2d` with n = (x_j - x_i, y_j - y_i); pairs that do not approach, (v_i - v_j).n <= 0, are left alone. It
    runs on the caller's thread, so that the result does not depend on the number of threads.

    Parameters
    ----------
    i, j : array_like of integers, shape (k,)
        The pairs, each of two different balls, which have the numbers 0 to n-1.
    m : array_like, a number or shape (n,)
        Masses, >= 0. inf is an immovable ball, 0 a test particle. Any consistent set of units.
    x, y : array_like, shape (n,)
        Positions of the centres.
    vx, vy : array, shape (n,), writable, both float64 or both float32
        Velocity components; they are changed. The arithmetic is float64; float32 is rounded once a pair.
    radius : array_like, a number or shape (n,), optional
        With it, pairs that do not touch are left alone: those of which not
        (x_j - x_i)^2 + (y_j - y_i)^2 <= (r_i + r_j)^2, just as `find_contacts` has it. So one of its lists, made with
        a margin, serves until some ball has moved half the margin. Finite and >= 0.
    restitution : array_like, a number or shape (k,), optional
        e, finite and >= 0, one value a pair.
    box : tuple of 2 numbers or None, optional
        (Lx, Ly) of a periodic box, in which the nearest of a ball's images counts; a side of None is open, and None is
        open space.
    invalid : {"raise", "keep", "nan"}, optional
        What happens to a pair that breaks a rule, whether it touches or not: a mass that is negative or NaN, two
        masses 0, two of inf that touch and approach, centres in one place, a velocity, position or result that is not
        finite, a bad restitution. "raise" raises InvalidPairError when all others have been resolved, and this one
        leaves its balls' velocities alone; under "keep" it does so without the error; under "nan" its balls'
        velocities become NaN, and with them later pairs of theirs invalid.
    impulse : array, shape (k,), writable, float64, optional
        Gets each pair's impulse on ball j along n/|n|, 0 for those left alone, NaN for invalid ones under "nan". A
        pair whose impulse is too large is invalid then.

    Returns
    -------
    int
        How many pairs were resolved.

    Raises
    ------
    InvalidPairError
        As said; its `index` is the place in the list. It is a ValueError. All others come before anything is written.
    IndexError
        For a ball that does not exist.
    ValueError
        For i = j, shapes that do not match, a radius that is negative or not finite, outputs that share memory,
        read-only outputs, an unknown `invalid`.
    TypeError
        For other dtypes: inputs are of bool, integers, float16, float32 or float64. Masked arrays.

    Notes
    -----
    The first call compiles, which takes some 2 to 7 seconds, and keeps the kernel on disk: in the folder
    NUMBA_CACHE_DIR if that is set, else beside the package, else among the user's caches. ``collide compile`` makes all
    kernels ahead.

    Examples
    --------
    >>> vx, vy = np.array([1.0, 0.0, 0.0]), np.zeros(3)
    >>> collide.resolve_contacts([0, 1], [1, 2], 1.0, [0.0, 2.0, 4.0], [0.0, 0.0, 0.0], vx, vy)
    2
    >>> vx
    array([0., 0., 1.])
    >>> collide.resolve_contacts([1], [2], 1.0, [0.0, 2.0, 4.0], [0.0, 0.0, 0.0], -vx, vy, radius=0.9)
    0
    """
    nan, given = gives_nan(invalid, FORM_2D.invalid), (i, j)
    i, j = state.pairs(i, j)
    x, y = state.columns(x, y)
    e, masses = state.one_each("restitution", restitution, "i", i.size), state.one_each("m", m, "x", x.size)
    radii = () if radius is None else (state.radii(radius, "x", x.size),)
    v, sides = state.velocities({"vx": vx, "vy": vy}, "x", x.size), state.sides(box)

    def run(inputs: list[Array], v: list[Array], impulse: Array, witness: Array) -> resolution.Found:
        layout = "C" if v[0].flags.c_contiguous and v[1].flags.c_contiguous else "A"
        kernel = (CONTACTS if radius is None else TOUCHING)[v[0].dtype.char, layout]
        return kernel.compiled(*inputs, *sides, *v, impulse, witness, nan)  # type: ignore[no-any-return]

    return resolution.resolve(FORM_2D, given, x.size, (i, j, e, masses, x, y, *radii), v, impulse, invalid, run)


def resolve_pairs(
    i: ArrayLike,
    j: ArrayLike,
    m: ArrayLike,
    v: Array | tuple[Array, ...],
    n: ArrayLike | tuple[ArrayLike, ...],
    *,
    restitution: ArrayLike = 1.0,
    approaching_only: bool = False,
    invalid: Invalid = "raise",
    impulse: Array | None = None,
) -> int:
    """Resolve collisions of balls by number, each with a normal of its own, in place and in the order of the list.

    A ball in several pairs enters each with the velocity that the earlier ones have left it. The collision is that of
    `resolve_2d` or `resolve_3d`, to the bit: what `v[i], v[j] = resolve(m[i], m[j], v[i], v[j], n)` does pair
    after pair. It runs on the caller's thread; only where a large list has no ball in two pairs, so that their order
    does not matter, on all. The result does not depend on the number of threads.

    Parameters
    ----------
    i, j : array_like of integers, shape (k,)
        The pairs, each of two different balls, which have the numbers 0 to N-1.
    m : array_like, a number or shape (N,)
        Masses, >= 0. inf is an immovable ball (a wall), 0 a test particle. Any consistent set of units.
    v : array, shape (N, d), or tuple of d arrays, shape (N,), writable, all float64 or all float32
        Velocities; d is 2 or 3. They are changed. The arithmetic is float64; float32 is rounded once a pair.
    n : array_like, shape (k, d) or (d,), or tuple of d, each a number or of shape (k,)
        Vectors along the line of centres, from ball i to ball j, of any length but 0; one a pair, or one for all.
    restitution : array_like, a number or shape (k,), optional
        e, finite and >= 0, one value a pair.
    approaching_only : bool, optional
        True leaves alone the pairs that do not approach, (v_i - v_j).n <= 0, two immovable balls among them.
    invalid : {"raise", "keep", "nan"}, optional
        What happens to a pair that breaks a rule above, or with a velocity or result that is not finite: "raise"
        raises InvalidPairError when all others have been resolved, and this one leaves its balls' velocities alone;
        under "keep" it does so without the error; under "nan" its balls' velocities become NaN, and with them later
        pairs of theirs invalid.
    impulse : array, shape (k,), writable, float64, optional
        Gets each pair's impulse on ball j along n/|n|, positive for a pair that approaches, 0 for those left alone,
        NaN for invalid ones under "nan". A pair whose impulse is too large is invalid then.

    Returns
    -------
    int
        How many pairs were resolved.

    Raises
    ------
    InvalidPairError
        As said; its `index` is the place in the list. It is a ValueError. All others come before anything is written.
    IndexError
        For a ball that does not exist.
    ValueError
        For i = j, shapes that do not match, outputs that share memory, read-only outputs, an unknown `invalid`.
    TypeError
        For other dtypes: inputs are of bool, integers, float16, float32 or float64. Masked arrays.

    Notes
    -----
    On several threads a byte a ball is needed for a while. Inputs that are not float64 are copied, and so are those
    that share memory with what is written: what counts are their values before the call.

    The first call compiles, which takes some 2 to 7 seconds, and keeps the kernel on disk: in the folder
    NUMBA_CACHE_DIR if that is set, else beside the package, else among the user's caches. ``collide compile`` makes all
    kernels ahead.

    Examples
    --------
    A ball meets its equal, at rest, 45 degrees off centre, and that one a wall:

    >>> v = np.array([[2.0, 0.0], [0.0, 0.0], [0.0, 0.0]])
    >>> collide.resolve_pairs([0, 1], [1, 2], [1.0, 1.0, np.inf], v, [[1.0, 1.0], [1.0, 0.0]])
    2
    >>> v
    array([[ 1., -1.],
           [-1.,  1.],
           [ 0.,  0.]])
    """
    velocities = state.vectors(v, FORMS)
    d, n_balls = len(velocities), next(iter(velocities.values())).size
    form = FORMS[d]
    flags, given = (truth("approaching_only", approaching_only), gives_nan(invalid, form.invalid)), (i, j)
    i, j = state.pairs(i, j)
    e, masses = state.one_each("restitution", restitution, "i", i.size), state.one_each("m", m, "the balls", n_balls)
    inputs = i, j, e, masses, *state.normals(n, i.size, d)

    def run(inputs: list[Array], v: list[Array], impulse: Array, witness: Array) -> resolution.Found:
        task = partial(PAIRS[d][v[0].dtype.char].compiled, *inputs, *v, impulse, witness, *flags)
        return resolution.in_any_order(task, inputs[0], inputs[1], n_balls)

    return resolution.resolve(form, given, n_balls, inputs, velocities, impulse, invalid, run)


def resolve_walls(
    x: ArrayLike,
    y: ArrayLike,
    vx: Array,
    vy: Array,
    radius: ArrayLike,
    box: tuple[float | None, float | None] | None,
    *,
    m: ArrayLike = 1.0,
    restitution: ArrayLike = 1.0,
    impulse: Array | None = None,
) -> int:
    """Turn around, in place, the balls that move outwards at the walls of the box [0, Lx] x [0, Ly].

        x - radius <= 0  and  vx < 0,    x + radius >= Lx  and  vx > 0:    vx becomes -e vx;    likewise y and vy

    in float64, as written. A ball that is beyond a wall and already comes back is left alone, and so is one at rest; a
    ball in a corner may bounce off both walls. It runs on the caller's thread.

    Parameters
    ----------
    x, y : array_like, shape (n,)
        Positions of the centres, finite, wherever they are. Any consistent set of units.
    vx, vy : arrays, shape (n,)
        Velocity components, finite; both of float64 or both of float32, writable, of any layout. They are changed.
    radius : array_like, a number or of shape (n,)
        Radii, finite and >= 0.
    box : (Lx, Ly) or None
        The sides of the box, not below the largest ball's diameter. A side of None has no walls, so that (None, Ly)
        is a channel; None has none at all, as elsewhere.
    m : array_like, a number or of shape (n,), optional
        Masses, >= 0; they matter for the impulse only. An immovable ball, of inf, must not have to bounce.
    restitution : array_like, a number or of shape (n,), optional
        e, finite and >= 0. 1 is elastic; 0 takes away all velocity towards the wall.
    impulse : array of float64, shape (4,), optional
        To it are added the impulses (1+e) m abs(v) that the walls x = 0, x = Lx, y = 0 and y = Ly get, outwards,
        one after another in the order of the balls. Over the time and the length of the walls they are the pressure.

    Returns
    -------
    int
        How many bounces there were; a ball in a corner may have two.

    Raises
    ------
    ValueError
        Before anything is written: for what breaks a rule above, a bounce whose velocity or impulse is too large for
        its dtype, shapes that do not match, outputs that are read-only or share memory.
    TypeError
        Likewise, for other dtypes, masked arrays, outputs that are no arrays.

    Notes
    -----
    A wall is an immovable ball: a velocity that changes has the bits of ``scalar.resolve_1d(m, inf, v, 0, e)``, which
    are those of -v where e = 1, and in float32 it is that, rounded once; +0 where e = 0. The impulse has those of
    ``scalar.impulse_2d``. Inputs of bool, integer, float16, float32 or float64 are taken; those that share memory with
    vx, vy or impulse count as they were before. Positions and velocities are not copied, where they are of one dtype:
    the columns of an (n, 2) array will do. Besides, a byte is needed for 64 balls.

    The first call compiles, which takes some 2 to 7 seconds, and keeps the kernel on disk: in the folder
    NUMBA_CACHE_DIR if that is set, else beside the package, else among the user's caches. ``collide compile`` makes all
    kernels ahead.

    Examples
    --------
    The first ball is at a wall, the second in a corner, the third comes back:

    >>> vx, vy = np.array([-1.0, 2.0, 1.0]), np.array([0.5, 3.0, 0.0])
    >>> impulse = np.zeros(4)
    >>> collide.resolve_walls([1.0, 9.5, -0.5], [5.0, 9.0, 5.0], vx, vy, 1.0, (10.0, 10.0), impulse=impulse)
    3
    >>> vx, vy, impulse
    (array([ 1., -2.,  1.]), array([ 0.5, -3. ,  0. ]), array([2., 4., 0., 6.]))
    """
    n_bounces = walls.at_once((x, y, radius, m, restitution), vx, vy, box, impulse)
    if n_bounces is not None:
        return n_bounces
    columns = dict(zip(("x", "y"), state.as_they_lie(x, y), strict=True))
    n = columns["x"].size
    for name, value in (("radius", radius), ("m", m), ("restitution", restitution)):
        columns[name] = state.values(name, value, "x", n)
    outputs = state.velocities({"vx": vx, "vy": vy}, "x", n)
    if impulse is not None:
        outputs["impulse"] = state.impulses(impulse, "the walls", 4)
    resolution.check_apart(outputs)
    sides = state.sides(box)
    inputs = walls.taken(columns, outputs)
    targets = {name: state.aligned(u) for name, u in outputs.items()}
    n_bounces, k = walls.bounce(inputs, targets["vx"], targets["vy"], sides, targets.get("impulse"))
    if k != walls.FINE:
        walls.raise_for(k, columns, outputs, sides)
    for name, u in outputs.items():
        if targets[name] is not u:
            u[...] = targets[name]
    return n_bounces
