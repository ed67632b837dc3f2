"""What the functions of a ball state ask of their arguments, and say of wrong ones."""

from __future__ import annotations

import reprlib
from collections.abc import Collection, Mapping, Sequence
from typing import Any, NoReturn

import numpy as np
from numba import types
from numpy.ma import MaskedArray
from numpy.typing import ArrayLike

from .._compile.elementwise import select
from .._compile.gather import WINDOW, window
from .._compile.kernel import Kernel
from .._compile.lanes import get
from .._pairs.arguments import as_array
from .._typing import Array

# Beyond these, squares of distances leave the range of float64.
SHORTEST, LONGEST = 1e-150, 1e150
_FLOATS = np.dtype(np.float64), np.dtype(np.float32)


def columns(x: ArrayLike, y: ArrayLike) -> tuple[Array, Array]:
    """The positions, of equal length."""
    x, y = as_they_lie(x, y)
    return aligned(np.ascontiguousarray(x, np.float64)), aligned(np.ascontiguousarray(y, np.float64))


def as_they_lie(x: ArrayLike, y: ArrayLike) -> tuple[Array, Array]:
    """The same, of any dtype and with gaps."""
    x, y = as_array("x", x), as_array("y", y)
    for name, array in (("x", x), ("y", y)):
        if array.ndim != 1:
            raise ValueError(f"{name} has shape {array.shape}: must be one-dimensional")
    check_length("y", y, "x", x.size)
    return x, y


def column(name: str, value: ArrayLike, like: str, n: int) -> Array:
    """A number, as an array of one, or n of them."""
    return aligned(np.ascontiguousarray(values(name, value, like, n), np.float64))


def values(name: str, value: ArrayLike, like: str, n: int) -> Array:
    """The same, of any dtype and with gaps."""
    array = as_array(name, value)
    if array.size == 1:
        return array.reshape(-1)
    check_length(name, array, like, n)
    return array


def pairs(i: ArrayLike, j: ArrayLike) -> tuple[Array, Array]:
    """The numbers of their balls."""
    i, j = numbers("i", i), numbers("j", j)
    check_length("j", j, "i", i.size)
    return i, j


def numbers(name: str, value: ArrayLike) -> Array:
    """The numbers of balls."""
    array = as_array(name, value)
    if array.ndim != 1:
        raise ValueError(f"{name} has shape {array.shape}: must be one-dimensional")
    if array.size and array.dtype.kind not in "iu":
        raise TypeError(f"{name} has dtype {array.dtype}: must have an integer dtype")
    return aligned(np.ascontiguousarray(array, np.int64))


def one_each(name: str, value: ArrayLike, like: str, n: int) -> Array:
    """n of them as they lie, or a number as n without a step."""
    array = as_array(name, value)
    if array.size == 1:
        return np.ndarray((n,), np.float64, np.ascontiguousarray(array, np.float64), strides=(0,))
    check_length(name, array, like, n)
    return aligned(np.asarray(array, np.float64))


def aligned(array: Array) -> Array:
    """Of arrays that are not Numba asks Python for the type, in the middle of a call."""
    return array if array.flags.aligned else array.copy()


def radii(radius: ArrayLike, like: str, n: int) -> Array:
    """One each, within the rules of `find_contacts`."""
    array = column("radius", radius, like, n)
    diameter = 2.0 * bounds_from_zero("radius", array)[1]
    if diameter > LONGEST:
        raise ValueError(f"2 radius = {diameter} for the largest ball: must be at most {LONGEST}")
    return one_each("radius", array, like, n)


def written(name: str, value: Any, dtypes: Sequence[Any]) -> Array:
    """An array that will be changed, of one of these dtypes."""
    if not isinstance(value, np.ndarray) or isinstance(value, MaskedArray):
        raise TypeError(f"{name} is of type {type(value).__name__}: must be a NumPy array, as it is written to")
    if value.dtype not in dtypes:
        raise TypeError(f"{name} has dtype {value.dtype}: must have {' or '.join(d.name for d in dtypes)}")
    if not value.flags.writeable:
        raise ValueError(f"{name} is read-only")
    return np.asarray(value)


def impulses(impulse: Any, like: str, n: int) -> Array:
    array = written("impulse", impulse, _FLOATS[:1])
    check_length("impulse", array, like, n)
    return array


def velocities(given: Mapping[str, Any], like: str, n: int) -> dict[str, Array]:
    """The components by name, n of each, all of one dtype."""
    columns: dict[str, Array] = {}
    for name, value in given.items():
        columns[name] = written(name, value, _FLOATS)
        check_length(name, columns[name], like, n)
        for other, column in columns.items():
            if column.dtype != value.dtype:
                raise TypeError(f"{name} has dtype {value.dtype}: must have that of {other}, {column.dtype}")
    return columns


