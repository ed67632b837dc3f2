"""The forms of a batch: how the columns and results of each are called, its step, and the rules that it obeys.

All that there is to say of a form is its entry in the table at the end. From it follow the kernels of both storages,
the yardstick of the memory limit, the changes of momentum and energy, the columns of tables, Dask and the command line.
What a new form needs beside it: how it states a pair, in _formulas/collision.py, its public functions in scalar.py,
batch.py and dask.py, what errors.py says of its columns, and its name in the tests' lists.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from operator import mul
from typing import Any, NamedTuple

import numpy as np
from numba import types

from .._compile.components import each, halves
from .._compile.kernel import Kernel, spread
from .._compile.lanes import all_finite, fill
from .._compile.options import formula
from .._formulas.collision import collision, impulse, in_polar_form, in_space, in_the_plane, on_a_line
from .._formulas.exact import dot
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
    d, w = halves(values[:-1])
    t, size = impact(d, w, values[-1])
    # t as closing speed: nobody asks for it, as a time of impact knows no approaching_only.
    return Step((t,), (t,), t, size, (values[-1],), (d, w))


@formula
def _obeys_rules_of_impact(step: Any, results: Any, outputs: Any) -> Any:
    """An infinite time is valid: they never meet. One too large for the outputs is not; if for float64, it is NaN."""
    (distance,), (d, w) = step.signs, step.others
    nothing = dot(each(mul, 0.0, d), each(mul, 0.0, w))  # NaN where one of them is not finite
    told = (results[0] == math.inf) | all_finite(results, outputs)
    return (nothing == 0.0) & (distance >= 0.0) & (distance < math.inf) & told


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


_PLANE, _IN_PLANE = "m1 m2 v1x v1y v2x v2y nx ny restitution", "u1x u1y u2x u2y"
_SPACE = "m1 m2 v1x v1y v1z v2x v2y v2z nx ny nz restitution"
_TIMES = {"raise": True, "nan": True}
FORM_1D = _form("1d", "m1 m2 v1 v2 restitution", "u1 u2", _colliding(on_a_line))
FORM_2D = _form("2d", _PLANE, _IN_PLANE, _colliding(in_the_plane))
FORM_3D = _form("3d", _SPACE, "u1x u1y u1z u2x u2y u2z", _colliding(in_space))
FORM_POLAR = _form("polar", "m1 m2 v1 theta1 v2 theta2 phi restitution", _IN_PLANE, _colliding(in_polar_form))
IMPULSE_2D = _form("impulse_2d", _PLANE, "impulse", _transferring(in_the_plane))
IMPULSE_3D = _form("impulse_3d", _SPACE, "impulse", _transferring(in_space))
IMPACT = _form("impact", "dx dy dvx dvy distance", "t", _impact, _obeys_rules_of_impact, _TIMES)
IMPACT_3D = _form("impact_3d", "dx dy dz dvx dvy dvz distance", "t", _impact, _obeys_rules_of_impact, _TIMES)

# Velocities after, which is what a table may hold; and all.
COLLISIONS = {form.name: form for form in (FORM_1D, FORM_2D, FORM_3D, FORM_POLAR)}
FORMS = {**COLLISIONS, **{form.name: form for form in (IMPULSE_2D, IMPULSE_3D, IMPACT, IMPACT_3D)}}
