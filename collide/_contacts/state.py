"""What the functions of a ball state ask of their arguments, and say of wrong ones."""

from __future__ import annotations

import reprlib
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


def columns(x: ArrayLike, y: ArrayLike) -> tuple[Array, Array]:
    """The positions, of equal length."""
    columns = []
    for name, value in (("x", x), ("y", y)):
        array = as_array(name, value)
        if array.ndim != 1:
            raise ValueError(f"{name} has shape {array.shape}: must be one-dimensional")
        columns.append(np.ascontiguousarray(array, np.float64))
    check_length("y", columns[1], "x", columns[0].size)
    return columns[0], columns[1]


def column(name: str, value: ArrayLike, like: str, n: int) -> Array:
    """A number, as an array of one, or n of them."""
    array = as_array(name, value)
    if array.size != 1:
        check_length(name, array, like, n)
    return np.ascontiguousarray(array, np.float64).reshape(-1)


def numbers(name: str, value: ArrayLike) -> Array:
    """The numbers of balls."""
    array = as_array(name, value)
    if array.ndim != 1:
        raise ValueError(f"{name} has shape {array.shape}: must be one-dimensional")
    if array.size and array.dtype.kind not in "iu":
        raise TypeError(f"{name} has dtype {array.dtype}: must have an integer dtype")
    return np.ascontiguousarray(array, np.int64)


def output(name: str, value: Any, like: str, n: int) -> Array:
    if not isinstance(value, np.ndarray) or isinstance(value, MaskedArray):
        raise TypeError(f"{name} is of type {type(value).__name__}: must be a NumPy array, as it is written to")
    if value.dtype != np.float64:
        raise TypeError(f"{name} has dtype {value.dtype}: must have float64")
    if not value.flags.writeable:
        raise ValueError(f"{name} is read-only")
    check_length(name, value, like, n)
    return value


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
    least, largest, finite = _BOUNDS.compiled(np.ascontiguousarray(array, np.float64))
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
