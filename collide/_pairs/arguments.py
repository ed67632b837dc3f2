"""What the arguments of a call must be, and what is said of those that are not."""

from __future__ import annotations

import contextlib
import itertools
import math
import reprlib
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.ma import MaskedArray  # imported by Numba's first look at an array otherwise, in the middle of a call

from .._typing import Array

# Python's numbers are weak, as in NumPy's own arithmetic.
WEAK: dict[type, Any] = {bool: False, int: 0, float: 0.0}

# As many as an address can count the bytes of.
_MOST = np.iinfo(np.intp).max // 8


def as_array(name: str, value: Any) -> Array:
    """An argument as an array of numbers, or a TypeError that names it."""
    if type(value) is int:  # of any size, as a float is
        try:
            value = float(value)
        except OverflowError:
            raise TypeError(f"{name}: an integer of {value.bit_length()} bits is too large for float64") from None
    try:
        array = np.asanyarray(value)
    except MemoryError:
        raise
    except Exception as error:  # of whatever class: it comes from the object
        if _is_elsewhere(value):
            raise TypeError(_ELSEWHERE.format(name, type(value).__name__)) from error
        raise TypeError(f"{name} = {reprlib.repr(value)}: must be an array of numbers ({error})") from error
    parts = value if isinstance(value, list | tuple) else ()
    if any(isinstance(a, MaskedArray) for a in (array, *parts)):
        raise TypeError(f"{name}: masked arrays are not supported; pass .filled(...) or .compressed()")
    if array.dtype.kind == "O" and any(map(_is_elsewhere, (value, *parts))):
        raise TypeError(_ELSEWHERE.format(name, type(value).__name__))
    if array.dtype.kind not in "biuf" or (array.dtype.kind == "f" and array.dtype.itemsize > 8):
        raise TypeError(
            f"{name}: the dtype {array.dtype} is not supported; must be bool, an integer, float16, float32 or float64"
        )
    return np.asarray(array)


_ELSEWHERE = "{} is of type {}, in the memory of a GPU or another device: must be copied to the host first"


def _is_elsewhere(value: Any) -> bool:
    """Whether it says that its numbers are in the memory of a GPU, in CUDA's way or in that of any other device."""
    with contextlib.suppress(Exception):
        if hasattr(value, "__cuda_array_interface__"):
            return True
    with contextlib.suppress(Exception):
        return value.__dlpack_device__()[0] not in (1, 3)  # the host's memory, pinned or not
    return False


def result_dtype(values: Iterable[Any], arrays: Iterable[Array]) -> np.dtype[Any]:
    """Of arguments as they were given, and as arrays."""
    kinds = {WEAK.get(type(value), a.dtype) for value, a in zip(values, arrays, strict=True)}
    narrow = np.result_type(*kinds) in (np.float32, np.float16)
    return np.dtype(np.float32 if narrow else np.float64)


def broadcast_shape(names: Iterable[str], arrays: Iterable[Array], vectors: Sequence[str] = ()) -> tuple[int, ...]:
    """The common shape, or an error that lists all; of vectors without the last axis."""
    whole = dict(zip(names, arrays, strict=True))
    shapes = {a.shape[:-1] if name in vectors else a.shape for name, a in whole.items()} - {()}
    if len(shapes) > 1:
        # Not by np.broadcast_shapes, which ends at 32 of the 64 dimensions that arrays may have.
        axes = [*map(set, itertools.zip_longest(*(shape[::-1] for shape in shapes), fillvalue=1))]
        shape = tuple([1 if axis == {1} else max(axis - {1}) for axis in axes])[::-1]
        fits = all(len(axis - {1}) < 2 for axis in axes if len(axis) > 1)
    else:
        shape, fits = shapes.pop() if shapes else (), True
    if fits and math.prod(filter(None, shape)) <= _MOST:
        return shape
    fault = f"broadcast to {shape}, more than {_MOST} elements" if fits else "do not broadcast together"
    listed = ", ".join(f"{name} {array.shape}" for name, array in whole.items() if array.ndim)
    raise ValueError(f"the shapes of the arguments {fault}: {listed}")


def checked_outputs(names: Sequence[str], out: Any, shape: tuple[int, ...], dtype: np.dtype[Any]) -> list[Array]:
    """The arrays of `out`, if they can take the results."""
    if not isinstance(out, tuple):
        raise TypeError(f"out = {type(out).__name__}: must be None or a tuple of {len(names)} arrays")
    if len(out) != len(names):
        raise ValueError(f"out has {len(out)} arrays: must have {len(names)}, for {', '.join(names)}")
    labels = [f"out[{i}]" for i in range(len(out))] if len(out) > 1 else ["out"]
    for label, u in zip(labels, out, strict=True):
        if not isinstance(u, np.ndarray) or isinstance(u, MaskedArray):
            raise TypeError(f"{label} is of type {type(u).__name__}: must be a NumPy array")
        if u.dtype != dtype:
            raise TypeError(f"{label} has dtype {u.dtype}: must have the result's, {dtype}")
        if u.shape != shape:
            raise ValueError(f"{label} has shape {u.shape}: must have the broadcast shape, {shape}")
        if not u.flags.writeable:
            raise ValueError(f"{label} is read-only")
    for (i, a), (j, b) in itertools.combinations(enumerate(out), 2):
        if a is b or share_memory(a, b):
            raise ValueError(f"out[{i}] and out[{j}] share memory")
    return list(out)


def share_memory(a: Array, b: Array) -> bool:
    """Whether two arrays share memory; where that is too hard to tell, it is taken for granted."""
    if not np.may_share_memory(a, b):
        return False
    try:
        return np.shares_memory(a, b, max_work=10_000)  # type: ignore[arg-type]  # any number, says NumPy
    except np.exceptions.TooHardError:
        return True


def truth(name: str, value: Any) -> bool:
    if not isinstance(value, bool | np.bool_):
        raise TypeError(f"{name} = {reprlib.repr(value)}: must be True or False")
    return bool(value)


def gives_nan(invalid: Any, rules: Mapping[str, bool]) -> bool:
    """Whether an invalid pair gets NaN, by an option that has to be one of these."""
    if type(invalid) is not str or invalid not in rules:
        raise ValueError(f"invalid = {reprlib.repr(invalid)}: must be one of {', '.join(map(repr, rules))}")
    return rules[invalid]
