"""Balls at the walls of a box that move outwards turn around: each wall is an immovable ball on a line with them.

Few balls of many touch a wall. So lanes look at all of them, for what is wrong as well, and mark the blocks in which
some bounce; the bounces themselves are taken one by one, in the order of the balls: once to see whether all have an
answer, and once more to write them.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NoReturn

import numpy as np
from numba import types

from .._compile.arrays import is_plain, overlap
from .._compile.elementwise import as_float64
from .._compile.kernel import Kernel
from .._compile.lanes import all_finite, any_lane, first, leading
from .._compile.memory import load, width_of
from .._compile.options import formula
from .._formulas.collision import collision, on_a_line
from .._formulas.collision import impulse as impulse_of
from .._pairs.arguments import share_memory
from .._typing import Array
from . import state

_BLOCK = 1 << 6  # balls that are marked together
# The numbers of a call: those in place of columns, the last of (x, y, radius) and of m and e; the place of each wall,
# NaN where there is none; the shortest side; and room for the sums of the impulses.
_RADIUS, _M, _E, _WALL, _SHORTEST, _SUM, _NUMBERS = 2, 3, 4, 5, 9, 10, 14
_LARGEST = float(np.finfo(np.float64).max)
# What the kernel says instead of the number of a ball that is at fault.
FINE, REFUSED = -1, -2


def _kernel_walls(  # type: ignore[no-untyped-def]  # compiled only
    x, y, radius, vx, vy, m, e, impulse, numbers, marks, look
):
    """How many bounces there are, and FINE; or the number of a ball at fault, or REFUSED, and then nothing is written.

    radius, m, e: one a ball, or empty. impulse: of four or none. `look`: whether velocities may share memory.
    """
    places, velocities, n_bounces = (x, y, radius), (vx, vy), 0
    if look and overlap(places, velocities, 1 if radius.size == 0 else 0) != 0:
        return n_bounces, REFUSED
    if look and overlap((m, e), velocities, (1 if m.size == 0 else 0) + (1 if e.size == 0 else 0)) != 0:
        return n_bounces, REFUSED
    size = numbers[_RADIUS]
    if radius.size == 0 and not ((0.0 <= size <= _LARGEST) and 2.0 * size <= numbers[_SHORTEST]):
        return n_bounces, REFUSED
    if not (_not_negative(m, numbers[_M], math.inf) and _not_negative(e, numbers[_E], _LARGEST)):
        return n_bounces, REFUSED
    for wall in range(impulse.size):
        numbers[_SUM + wall] = impulse[wall]
        if not abs(impulse[wall]) < math.inf:
            return n_bounces, REFUSED

    fault = _survey(places, velocities, numbers, marks)
    if fault == FINE:
        n_bounces, fault = _bounces(places, velocities, m, e, impulse, numbers, marks, False)
    if fault == FINE and n_bounces > 0:
        _bounces(places, velocities, m, e, impulse, numbers, marks, True)
        for wall in range(impulse.size):
            impulse[wall] = numbers[_SUM + wall]
    return n_bounces, fault


@formula
def _not_negative(values: Any, number: Any, most: Any) -> bool:
    """Whether all values are from 0 up to the most, or where there are none the number is."""
    wrong = 0 if values.size > 0 or 0.0 <= number <= most else 1
    for k in range(values.size):
        wrong += 0 if (values[k] >= 0.0) & (values[k] <= most) else 1
    return wrong == 0


@formula
def _survey(places: Any, velocities: Any, numbers: Any, marks: Any) -> Any:
    """Marks the blocks in which balls bounce; the first ball of which something is wrong, or FINE."""
    n, width = velocities[0].size, width_of(velocities)
    plain, plain_velocities = is_plain(places), is_plain(velocities)
    k = 0
    for block in range(marks.size):
        some = False
        stop = min(k + _BLOCK, n)
        while k < stop:
            taken = min(width, stop - k)
            x, y, radius = load(places, numbers, k, taken, plain, velocities)
            vx, vy = load(velocities, numbers, k, taken, plain_velocities, velocities)
            right = all_finite((x, y, radius), places) & all_finite((vx, vy), velocities)
            right = right & (radius >= 0.0) & (radius + radius <= numbers[_SHORTEST])
            wrong = leading(~right, taken)
            if any_lane(wrong):
                return k + first(wrong)
            some |= any_lane(leading(_meets(0, x, radius, vx, numbers) | _meets(1, y, radius, vy, numbers), taken))
            k += taken
        marks[block] = some
    return FINE


@formula
def _meets(axis: int, x: Any, radius: Any, v: Any, numbers: Any) -> Any:
    """Whether a ball touches a wall across this axis and moves towards it; never where there is none."""
    low, high = numbers[_WALL + 2 * axis], numbers[_WALL + 2 * axis + 1]
    return ((x - radius <= low) & (v < 0.0)) | ((x + radius >= high) & (v > 0.0))


@formula
def _bounces(
    places: Any, velocities: Any, m: Any, e: Any, impulse: Any, numbers: Any, marks: Any, write: bool
) -> tuple[int, int]:
    """How many bounces there are, and the first ball whose bounce has no answer, or FINE.

    `write`: writes the velocities, or else sums up the impulses.
    """
    x, y, radius = places
    n_bounces = 0
    for block in range(marks.size):
        if marks[block]:
            for k in range(block * _BLOCK, min((block + 1) * _BLOCK, x.size)):
                r = radius[k] if radius.size > 0 else numbers[_RADIUS]
                for axis in range(2):
                    v = as_float64(velocities[axis][k])
                    if not _meets(axis, (x, y)[axis][k], r, v, numbers):
                        continue
                    n_bounces += 1
                    mass = m[k] if m.size > 0 else numbers[_M]
                    pair = on_a_line(mass, math.inf, v, 0.0, e[k] if e.size > 0 else numbers[_E])
                    (u,), _, _, _ = collision(*pair)
                    if write:
                        velocities[axis][k] = u
                        continue
                    valid = (mass < math.inf) & all_finite((u,), velocities)
                    if impulse.size > 0:
                        wall = _SUM + 2 * axis + (1 if v > 0.0 else 0)
                        numbers[wall] += abs(impulse_of(*pair)[0])
                        valid &= numbers[wall] < math.inf
                    if not valid:
                        return n_bounces, k
    return n_bounces, FINE


def _kernel(place: Any, velocity: Any) -> Kernel:
    """For arrays of these dtypes."""
    places, velocities = types.Array(place, 1, "A", readonly=True), types.Array(velocity, 1, "A")
    values, impulse = types.Array(types.float64, 1, "A", readonly=True), types.Array(types.float64, 1, "A")
    own = types.Array(types.float64, 1, "C"), types.Array(types.uint8, 1, "C"), types.boolean
    signature = types.UniTuple(types.int64, 2)(*[places] * 3, *[velocities] * 2, *[values] * 2, impulse, *own)
    return Kernel(_kernel_walls, signature, f"_kernel_walls-{place}-{velocity}")


# By the dtype of the positions and the radii, and that of the velocities.
_FLOAT64, _FLOAT32 = np.dtype(np.float64), np.dtype(np.float32)
_KERNELS = {
    (_FLOAT64, _FLOAT64): _kernel(types.float64, types.float64),
    (_FLOAT64, _FLOAT32): _kernel(types.float64, types.float32),
    (_FLOAT32, _FLOAT32): _kernel(types.float32, types.float32),
}
_NUMBER_TYPES = float, int, np.float64
_NONE = {dtype: np.empty(0, dtype) for dtype in (_FLOAT64, _FLOAT32)}


def at_once(columns: tuple[Any, ...], vx: Any, vy: Any, box: Any, impulse: Any) -> int | None:
    """The bounces of arrays and numbers as they lie; None where there is anything else, or a fault.

    All that is asked here is whether these are arrays that compiled code knows. It looks itself at sizes and overlaps.
    """
    if type(box) is not tuple or len(box) != 2 or type(vx) is not np.ndarray or not vx.size:
        return None
    for array in (*columns[:2], vy):
        if type(array) is not np.ndarray:  # Numba asks of other objects at length
            return None
    for value in columns[2:]:
        if value.size != vx.size if type(value) is np.ndarray else type(value) not in _NUMBER_TYPES:
            return None
    for side in box:
        if side is not None and not (type(side) in _NUMBER_TYPES and state.SHORTEST <= side <= state.LONGEST):
            return None
    if impulse is not None:
        # Numba takes a byte-swapped array for a native one; of the others the kernel asks that itself.
        if type(impulse) is not np.ndarray or impulse.size != 4 or impulse.dtype != _FLOAT64:
            return None
        if np.may_share_memory(impulse, vx) or np.may_share_memory(impulse, vy):
            return None
    try:
        # Numba refuses other dtypes and dimensions, and to write to what is read-only.
        n_bounces, fault = bounce(columns, vx, vy, (box[0] or 0.0, box[1] or 0.0), impulse, look=True)
    except (KeyError, OverflowError, TypeError):
        return None
    return n_bounces if fault == FINE else None


def bounce(
    columns: Sequence[Any],
    vx: Array,
    vy: Array,
    sides: tuple[float, float],
    impulse: Array | None = None,
    look: bool = False,
) -> tuple[int, int]:
    """See _kernel_walls. The columns are x, y, radius, m and e, the last three arrays or numbers.

    sides: 0 where there are no walls.
    """
    x, y, *rest = columns
    numbers, arrays = np.zeros(_NUMBERS), [_NONE[x.dtype], _NONE[_FLOAT64], _NONE[_FLOAT64]]
    for c, value in enumerate(rest):
        if type(value) is np.ndarray:
            arrays[c] = value
        else:
            numbers[_RADIUS + c] = value
    for axis, side in enumerate(sides):
        numbers[_WALL + 2 * axis], numbers[_WALL + 2 * axis + 1] = (0.0, side) if side else (math.nan, math.nan)
    numbers[_SHORTEST] = min(sides[0] or math.inf, sides[1] or math.inf)
    marks = np.empty(-(-x.size // _BLOCK), np.uint8)
    radius, m, e = arrays
    impulse = _NONE[_FLOAT64] if impulse is None else impulse
    kernel = _KERNELS[x.dtype, vx.dtype].compiled
    return kernel(x, y, radius, vx, vy, m, e, impulse, numbers, marks, look)  # type: ignore[no-any-return]


def taken(columns: dict[str, Array], outputs: dict[str, Array]) -> list[Any]:
    """x, y, radius, m and restitution as `bounce` takes them: numbers, and arrays as they lie where they can."""
    numbers = {name: float(a[0]) for name, a in columns.items() if a.size == 1 and name not in ("x", "y")}
    arrays = {name: a for name, a in columns.items() if name not in numbers}
    narrow = all(
        arrays[name].dtype == outputs["vx"].dtype == np.float32 for name in ("x", "y", "radius") if name in arrays
    )
    for name, a in arrays.items():
        a = state.aligned(np.asarray(a, np.float32 if narrow and name in ("x", "y", "radius") else np.float64))
        arrays[name] = a.copy() if any(share_memory(a, u) for u in outputs.values()) else a
    return [(arrays | numbers)[name] for name in columns]


def raise_for(k: int, columns: dict[str, Array], outputs: dict[str, Array], sides: tuple[float, float]) -> NoReturn:
    """What is wrong, in words: a value, or else the bounce of ball k."""
    for name in ("x", "y", "vx", "vy", "impulse"):
        if name in columns or name in outputs:
            state.bounds(name, columns[name] if name in columns else outputs[name])
    diameter = 2.0 * state.bounds_from_zero("radius", columns["radius"])[1]
    for axis, side in enumerate(sides):
        if side and side < diameter:
            raise ValueError(f"box[{axis}] = {side}: must be at least {diameter}, the diameter of the largest ball")
    m, e = columns["m"], columns["restitution"]
    if not (m >= 0.0).all():
        raise ValueError(f"m{state.first(m, ~(m >= 0.0))}: a mass must be >= 0")
    state.bounds_from_zero("restitution", e)
    mass, vx, vy = m[k % m.size], outputs["vx"], outputs["vy"]
    if mass == math.inf:
        place = f"[{k}]" if m.size > 1 else ""
        raise ValueError(f"m{place} = inf: an immovable ball cannot bounce, and ball {k} is at a wall")
    raise ValueError(
        f"vx[{k}] = {vx[k]}, vy[{k}] = {vy[k]}: the bounce of this ball, or the impulse of a wall, is too large for "
        f"{vx.dtype} with m = {mass}, restitution = {e[k % e.size]}"
    )
