"""Pairs that share balls, resolved one after another: each sees the velocities that the earlier ones left."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import types

from .._compile.components import each
from .._compile.elementwise import select
from .._compile.gather import prefetch
from .._compile.kernel import Kernel
from .._compile.lanes import any_lane, doubt
from .._compile.options import formula
from .._formulas.collision import impulse as impulse_of
from .._formulas.collision import in_the_plane
from .._pairs.forms import FORM_2D, obeys_rules
from .torus import wrap

_step_of = FORM_2D.step  # a name of its own: compiled code sees no attributes of a form

# Balls are asked for so many pairs ahead. Where they are in no order, this made 22 million pairs/s of 10, and 35 with
# the masses, which are only read.
_AHEAD = 12


def _kernel_check(i, j, n_balls):  # type: ignore[no-untyped-def]  # compiled only
    """Whether every pair is one of two different balls."""
    wrong = 0
    for k in range(i.size):
        wrong += (i[k] < 0) | (i[k] >= n_balls) | (j[k] < 0) | (j[k] >= n_balls) | (i[k] == j[k])
    return wrong == 0


def _kernel_contacts(  # type: ignore[no-untyped-def]  # compiled only
    i, j, m, x, y, e, lx, ly, nan, vx, vy, impulse, witness
):
    """Resolves the pairs that approach. Returns how many, how many are invalid and which is the first that is, or -1.

    That pair's values go into `witness`, in the order of FORM_2D.columns.
    """
    # Three loops: with the box asked for at each pair, open space took a quarter longer, and one with both sides 6 %.
    if lx > 0.0 and ly > 0.0:
        return _in_order((i, j, e), (m, x, y, vx, vy), (lx, ly), nan, impulse, witness)
    if lx > 0.0 or ly > 0.0:
        return _in_order((i, j, e), (m, x, y, vx, vy), (lx, ly), nan, impulse, witness)
    return _in_order((i, j, e), (m, x, y, vx, vy), (0.0, 0.0), nan, impulse, witness)


@formula
def _in_order(pairs: Any, balls: Any, box: Any, nan: Any, impulse: Any, witness: Any) -> Any:
    (i, j, e), (m, x, y, vx, vy), (lx, ly) = pairs, balls, box
    n_resolved, n_invalid, first = 0, 0, -1
    each_m, each_e = 1 if m.size > 1 else 0, 1 if e.size > 1 else 0
    for k in range(i.size):
        later = min(k + _AHEAD, i.size - 1)
        for ball in (i[later], j[later]):
            prefetch(ball, (x, y, vx, vy))
            prefetch(ball * each_m, (m,))
        one, two = i[k], j[k]
        pair = (
            m[one * each_m],
            m[two * each_m],
            vx[one],
            vy[one],
            vx[two],
            vy[two],
            _distance(x[one], x[two], lx),
            _distance(y[one], y[two], ly),
            e[k * each_e],
        )
        step = _step_of(pair)
        # Not `closing > 0`: NaN has to go on to the check. And no branch: whether a pair approaches cannot be guessed,
        # and a wrong guess costs more than to write velocities that have not changed.
        apart = step.closing <= 0.0
        after = each(select, apart, step.before, step.after)
        valid = True
        if any_lane(doubt(step.size, (vx,), step.signs)):
            valid = obeys_rules(step, after, (vx,))
        if impulse.size > 0:
            p = select(apart, 0.0, impulse_of(*in_the_plane(*pair))[0])
            valid = valid & (abs(p) < math.inf)
            impulse[k] = p if valid else math.nan if nan else 0.0
        n_resolved += valid & (not apart)
        if not valid:
            if n_invalid == 0:
                first = k
                for c in range(len(pair)):
                    witness[c] = pair[c]
            n_invalid += 1
            after = (math.nan, math.nan, math.nan, math.nan) if nan else step.before
        vx[one], vy[one], vx[two], vy[two] = after
    return n_resolved, n_invalid, first


@formula
def _distance(x1: Any, x2: Any, length: Any) -> Any:
    """x2 - x1, in a periodic box to the nearest image; length 0 is no box."""
    d = wrap(x2, length) - wrap(x1, length)
    return d - length * np.rint(d / length) if length > 0.0 else d


_READ, _WRITE = types.Array(types.float64, 1, "C", readonly=True), types.Array(types.float64, 1, "C")
_BALLS = types.Array(types.int64, 1, "C", readonly=True)
CHECK = Kernel(_kernel_check, types.boolean(_BALLS, _BALLS, types.int64), "_kernel_check")
RESOLVE = Kernel(
    _kernel_contacts,
    types.UniTuple(types.int64, 3)(
        _BALLS, _BALLS, *[_READ] * 4, types.float64, types.float64, types.boolean, *[_WRITE] * 4
    ),
    "_kernel_contacts",
)
