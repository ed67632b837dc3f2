"""Pairs that share balls, resolved one after another: each sees the velocities that the earlier ones left."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numba import types

from .._compile.components import each, halves
from .._compile.elementwise import as_float64, select
from .._compile.gather import prefetch
from .._compile.kernel import Kernel, spread
from .._compile.lanes import any_lane, doubt
from .._compile.options import formula
from .._formulas.collision import impulse as impulse_of
from .._formulas.collision import in_space, in_the_plane
from .._pairs.forms import FORM_2D, Form, obeys_rules
from .._pairs.vectors import FORMS
from .torus import touching, wrap

# Balls are asked for so many pairs ahead. Where they are in no order, this made 22 million pairs/s of 10, and 35 with
# the masses, which are only read.
_AHEAD = 12


@formula
def _in_order(
    step_of: Any,
    stated: Any,
    meeting: Any,
    pairs: Any,
    balls: Any,
    place: Any,
    v: Any,
    impulse: Any,
    witness: Any,
    approaching: bool,
    nan: bool,
    start: int,
    stop: int,
) -> Any:
    """Resolves pairs start to stop. Returns how many, how many are invalid and which is the first that is, or -1.

    step_of, stated: what the form makes of a pair, and how it states one to the formula
    meeting: gives the normal of pair k, of the balls one and two, and whether they are too far apart to collide
    pairs: i, j, e
    balls: the masses, and what else `meeting` asks of each ball
    approaching: whether pairs that do not approach are left alone as well

    The values of the first invalid pair go into `witness`, in the order of the form's columns.
    """
    i, j, e = pairs
    n_resolved, n_invalid, first = 0, 0, -1
    for at in range(start, stop):
        # Without a sign: of a signed number Numba asks at each array whether it counts from the end.
        k, later = np.uint64(at), np.uint64(min(at + _AHEAD, stop - 1))
        prefetch(i[later], v, balls)
        prefetch(j[later], v, balls)
        one, two = np.uint64(i[k]), np.uint64(j[k])
        n, alone = meeting(k, one, two, balls, place)
        pair = (_of(balls[0], one), _of(balls[0], two), *each(_of, v, one), *each(_of, v, two), *n, _of(e, k))
        step = step_of(pair)
        # Not `closing > 0`: NaN has to go on to the check. And no branch: whether a pair approaches cannot be guessed,
        # and a wrong guess costs more than to write velocities that have not changed.
        alone = alone | (approaching & (step.closing <= 0.0))
        after = each(select, alone, step.before, step.after)
        valid = True
        if any_lane(doubt(step.size, v, step.signs)):
            valid = obeys_rules(step, after, v)
        if impulse.size > 0:
            p = select(alone, 0.0, impulse_of(*stated(*pair))[0])
            valid = valid & (abs(p) < math.inf)
            impulse[k] = p if valid else math.nan if nan else 0.0
        n_resolved += valid & (not alone)
        if not valid:
            if n_invalid == 0:
                first = at
                for c in range(len(pair)):
                    witness[c] = pair[c]
            n_invalid += 1
            after = each(_nan, after) if nan else step.before
        u1, u2 = halves(after)
        each(_put, v, one, u1)
        each(_put, v, two, u2)
    return n_resolved, n_invalid, first


@formula
def _of(array: Any, k: Any) -> Any:
    return as_float64(array[k])


@formula
def _put(array: Any, k: Any, value: Any) -> Any:
    array[k] = value
    return value


@formula
def _nan(value: Any) -> float:
    return math.nan


_in_plane = FORM_2D.step  # a name of its own: compiled code sees no attributes of a form

# Contacts. Three loops each: with the box asked for at each pair, open space took a quarter longer, and one with both
# sides 6 %.


@formula
def _contacts(
    meeting: Any, i: Any, j: Any, e: Any, balls: Any, box: Any, v: Any, impulse: Any, witness: Any, nan: bool
) -> Any:
    pairs, states = (i, j, e), (v, impulse, witness, True, nan, 0, i.size)
    if box[0] > 0.0 and box[1] > 0.0:
        return _in_order(_in_plane, in_the_plane, meeting, pairs, balls, box, *states)
    if box[0] > 0.0 or box[1] > 0.0:
        return _in_order(_in_plane, in_the_plane, meeting, pairs, balls, box, *states)
    return _in_order(_in_plane, in_the_plane, meeting, pairs, balls, (0.0, 0.0), *states)


@formula
def _centres(k: Any, one: Any, two: Any, balls: Any, box: Any) -> Any:
    """The normal is from centre to centre."""
    _, x, y = balls
    lx, ly = box
    return (_distance(_of(x, one), _of(x, two), lx), _distance(_of(y, one), _of(y, two), ly)), False


@formula
def _touching(k: Any, one: Any, two: Any, balls: Any, box: Any) -> Any:
    """The same of balls with radii. `touching` finds that n is the way to the nearest image, and leaves its bits."""
    m, x, y, radius = balls
    lx, ly = box
    (nx, ny), _ = _centres(k, one, two, (m, x, y), box)
    return (nx, ny), not touching(nx, ny, _of(radius, one) + _of(radius, two), lx, ly)


@formula
def _distance(x1: Any, x2: Any, length: Any) -> Any:
    """x2 - x1, in a periodic box to the nearest image; length 0 is no box."""
    d = wrap(x2, length) - wrap(x1, length)
    return d - length * np.rint(d / length) if length > 0.0 else d


# Pairs with normals of their own.


@formula
def _pairs(
    step_of: Any,
    stated: Any,
    i: Any,
    j: Any,
    e: Any,
    m: Any,
    n: Any,
    v: Any,
    impulse: Any,
    witness: Any,
    approaching: bool,
    nan: bool,
    start: int,
    stop: int,
) -> Any:
    states = v, impulse, witness, approaching, nan, start, stop
    return _in_order(step_of, stated, _given, (i, j, e), (m,), n, *states)


@formula
def _given(k: Any, one: Any, two: Any, balls: Any, n: Any) -> Any:
    return each(_of, n, k), False


def _check(i, j, n_balls):  # type: ignore[no-untyped-def]  # compiled only
    """Whether every pair is one of two different balls."""
    wrong = 0
    for k in range(i.size):
        wrong += (i[k] < 0) | (i[k] >= n_balls) | (j[k] < 0) | (j[k] >= n_balls) | (i[k] == j[k])
    return wrong == 0


def _disjoint(i, j, met):  # type: ignore[no-untyped-def]  # compiled only
    """Whether no ball stands in two pairs; `met` has a byte a ball, all 0."""
    for k in range(i.size):
        one, two = i[k], j[k]
        if met[one] | met[two]:
            return False
        met[one] = met[two] = 1
    return True


_READ, _WITNESS = types.Array(types.float64, 1, "A", readonly=True), types.Array(types.float64, 1, "C")
_BALLS, _MARKS = types.Array(types.int64, 1, "C", readonly=True), types.Array(types.uint8, 1, "C")
_IMPULSE, _NUMBER, _FLAG, _PLACE = types.Array(types.float64, 1, "A"), types.float64, types.boolean, types.int64
_DTYPES = {"d": types.float64, "f": types.float32}


def _kernel(function: Callable[..., Any], name: str, *signature: Any) -> Kernel:
    return Kernel(function, types.UniTuple(types.int64, 3)(_BALLS, _BALLS, _READ, *signature), name)


def _contacts_kernels(name: str, meeting: Callable[..., Any], n_balls: int) -> dict[tuple[str, str], Kernel]:
    """By the dtype of the velocities, and by the layout: C where positions and velocities have no gaps, else A.

    Where they have none, to multiply by a step each time would take a tenth longer.
    """
    function, kernels = spread(name, _contacts, (0, 0, 0, n_balls, 2, 2, 0, 0, 0), meeting), {}
    for (char, dtype), layout in itertools.product(_DTYPES.items(), "CA"):
        v, position = types.Array(dtype, 1, layout), types.Array(types.float64, 1, layout, readonly=True)
        balls = [_READ, position, position, _READ][:n_balls]
        rest = _NUMBER, _NUMBER, v, v, _IMPULSE, _WITNESS, _FLAG
        kernels[char, layout] = _kernel(function, f"{name}-{char}{layout}", *balls, *rest)
    return kernels


def _pairs_kernels(form: Form, stated: Callable[..., Any], d: int) -> dict[str, Kernel]:
    """By the dtype of the velocities."""
    name = f"pairs_{form.name}"
    function, kernels = spread(name, _pairs, (0, 0, 0, 0, d, d, 0, 0, 0, 0, 0, 0), form.step, stated), {}
    for char, dtype in _DTYPES.items():
        rest = [types.Array(dtype, 1, "A")] * d, _IMPULSE, _WITNESS, _FLAG, _FLAG, _PLACE, _PLACE
        kernels[char] = _kernel(function, f"{name}-{char}", _READ, *[_READ] * d, *rest[0], *rest[1:])
    return kernels


CHECK = Kernel(_check, types.boolean(_BALLS, _BALLS, types.int64), "_check")
DISJOINT = Kernel(_disjoint, types.boolean(_BALLS, _BALLS, _MARKS), "_disjoint")
CONTACTS = _contacts_kernels("contacts", _centres, 3)
TOUCHING = _contacts_kernels("touching", _touching, 4)  # of balls with radii
# By how many components vectors have.
PAIRS = {d: _pairs_kernels(FORMS[d], stated, d) for d, stated in ((2, in_the_plane), (3, in_space))}
