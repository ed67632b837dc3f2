"""The batch loops: load lanes, call the formula of scalar.py, store lanes. A kernel runs without the GIL.

In every form the masses are the first two columns and the restitution is the last.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numba import types

from . import scalar
from ._jit import Kernel, formula, rare
from ._lanes import LINE, all_finite, any_lane, count, doubt, fill, first, get, leading, out_of_line, select_each
from ._memory import is_usual, lead, load, overlap, store

# Outputs of this many bytes each and more will have left the caches before anybody reads them: they stream past.
STREAM_BYTES = 1 << 21


@formula
def _loop(
    collide: Any,
    valid: Any,
    columns: Any,
    outputs: Any,
    scalars: Any,
    start: int,
    stop: int,
    approaching: bool,
    nan: bool,
) -> tuple[int, int]:
    """Pairs start to stop of a batch. Returns how many of them are invalid, and the first that is (or -1).

    The values of that first pair join those in `scalars`: in place the columns may not have them any more. Where an
    output overlaps something otherwise than in place nothing is done, and -1 are invalid.

    `collide` gives the velocities before and after, the closing speed and the changes along n; `valid` says which
    inputs obey the rules.
    """
    relation = overlap(columns, outputs)
    if relation < 0:
        return -1, -1
    width = LINE // outputs[0].itemsize
    head = lead(outputs, start)
    # In place the lines are in the cache already, and a streaming store would throw them out first.
    streaming = head >= 0 and outputs[0].nbytes >= STREAM_BYTES and relation == 0
    # Velocities from arrays fit the outputs; one that is a scalar may not. Then every step is looked at.
    beyond = _beyond(columns, outputs, scalars)
    usual = is_usual(columns)
    n_invalid, first_invalid = 0, -1
    k = start
    n = min(head if head > 0 else width, stop - start)
    while k < stop:
        values = load(columns, scalars, k, n, usual)
        signs = (values[0], values[1], values[-1])
        # Of a pair that is skipped the result does not tell whether its masses obey the rules.
        break_rules = approaching and any_lane(~valid(*values))
        before, after, closing, changes = collide(*values)
        if approaching:
            # Not `closing > 0`: NaN has to go on to the check.
            after = select_each(closing <= 0.0, before, after)
        # Only valid input gives changes that are finite, but for the sign of a mass or of e.
        if break_rules or beyond or any_lane(doubt(changes[0] + changes[1], outputs, signs)):
            is_first = n_invalid == 0
            after, bad, at = _carefully(collide, valid, columns, outputs, scalars, k, n, approaching, nan, is_first)
            if is_first:
                first_invalid = at
            n_invalid += bad
        store(outputs, k, n, after, streaming)
        k += n
        n = min(width, stop - k)
    return n_invalid, first_invalid


@rare
def _carefully(
    collide: Any,
    valid: Any,
    columns: Any,
    outputs: Any,
    scalars: Any,
    k: int,
    n: int,
    approaching: bool,
    nan: bool,
    is_first: bool,
) -> Any:
    """A step again, with the exact check: the velocities to store, how many pairs are invalid, the first (or -1).

    Again and out of line: to keep the step's inputs in registers for this cost the polar form 8 % of its speed.
    """
    out_of_line()
    values = load(columns, scalars, k, n, False)
    before, after, closing, _ = collide(*values)
    if approaching:
        after = select_each(closing <= 0.0, before, after)
    bad = leading(~(valid(*values) & all_finite(after, outputs)), n)
    n_bad, at = count(bad), -1
    if n_bad > 0:
        i = first(bad)
        at = k + i
        if is_first:
            for c in range(scalars.size):
                scalars[c] = get(values[c], i)
        after = select_each(bad, fill(before, math.nan) if nan else before, after)
    return after, n_bad, at


@rare
def _beyond(columns: Any, outputs: Any, scalars: Any) -> bool:
    out_of_line()
    for c in range(2, len(columns) - 1):
        if columns[c].size == 0 and not abs(scalars[c]) <= np.finfo(outputs[0].dtype).max:
            return True
    return False


@formula
def _valid_masses(m1: Any, m2: Any, restitution: Any) -> Any:
    """Two infinite masses pass: they give NaN where the pair collides, and may be skipped where it does not."""
    return (m1 >= 0.0) & (m2 >= 0.0) & (m1 + m2 > 0.0) & (restitution >= 0.0) & (restitution < math.inf)


@formula
def _collide_1d(m1: Any, m2: Any, v1: Any, v2: Any, restitution: Any) -> Any:
    after, closing, changes = scalar.on_line(m1, m2, v1, v2, restitution)
    return (v1, v2), after, closing, changes


@formula
def _valid_1d(m1: Any, m2: Any, v1: Any, v2: Any, restitution: Any) -> Any:
    return _valid_masses(m1, m2, restitution)


def _kernel_1d(  # type: ignore[no-untyped-def]  # compiled only
    m1, m2, v1, v2, e, u1, u2, scalars, start, stop, approaching, nan
):
    columns, outputs = (m1, m2, v1, v2, e), (u1, u2)
    return _loop(_collide_1d, _valid_1d, columns, outputs, scalars, start, stop, approaching, nan)


@formula
def _collide_2d(m1: Any, m2: Any, v1x: Any, v1y: Any, v2x: Any, v2y: Any, nx: Any, ny: Any, restitution: Any) -> Any:
    nx, ny, square = scalar.normal(nx, ny)
    after, closing, changes = scalar.in_plane(m1, m2, v1x, v1y, v2x, v2y, nx, ny, square, restitution)
    return (v1x, v1y, v2x, v2y), after, closing, changes


@formula
def _valid_2d(m1: Any, m2: Any, v1x: Any, v1y: Any, v2x: Any, v2y: Any, nx: Any, ny: Any, restitution: Any) -> Any:
    _, _, square = scalar.normal(nx, ny)
    return _valid_masses(m1, m2, restitution) & (square > 0.0) & (square < math.inf)


def _kernel_2d(  # type: ignore[no-untyped-def]  # compiled only
    m1, m2, v1x, v1y, v2x, v2y, nx, ny, e, u1x, u1y, u2x, u2y, scalars, start, stop, approaching, nan
):
    columns, outputs = (m1, m2, v1x, v1y, v2x, v2y, nx, ny, e), (u1x, u1y, u2x, u2y)
    return _loop(_collide_2d, _valid_2d, columns, outputs, scalars, start, stop, approaching, nan)


@formula
def _collide_polar(m1: Any, m2: Any, v1: Any, theta1: Any, v2: Any, theta2: Any, phi: Any, restitution: Any) -> Any:
    v1x, v1y, v2x, v2y, nx, ny = scalar.from_polar(v1, theta1, v2, theta2, phi)
    after, closing, changes = scalar.in_plane(m1, m2, v1x, v1y, v2x, v2y, nx, ny, 1.0, restitution)
    return (v1x, v1y, v2x, v2y), after, closing, changes


@formula
def _valid_polar(m1: Any, m2: Any, v1: Any, theta1: Any, v2: Any, theta2: Any, phi: Any, restitution: Any) -> Any:
    return _valid_masses(m1, m2, restitution)


def _kernel_polar(  # type: ignore[no-untyped-def]  # compiled only
    m1, m2, v1, theta1, v2, theta2, phi, e, u1x, u1y, u2x, u2y, scalars, start, stop, approaching, nan
):
    columns, outputs = (m1, m2, v1, theta1, v2, theta2, phi, e), (u1x, u1y, u2x, u2y)
    return _loop(_collide_polar, _valid_polar, columns, outputs, scalars, start, stop, approaching, nan)


class Form(NamedTuple):
    """A way to state a batch: its columns, its outputs, and the kernel for each storage dtype."""

    columns: tuple[str, ...]
    outputs: tuple[str, ...]
    kernels: dict[np.dtype[Any], Kernel]


def make_form(function: Callable[..., Any], names: tuple[str, ...], results: tuple[str, ...]) -> Form:
    """The form of a kernel whose arguments are the columns, the outputs and what `_loop` takes beyond them."""
    kernels = {}
    for storage in (types.float64, types.float32):
        column = types.Array(storage, 1, "C", readonly=True)  # takes writable arrays as well
        output = types.Array(storage, 1, "C")
        signature = types.UniTuple(types.int64, 2)(
            *[column] * len(names),
            *[output] * len(results),
            types.Array(types.float64, 1, "C"),
            types.int64,
            types.int64,
            types.boolean,
            types.boolean,
        )
        kernels[np.dtype(str(storage))] = Kernel(function, signature, f"{function.__name__}-{storage}")
    return Form(names, results, kernels)


_PLANE = ("u1x", "u1y", "u2x", "u2y")
LINE_FORM = make_form(_kernel_1d, ("m1", "m2", "v1", "v2", "restitution"), ("u1", "u2"))
CARTESIAN = make_form(_kernel_2d, ("m1", "m2", "v1x", "v1y", "v2x", "v2y", "nx", "ny", "restitution"), _PLANE)
POLAR = make_form(_kernel_polar, ("m1", "m2", "v1", "theta1", "v2", "theta2", "phi", "restitution"), _PLANE)