def vectors(v: Any, lengths: Collection[int]) -> dict[str, Array]:
    """The components by name, of an array of rows or of a tuple of arrays; of so many as there is a form for."""
    listed = " or ".join(map(str, lengths))
    if isinstance(v, tuple):
        if len(v) not in lengths:
            raise ValueError(f"v has {len(v)} arrays: must have {listed}, one a component")
        like = written("v[0]", v[0], _FLOATS)
        if like.ndim != 1:
            raise ValueError(f"v[0] has shape {like.shape}: must be one-dimensional")
        return velocities({f"v[{c}]": column for c, column in enumerate(v)}, "v[0]", like.size)
    rows = written("v", v, _FLOATS)
    if rows.ndim != 2 or rows.shape[1] not in lengths:
        raise ValueError(f"v has shape {rows.shape}: must be (N, {listed}), a row a ball, or a tuple of arrays")
    return {f"v[:, {c}]": rows[:, c] for c in range(rows.shape[1])}


def normals(n: Any, k: int, d: int) -> list[Array]:
    """The components of one for each of k pairs: of a tuple's arrays, else of rows, or of one vector."""
    if isinstance(n, tuple):
        if len(n) != d:
            raise ValueError(f"n has {len(n)} components: must have {d}, as v has")
        return [one_each(f"n[{c}]", component, "i", k) for c, component in enumerate(n)]
    array = as_array("n", n)
    if array.shape not in ((k, d), (d,)):
        raise ValueError(f"n has shape {array.shape}: must have ({k}, {d}), a row a pair, or ({d},), one for all")
    return [one_each("n", array[..., c], "i", k) for c in range(d)]


def check_length(name: str, array: Array, like: str, n: int) -> None:
    if array.shape != (n,):
        raise ValueError(f"{name} has shape {array.shape}: must have that of {like}, ({n},)")


def sides(box: Any) -> tuple[float, float]:
    """Of the box, Lx and Ly; 0 for a side that is open."""
    if box is None:
        return 0.0, 0.0
    is_open = [side is None for side in box] if isinstance(box, list | tuple) else [False, False]
    given = [0.0 if side is None else side for side in box] if any(is_open) else box
    lengths = as_array("box", given)
    if lengths.shape != (2,):
        raise ValueError(f"box = {reprlib.repr(box)}: must be None or two lengths, (Lx, Ly), of which one may be None")
    lx, ly = float(lengths[0]), float(lengths[1])  # or float16 would be compared, and warn
    for k, side in enumerate((lx, ly)):
        if not (is_open[k] or SHORTEST <= side <= LONGEST):
            raise ValueError(f"box[{k}] = {lengths[k]}: must be from {SHORTEST} to {LONGEST}")
    return lx, ly


def bounds(name: str, array: Array) -> tuple[float, float]:
    """The least and the largest, if all are finite."""
    least, largest, finite = _BOUNDS.compiled(aligned(np.ascontiguousarray(array, np.float64)))
    if not finite:
        raise ValueError(f"{name}{first(array, ~np.isfinite(array))}: must be finite")
    return least, largest


def _kernel_bounds(array):  # type: ignore[no-untyped-def]  # compiled only
    """The least and the largest, 0 of none, and whether all are finite."""
    n, k = array.size, 0
    least = largest = array[0] if n > 0 else 0.0
    zero = 0.0
    if n >= WINDOW:
        lows = highs = window(array, 0)
        zeros = lows - lows
        while k + WINDOW <= n:
            some = window(array, k)
            lows, highs = select(some < lows, some, lows), select(some > highs, some, highs)
            zeros, k = zeros + (some - some), k + WINDOW  # NaN from the first on that is not finite
        for lane in range(WINDOW):
            least, largest = min(least, get(lows, lane)), max(largest, get(highs, lane))
            zero += get(zeros, lane)
    while k < n:
        least, largest = min(least, array[k]), max(largest, array[k])
        zero, k = zero + (array[k] - array[k]), k + 1
    return least, largest, zero == 0.0


_BOUNDS = Kernel(
    _kernel_bounds,
    types.Tuple((types.float64, types.float64, types.boolean))(types.Array(types.float64, 1, "C", readonly=True)),
    "_kernel_bounds",
)


def bounds_from_zero(name: str, array: Array) -> tuple[float, float]:
    """The least and the largest, if all are finite and none is negative."""
    least, largest = bounds(name, array)
    if least < 0.0:
        raise ValueError(f"{name}{first(array, array < 0.0)}: must be >= 0")
    return least, largest


def first(array: Array, wrong: Array) -> str:
    """Where and what the first wrong value is."""
    k = int(np.argmax(wrong))
    return f"[{k}] = {array[k]}" if array.size > 1 else f" = {array[k]}"


def raise_for_pairs(i: Array, j: Array, n: int) -> NoReturn:
    """The first fault of a list of pairs, in words."""
    for name, numbers in (("i", i), ("j", j)):
        wrong = (numbers < 0) | (numbers >= n)
        if wrong.any():
            k = int(np.argmax(wrong))
            raise IndexError(f"{name}[{k}] = {numbers[k]}: must be the number of one of the {n} balls, from 0 on")
    k = int(np.argmax(i == j))
    raise ValueError(f"i[{k}] = j[{k}] = {i[k]}: a ball cannot collide with itself")
