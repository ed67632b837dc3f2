"""The forms of a batch: how the columns and results of each are called, its step, and the rules that it obeys.

All that there is to say of a form is its entry in the table at the end. From it follow the kernels of both storages,
the yardstick of the memory limit, the changes of momentum and energy, the columns of tables, Dask and the command line.
What a new form needs beside it: how it states a pair, in _formulas/collision.py (three dimensions: a product of vectors
in exact.py as well), its public functions in scalar.py, batch.py and dask.py, what errors.py says of its columns, and
its name in the tests' lists.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np
from numba import types

from .._compile.kernel import Kernel, spread
from .._compile.lanes import all_finite, fill
from .._compile.options import formula
from .._formulas.collision import collision, impulse, in_polar_form, in_the_plane, on_a_line
from .._formulas.impact import impact
from .loop import Step, loop


class Form(NamedTuple):
    """A way to state a batch. In every form of a collision the masses come first and the restitution last."""

    name: str
    columns: tuple[str, ...]
    outputs: tuple[str, ...]
    step: Callable[..., Any]
    kernels: Mapping[str, Kernel]  # by the characters of the dtypes of columns and of results: dd, ff, fd
    invalid: Mapping[str, bool]  # the values of this option that it knows, and whether an invalid pair gets NaN
    nan: bool  # the same of "raise", which every call asks for that says nothing


def _colliding(pair: Callable[..., Any]) -> Callable[..., Any]:
    """The step that gives velocities; `pair` makes of the columns what the formula of a collision takes."""

    @formula
    def step(values: Any) -> Step:
        m1, m2, v1, v2, n, square, low, e = pair(*values)
        u1, u2, closing, change = collision(m1, m2, v1, v2, n, square, low, e)
        return Step((*v1, *v2), (*u1, *u2), closing, change, (m1, m2, e), (square,))

    return step


def _transferring(pair: Callable[..., Any]) -> Callable[..., Any]:
    """The step that gives the impulse."""

    @formula
    def step(values: Any) -> Step:
        m1, m2, v1, v2, n, square, low, e = pair(*values)
        p, closing = impulse(m1, m2, v1, v2, n, square, low, e)
        return Step(fill((p,), 0.0), (p,), closing, p, (m1, m2, e), (square,))

    return step


@formula
def obeys_rules(step: Any, results: Any, outputs: Any) -> Any:
    """Lane by lane, whether a pair is valid.

    It is asked only of steps that `doubt` picks out, and of all under approaching_only: a new rule must show in the
    step's size or signs as well. Two infinite masses pass: they give NaN where the pair collides, and may be skipped
    where it does not.
    """
    m1, m2, e = step.signs
    (square,) = step.others
    masses = (m1 >= 0.0) & (m2 >= 0.0) & (m1 + m2 > 0.0)
    return masses & (e >= 0.0) & (e < math.inf) & (square > 0.0) & (square < math.inf) & all_finite(results, outputs)


@formula
def _impact(values: Any) -> Step:
    dx, dy, dvx, dvy, distance = values
    t, size = impact((dx, dy), (dvx, dvy), distance)
    # t as closing speed: nobody asks for it, as a time of impact knows no approaching_only.
    return Step((t,), (t,), t, size, (distance,), (dx, dy, dvx, dvy))


@formula
def _obeys_rules_of_impact(step: Any, results: Any, outputs: Any) -> Any:
    """An infinite time is valid: they never meet. One too large for the outputs is not; if for float64, it is NaN."""
    (distance,), (dx, dy, dvx, dvy) = step.signs, step.others
    finite = (abs(dx) < math.inf) & (abs(dy) < math.inf) & (abs(dvx) < math.inf) & (abs(dvy) < math.inf)
    told = (results[0] == math.inf) | all_finite(results, outputs)
    return finite & (distance >= 0.0) & (distance < math.inf) & told


def batch_kernels(
    name: str, n_columns: int, n_outputs: int, body: Callable[..., Any], *before: Any
) -> dict[str, Kernel]:
    """For each storage body(*before, columns, outputs, scalars, n_numbers, n, seat, approaching, nan)."""
    function, kernels = spread(name, body, (n_columns, n_outputs, 0, 0, 0, 0, 0, 0), *before), {}
    for given, result in _STORAGES:
        column = types.Array(given, 1, "A", readonly=True)  # takes writable arrays as well
        output, scalars = types.Array(result, 1, "A"), types.Array(types.float64, 1, "C")
        rest = scalars, types.int64, types.int64, types.int64, types.boolean, types.boolean
        signature = types.int64(*[column] * n_columns, *[output] * n_outputs, *rest)
        storage = "".join(np.dtype(str(kind)).char for kind in (given, result))
        kernels[storage] = Kernel(function, signature, f"{name}-{storage}")
    return kernels


# Of the columns and of the results; the last where a NumPy scalar beside float32 arrays makes these float64.
_STORAGES = (
    (types.float64, types.float64),
    (types.float32, types.float32),
    (types.float32, types.float64),
)
_INVALID = {"raise": False, "keep": False, "nan": True}


def _form(
    name: str,
    columns: str,
    outputs: str,
    step: Callable[..., Any],
    rule: Callable[..., Any] = obeys_rules,
    invalid: Mapping[str, bool] = _INVALID,
) -> Form:
    names, results = tuple(columns.split()), tuple(outputs.split())
    kernels = batch_kernels(name, len(names), len(results), loop, step, rule)
    return Form(name, names, results, step, kernels, invalid, invalid["raise"])


_PLANE, _VECTORS = "m1 m2 v1x v1y v2x v2y nx ny restitution", "u1x u1y u2x u2y"
FORM_1D = _form("1d", "m1 m2 v1 v2 restitution", "u1 u2", _colliding(on_a_line))
FORM_2D = _form("2d", _PLANE, _VECTORS, _colliding(in_the_plane))
FORM_POLAR = _form("polar", "m1 m2 v1 theta1 v2 theta2 phi restitution", _VECTORS, _colliding(in_polar_form))
IMPULSE = _form("impulse", _PLANE, "impulse", _transferring(in_the_plane))
IMPACT = _form("impact", "dx dy dvx dvy distance", "t", _impact, _obeys_rules_of_impact, {"raise": True, "nan": True})

COLLISIONS = {form.name: form for form in (FORM_1D, FORM_2D, FORM_POLAR)}  # velocities after: what a table may hold
FORMS = {**COLLISIONS, **{form.name: form for form in (IMPULSE, IMPACT)}}
