"""The forms of a batch: their columns and outputs, the step that calls the formula of scalar.py, and what is valid.

In every form the masses are the first two columns and the restitution is the last.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numba import types

from .. import scalar
from .._compile.kernel import Kernel
from .._compile.lanes import all_finite, fill
from .._compile.options import formula
from .loop import loop


@formula
def _valid_masses(values: Any, results: Any, outputs: Any) -> Any:
    """Two infinite masses pass: they give NaN where the pair collides, and may be skipped where it does not."""
    m1, m2, e = values[0], values[1], values[-1]
    return (m1 >= 0.0) & (m2 >= 0.0) & (m1 + m2 > 0.0) & (e >= 0.0) & (e < math.inf) & all_finite(results, outputs)


@formula
def collide_1d(m1: Any, m2: Any, v1: Any, v2: Any, e: Any) -> Any:
    after, closing, (_, _, size) = scalar.on_line(m1, m2, v1, v2, e)
    return (v1, v2), after, closing, size, (m1, m2, e)


def _kernel_1d(  # type: ignore[no-untyped-def]  # compiled only
    m1, m2, v1, v2, e, u1, u2, scalars, start, stop, approaching, nan
):
    columns, outputs = (m1, m2, v1, v2, e), (u1, u2)
    return loop(collide_1d, _valid_masses, columns, outputs, scalars, start, stop, approaching, nan)


@formula
def collide_2d(m1: Any, m2: Any, v1x: Any, v1y: Any, v2x: Any, v2y: Any, nx: Any, ny: Any, e: Any) -> Any:
    nx, ny, square, low = scalar.normal(nx, ny)
    after, closing, (_, _, size) = scalar.in_plane(m1, m2, v1x, v1y, v2x, v2y, nx, ny, square, low, e)
    return (v1x, v1y, v2x, v2y), after, closing, size, (m1, m2, e)


@formula
def valid_2d(values: Any, results: Any, outputs: Any) -> Any:
    _, _, square, _ = scalar.normal(values[6], values[7])
    return _valid_masses(values, results, outputs) & (square > 0.0) & (square < math.inf)


def _kernel_2d(  # type: ignore[no-untyped-def]  # compiled only
    m1, m2, v1x, v1y, v2x, v2y, nx, ny, e, u1x, u1y, u2x, u2y, scalars, start, stop, approaching, nan
):
    columns, outputs = (m1, m2, v1x, v1y, v2x, v2y, nx, ny, e), (u1x, u1y, u2x, u2y)
    return loop(collide_2d, valid_2d, columns, outputs, scalars, start, stop, approaching, nan)


@formula
def collide_polar(m1: Any, m2: Any, v1: Any, theta1: Any, v2: Any, theta2: Any, phi: Any, e: Any) -> Any:
    v1x, v1y, v2x, v2y, nx, ny = scalar.from_polar(v1, theta1, v2, theta2, phi)
    after, closing, (_, _, size) = scalar.in_plane(m1, m2, v1x, v1y, v2x, v2y, nx, ny, 1.0, None, e)
    return (v1x, v1y, v2x, v2y), after, closing, size, (m1, m2, e)


def _kernel_polar(  # type: ignore[no-untyped-def]  # compiled only
    m1, m2, v1, theta1, v2, theta2, phi, e, u1x, u1y, u2x, u2y, scalars, start, stop, approaching, nan
):
    columns, outputs = (m1, m2, v1, theta1, v2, theta2, phi, e), (u1x, u1y, u2x, u2y)
    return loop(collide_polar, _valid_masses, columns, outputs, scalars, start, stop, approaching, nan)


@formula
def _impulse(m1: Any, m2: Any, v1x: Any, v1y: Any, v2x: Any, v2y: Any, nx: Any, ny: Any, e: Any) -> Any:
    p, closing = scalar.impulse(m1, m2, v1x, v1y, v2x, v2y, nx, ny, e)
    return fill((p,), 0.0), (p,), closing, p, (m1, m2, e)


def _kernel_impulse(  # type: ignore[no-untyped-def]  # compiled only
    m1, m2, v1x, v1y, v2x, v2y, nx, ny, e, p, scalars, start, stop, approaching, nan
):
    columns = (m1, m2, v1x, v1y, v2x, v2y, nx, ny, e)
    return loop(_impulse, valid_2d, columns, (p,), scalars, start, stop, approaching, nan)


@formula
def _impact(dx: Any, dy: Any, dvx: Any, dvy: Any, distance: Any) -> Any:
    t, size = scalar.impact(dx, dy, dvx, dvy, distance)
    return (t,), (t,), t, size, (distance,)


@formula
def _valid_impact(values: Any, results: Any, outputs: Any) -> Any:
    """A time that is infinite is good; one that is too large for the outputs is not, and NaN in float64's place."""
    dx, dy, dvx, dvy, distance = values
    finite = (abs(dx) < math.inf) & (abs(dy) < math.inf) & (abs(dvx) < math.inf) & (abs(dvy) < math.inf)
    told = (results[0] == math.inf) | all_finite(results, outputs)
    return finite & (distance >= 0.0) & (distance < math.inf) & told


def _kernel_impact(  # type: ignore[no-untyped-def]  # compiled only
    dx, dy, dvx, dvy, distance, t, scalars, start, stop, approaching, nan
):
    return loop(_impact, _valid_impact, (dx, dy, dvx, dvy, distance), (t,), scalars, start, stop, approaching, nan)


class Form(NamedTuple):
    """A way to state a batch: its columns, its outputs, and the kernel for each storage dtype."""

    columns: tuple[str, ...]
    outputs: tuple[str, ...]
    kernels: dict[np.dtype[Any], Kernel]
    rules: dict[str, bool]  # for each `invalid` that it knows, whether an invalid pair gets NaN


_RULES = {"raise": False, "keep": False, "nan": True}


def make_form(
    function: Callable[..., Any], names: tuple[str, ...], results: tuple[str, ...], rules: dict[str, bool] = _RULES
) -> Form:
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
    return Form(names, results, kernels, rules)


_PLANE = ("u1x", "u1y", "u2x", "u2y")
FORM_1D = make_form(_kernel_1d, ("m1", "m2", "v1", "v2", "restitution"), ("u1", "u2"))
FORM_2D = make_form(_kernel_2d, ("m1", "m2", "v1x", "v1y", "v2x", "v2y", "nx", "ny", "restitution"), _PLANE)
FORM_POLAR = make_form(_kernel_polar, ("m1", "m2", "v1", "theta1", "v2", "theta2", "phi", "restitution"), _PLANE)
IMPULSE = make_form(_kernel_impulse, FORM_2D.columns, ("impulse",))
IMPACT = make_form(_kernel_impact, ("dx", "dy", "dvx", "dvy", "distance"), ("t",), {"raise": True, "nan": True})
