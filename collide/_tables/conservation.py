"""By how much collisions change total momentum and energy, summed in twice the precision: what shows are the results'
rounding errors, not those of the sums.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numba import types

from .._compile.kernel import Kernel
from .._compile.lanes import LINE, count, fill, get, leading, select_each
from .._compile.memory import is_usual, load
from .._compile.options import formula
from .._formulas.exact import two_product, two_sum
from .._pairs.arguments import as_array
from .._pairs.forms import FORM_1D, FORM_2D, FORM_POLAR, Form, collide_1d, collide_2d, collide_polar

Array = np.ndarray[Any, np.dtype[Any]]

_WIDTH = LINE // 8
_N_SUMS = 9
_MOST = 1e290  # of a pair's energy: a million million of them are still a number


@formula
def _moved(momentum: Any, energy: Any, m: Any, v: Any) -> Any:
    """m v and m v v, added to sums and their rounding errors (the Dot2 of Ogita, Rump and Oishi)."""
    p, e = two_product(m, v)
    q, f = two_product(p, v)
    total, g = two_sum(momentum[0], p)
    momentum = total, momentum[1] + (e + g)
    total, g = two_sum(energy[0], q)
    energy = total, energy[1] + ((f + e * v) + g)
    return momentum, energy


@formula
def _axis(momentum: Any, energy: Any, m1: Any, m2: Any, v1: Any, v2: Any, u1: Any, u2: Any) -> Any:
    """Adds what is there after the collision and takes off what was there before it, along one axis."""
    momentum, energy = _moved(momentum, energy, m1, u1)
    momentum, energy = _moved(momentum, energy, m2, u2)
    momentum, energy = _moved(momentum, energy, -m1, v1)
    return _moved(momentum, energy, -m2, v2)


@formula
def _sizes(momentum: Any, energy: Any, m1: Any, m2: Any, v1: Any, v2: Any) -> Any:
    """What the changes are relative to: the sums of m |v| and of m v v."""
    p1, p2 = m1 * abs(v1), m2 * abs(v2)
    return momentum + (p1 + p2), energy + (p1 * abs(v1) + p2 * abs(v2))


@formula
def _worth(m1: Any, m2: Any, before: Any, after: Any) -> Any:
    """More than all energies of the pair; infinite beside an immovable ball, NaN where a velocity is."""
    m, worth = abs(m1) + abs(m2), 0.0 * m1
    for c in range(len(before)):
        v, u = abs(before[c]), abs(after[c])
        worth = worth + (m * v * v + m * u * u)
    return worth


@formula
def _changes(collide: Any, columns: Any, outputs: Any, scalars: Any, sums: Any) -> int:
    """The sums over all pairs that count, lane by lane; returns how many they are."""
    usual, size = is_usual(columns), outputs[0].size
    nothing = fill(load(outputs, scalars, 0, 0, True), 0.0)
    zero = nothing[0]
    x, y, energy = (zero, zero), (zero, zero), (zero, zero)
    size_x, size_y, size_energy = zero, zero, zero
    n_counted = 0
    for k in range(0, size, _WIDTH):
        n = min(_WIDTH, size - k)
        values = load(columns, scalars, k, n, usual)
        before, _, _, _, _ = collide(*values)
        after = load(outputs, scalars, k, n, True)
        m1, m2 = values[0], values[1]
        counted = leading((_worth(m1, m2, before, after) < _MOST) & (m1 >= 0.0) & (m2 >= 0.0), n)
        n_counted += count(counted)
        m1, m2 = select_each(counted, (m1, m2), (zero, zero))
        v, u = select_each(counted, before, nothing), select_each(counted, after, nothing)
        second = len(v) // 2  # ball 2's first component
        x, energy = _axis(x, energy, m1, m2, v[0], v[second], u[0], u[second])
        size_x, size_energy = _sizes(size_x, size_energy, m1, m2, v[0], v[second])
        if second > 1:  # not v[1] and v[3]: this compiles on a line as well
            y, energy = _axis(y, energy, m1, m2, v[second - 1], v[-1], u[second - 1], u[-1])
            size_y, size_energy = _sizes(size_y, size_energy, m1, m2, v[second - 1], v[-1])
    kept = x[0], x[1], size_x, y[0], y[1], size_y, energy[0], energy[1], size_energy
    for s in range(_N_SUMS):
        for lane in range(_WIDTH):
            sums[s, lane] = get(kept[s], lane)
    return n_counted


def _changes_1d(m1, m2, v1, v2, e, u1, u2, scalars, sums):  # type: ignore[no-untyped-def]  # compiled only
    return _changes(collide_1d, (m1, m2, v1, v2, e), (u1, u2), scalars, sums)


def _changes_2d(  # type: ignore[no-untyped-def]  # compiled only
    m1, m2, v1x, v1y, v2x, v2y, nx, ny, e, u1x, u1y, u2x, u2y, scalars, sums
):
    columns = m1, m2, v1x, v1y, v2x, v2y, nx, ny, e
    return _changes(collide_2d, columns, (u1x, u1y, u2x, u2y), scalars, sums)


def _changes_polar(  # type: ignore[no-untyped-def]  # compiled only
    m1, m2, v1, theta1, v2, theta2, phi, e, u1x, u1y, u2x, u2y, scalars, sums
):
    columns = m1, m2, v1, theta1, v2, theta2, phi, e
    return _changes(collide_polar, columns, (u1x, u1y, u2x, u2y), scalars, sums)


def _kernel(form: Form, function: Any) -> Kernel:
    column = types.Array(types.float64, 1, "C", readonly=True)
    sums = types.Array(types.float64, 2, "C")
    columns = [column] * (len(form.columns) + len(form.outputs))
    signature = types.int64(*columns, types.Array(types.float64, 1, "C"), sums)
    return Kernel(function, signature, function.__name__)


_KERNELS = {
    form.columns: _kernel(form, function)
    for form, function in ((FORM_1D, _changes_1d), (FORM_2D, _changes_2d), (FORM_POLAR, _changes_polar))
}


class Conservation:
    """The relative change of total momentum and energy over any number of batches.

    Pairs with an immovable ball or a negative mass, with a velocity that is not finite, or with an energy beyond 1e290
    are not counted.
    """

    def __init__(self) -> None:
        self.n_pairs = self.n_counted = 0
        self._sums = [0.0] * _N_SUMS

    def add(self, form: Form, inputs: Sequence[Any], outputs: Sequence[Array]) -> None:
        """The pairs of one batch: the columns, each a number or an array of the outputs' shape, and the results."""
        arrays = [as_array(name, value) for name, value in zip(form.columns, inputs, strict=True)]
        scalars = np.array([float(a.item()) if a.size == 1 else math.nan for a in arrays])
        columns = [np.empty(0) if a.size == 1 else _float64(a) for a in arrays]
        results = [_float64(u) for u in outputs]
        sums = np.zeros((_N_SUMS, _WIDTH))
        if results[0].size:
            self.n_counted += _KERNELS[form.columns].compiled(*columns, *results, scalars, sums)
        self.n_pairs += results[0].size
        self._sums = [math.fsum((before, *lanes)) for before, lanes in zip(self._sums, sums.tolist(), strict=True)]

    @property
    def momentum(self) -> float:
        """The change of total momentum, relative to the sum of its absolute values; of two components the larger."""
        x, x_low, size_x, y, y_low, size_y = self._sums[:6]
        return max(_ratio(x + x_low, size_x), _ratio(y + y_low, size_y), key=abs)

    @property
    def energy(self) -> float:
        """The relative change of total energy: also what is lost by a restitution below 1."""
        change, low, size = self._sums[6:]
        return _ratio(change + low, size)


def _ratio(change: float, size: float) -> float:
    return change / size if size else 0.0


def _float64(array: Array) -> Array:
    return np.ascontiguousarray(array, np.float64).reshape(-1)
