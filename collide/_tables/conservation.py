"""By how much collisions change total momentum and energy, summed in twice the precision: what shows are the results'
rounding errors, not those of the sums.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numba import types

from .._compile.arrays import is_plain
from .._compile.components import each, halves
from .._compile.elementwise import select
from .._compile.kernel import Kernel, spread
from .._compile.lanes import count, fill, get, leading
from .._compile.memory import load
from .._compile.options import formula
from .._formulas.exact import two_product, two_sum
from .._pairs.arguments import as_array
from .._pairs.forms import COLLISIONS, Form
from .._system.memory import CACHE_LINE
from .._typing import Array

_WIDTH = CACHE_LINE // 8
# The sums along an axis, those of changes in two parts.
_MOMENTUM, _ENERGY, _SIZE_OF_MOMENTUM, _SIZE_OF_ENERGY, _N_SUMS = slice(0, 2), slice(2, 4), 4, 5, 6
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
def _changed(sums: Any, m1: Any, m2: Any, v1: Any, v2: Any, u1: Any, u2: Any) -> Any:
    """Adds momentum and energy after, along one axis, subtracts those before, and adds m|v| and m v v to the sizes that
    the changes are relative to.
    """
    momentum, energy, size, size_of_energy = sums
    momentum, energy = _moved(momentum, energy, m1, u1)
    momentum, energy = _moved(momentum, energy, m2, u2)
    momentum, energy = _moved(momentum, energy, -m1, v1)
    momentum, energy = _moved(momentum, energy, -m2, v2)
    p1, p2 = m1 * abs(v1), m2 * abs(v2)
    return momentum, energy, size + (p1 + p2), size_of_energy + (p1 * abs(v1) + p2 * abs(v2))


@formula
def _worth(m1: Any, m2: Any, before: Any, after: Any) -> Any:
    """More than all energies of the pair; infinite beside an immovable ball, NaN where a velocity is."""
    m, worth = abs(m1) + abs(m2), 0.0 * m1
    for c in range(len(before)):
        v, u = abs(before[c]), abs(after[c])
        worth = worth + (m * v * v + m * u * u)
    return worth


@formula
def _none(zero: Any) -> Any:
    """The sums along an axis before the first pair."""
    return (zero, zero), (zero, zero), zero, zero


@formula
def _changes(step_of: Any, columns: Any, outputs: Any, scalars: Any, sums: Any) -> int:
    """The sums over all pairs that count, axis by axis and lane by lane; returns how many they are."""
    plain, size = is_plain(columns), outputs[0].size
    nothing = fill(load(outputs, scalars, 0, 0, True, outputs), 0.0)
    zero = nothing[0]
    totals = each(_none, halves(nothing)[0])
    n_counted = 0
    for k in range(0, size, _WIDTH):
        n = min(_WIDTH, size - k)
        values = load(columns, scalars, k, n, plain, outputs)
        before, after = step_of(values).before, load(outputs, scalars, k, n, True, outputs)
        m1, m2 = values[0], values[1]
        counted = leading((_worth(m1, m2, before, after) < _MOST) & (m1 >= 0.0) & (m2 >= 0.0), n)
        n_counted += count(counted)
        m1, m2 = each(select, counted, (m1, m2), (zero, zero))
        v1, v2 = halves(each(select, counted, before, nothing))
        u1, u2 = halves(each(select, counted, after, nothing))
        totals = each(_changed, totals, m1, m2, v1, v2, u1, u2)
    for axis in range(len(totals)):
        momentum, energy, size_of_momentum, size_of_energy = totals[axis]
        kept = (*momentum, *energy, size_of_momentum, size_of_energy)
        for s in range(len(kept)):
            for lane in range(_WIDTH):
                sums[axis, s, lane] = get(kept[s], lane)
    return n_counted


def _kernel(form: Form) -> Kernel:
    n_columns, n_outputs = len(form.columns), len(form.outputs)
    column = types.Array(types.float64, 1, "C", readonly=True)
    scalars, sums = types.Array(types.float64, 1, "C"), types.Array(types.float64, 3, "C")
    signature = types.int64(*[column] * (n_columns + n_outputs), scalars, sums)
    name = f"{form.name}_changes"
    return Kernel(spread(name, _changes, (n_columns, n_outputs, 0, 0), form.step), signature, name)


_KERNELS = {name: _kernel(form) for name, form in COLLISIONS.items()}


class Conservation:
    """The relative change of total momentum and energy over any number of batches of a form.

    Pairs with an immovable ball or a negative mass, with a velocity that is not finite, or with an energy beyond 1e290
    are not counted.
    """

    def __init__(self) -> None:
        self.n_pairs = self.n_counted = 0
        # The changes and what they are relative to; of momentum along each axis, of energy along all.
        self._momentum: list[tuple[float, float]] = []
        self._energy = 0.0, 0.0

    def add(self, form: Form, inputs: Sequence[Any], outputs: Sequence[Array]) -> None:
        """The pairs of one batch: the columns, each a number or an array of the outputs' shape, and the results."""
        arrays = [as_array(name, value) for name, value in zip(form.columns, inputs, strict=True)]
        scalars = np.array([float(a.item()) if a.size == 1 else math.nan for a in arrays])
        columns = [np.empty(0) if a.size == 1 else _float64(a) for a in arrays]
        results = [_float64(u) for u in outputs]
        sums = np.zeros((len(results) // 2, _N_SUMS, _WIDTH))
        if results[0].size:
            self.n_counted += _KERNELS[form.name].compiled(*columns, *results, scalars, sums)
        self.n_pairs += results[0].size
        axes = [(sums[axis, _MOMENTUM], sums[axis, _SIZE_OF_MOMENTUM]) for axis in range(len(sums))]
        before = self._momentum or [(0.0, 0.0)] * len(axes)
        self._momentum = [_with(*both) for both in zip(before, axes, strict=True)]
        self._energy = _with(self._energy, (sums[:, _ENERGY], sums[:, _SIZE_OF_ENERGY]))

    @property
    def momentum(self) -> float:
        """The change of total momentum, relative to the sum of its absolute values; of the components the largest."""
        return max((_ratio(change, size) for change, size in self._momentum), key=abs, default=0.0)

    @property
    def energy(self) -> float:
        """The relative change of total energy: also what is lost by a restitution below 1."""
        return _ratio(*self._energy)


def _with(before: tuple[float, float], sums: tuple[Array, Array]) -> tuple[float, float]:
    """A change and its size, and what further lanes of both add to them."""
    change, size = (math.fsum((total, *part.ravel())) for total, part in zip(before, sums, strict=True))
    return change, size


def _ratio(change: float, size: float) -> float:
    return change / size if size else 0.0


def _float64(array: Array) -> Array:
    return np.ascontiguousarray(array, np.float64).reshape(-1)
