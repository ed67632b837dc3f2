"""The facade for a ball state: which balls touch, and their collisions, one after another."""

from __future__ import annotations

import itertools
import math
import reprlib
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ._contacts import search, state
from ._contacts.in_order import CHECK, RESOLVE
from ._pairs.arguments import as_array, gives_nan, share_memory
from ._pairs.forms import FORM_2D
from ._typing import Array
from .errors import InvalidPairError, reason

_MOST_BALLS = (1 << 29) - 1024  # the numbers of their cells, four a ball, are kept as int32


class Contacts(NamedTuple):
    """Pairs of balls, by their numbers."""

    i: Any
    j: Any


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
        Finite and >= 0.

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
    Balls are sorted into cells: the time grows with the balls and the contacts, but where large balls lie over dense
    spots, far apart from each other, of much smaller ones. Besides the list, up to 100 bytes a ball are needed for a
    while, and 8 more for each column that is not contiguous float64.

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
    bounds = state.bounds("x", x), state.bounds("y", y), state.bounds("radius", radius)
    least, largest = bounds[2]
    if least < 0.0:
        raise ValueError(f"radius{state.first(radius, radius < 0.0)}: must be >= 0")
    reach = 2.0 * largest + gap
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
    restitution: ArrayLike = 1.0,
    box: tuple[float | None, float | None] | None = None,
    invalid: str = "raise",
    impulse: Array | None = None,
) -> int:
    """Resolves the contacts of a ball state in place, one after another in the order of the list.

    A ball in several pairs enters each with the velocity that the earlier ones have left it. The collision is that of
    `resolve_2d` with n = (x_j - x_i, y_j - y_i); pairs that do not approach, (v_i - v_j).n <= 0, are left alone. It
    runs on the caller's thread, so that the result does not depend on the number of threads.

    i, j: the pairs, integer arrays of shape (k,), of two different balls each, from 0 to n-1.
    m: masses, a number or an array of shape (n,), >= 0; inf is an immovable ball, 0 a test particle.
    x, y: positions of the centres, arrays of shape (n,).
    vx, vy: velocity components, arrays of shape (n,), writable, float64; they are changed.
    restitution: e, finite and >= 0, a number or an array of shape (k,), one value a pair.
    box: None, or (Lx, Ly) for a periodic box, in which the nearest of a ball's images counts. A side of None is open.
    invalid: what happens to a pair that breaks a rule: a mass that is negative or NaN, two masses 0, two of inf that
        approach, centres in one place, a velocity, position or result that is not finite, a bad restitution:
        "raise"  InvalidPairError, after all others have been resolved; this one leaves its balls' velocities alone
        "keep"   the same, without the error
        "nan"    its balls' velocities become NaN, and with them later pairs of theirs invalid
    impulse: None, or an array of shape (k,), writable, float64: it gets each pair's impulse on ball j along n/|n|,
        0 for those left alone, NaN for invalid ones under "nan". A pair whose impulse is too large is invalid then.
    Inputs are of bool, integer, float16, float32 or float64, in any consistent set of units.

    Returns how many pairs were resolved. Raises InvalidPairError (a ValueError) as said; and, before anything is
    written, IndexError for a ball that does not exist, ValueError for i = j, shapes that do not match, outputs that
    share memory, read-only outputs, an unknown `invalid`; TypeError for other dtypes.

    >>> vx, vy = np.array([1.0, 0.0, 0.0]), np.zeros(3)
    >>> collide.resolve_contacts([0, 1], [1, 2], 1.0, [0.0, 2.0, 4.0], [0.0, 0.0, 0.0], vx, vy)
    2
    >>> vx
    array([0., 0., 1.])
    """
    nan, given = gives_nan(invalid, FORM_2D.invalid), (i, j)
    i, j = state.numbers("i", i), state.numbers("j", j)
    state.check_length("j", j, "i", i.size)
    x, y = state.columns(x, y)
    m, e = state.column("m", m, "x", x.size), state.column("restitution", restitution, "i", i.size)
    outputs = {"vx": state.output("vx", vx, "x", x.size), "vy": state.output("vy", vy, "x", x.size)}
    if impulse is not None:
        outputs["impulse"] = state.output("impulse", impulse, "i", i.size)
    for (name, u), (other, w) in itertools.combinations(outputs.items(), 2):
        if share_memory(u, w):
            raise ValueError(f"{name} and {other} share memory")
    sides = state.sides(box)
    if not CHECK.compiled(i, j, x.size):
        state.raise_for_pairs(np.asarray(given[0]), np.asarray(given[1]), x.size)

    inputs = [a.copy() if any(share_memory(a, u) for u in outputs.values()) else a for a in (i, j, m, x, y, e)]
    targets = [np.ascontiguousarray(u) for u in outputs.values()]
    witness = np.empty(len(FORM_2D.columns))
    results = targets if len(targets) == 3 else [*targets, np.empty(0)]
    n_resolved, n_invalid, first = RESOLVE.compiled(*inputs, *sides, nan, *results, witness)
    for u, target in zip(outputs.values(), targets, strict=True):
        if u is not target:
            u[...] = target
    if n_invalid and invalid == "raise":
        pair = dict(zip(FORM_2D.columns, witness.tolist(), strict=True))
        raise InvalidPairError((first,), n_invalid, f"balls {i[first]} and {j[first]}, as 1 and 2: {reason(pair)}")
    return int(n_resolved)
